"""Where things truly are in a running episode of the pick task, for traces."""

from __future__ import annotations

from dataclasses import dataclass

import gymnasium
import numpy as np

from fixation_gym.envs.object_pool import target_shape
from fixation_gym.envs.pick_env import FixationPickEnv
from fixation_gym.envs.scene import ObstacleSpec, TargetSpec
from fixation_gym.evaluation.trace import SceneBox
from fixation_gym.types import FloatArray


@dataclass(frozen=True, eq=False)
class PickScene:
    """The scene of the episode that an environment is in."""

    env: FixationPickEnv
    boxes: tuple[SceneBox, ...]
    """The target first, then the obstacles in the order of the simulation's bodies."""

    def tool_position(self) -> FloatArray:
        """Point between the finger pads in base, shape (3,), m."""
        return self.env.sim.tool_position()

    def positions(self) -> FloatArray:
        """Centres of the boxes in base, shape (len(boxes), 3), m."""
        return np.array([self.env.sim.body_position(body) for body in ("target", *self.env.sim.obstacles)])


def scene_of(env: gymnasium.Env) -> PickScene | None:
    """The scene of an environment that has just been reset; None if it is not the pick task."""
    base = env.unwrapped
    if not isinstance(base, FixationPickEnv) or base.scene is None:
        return None
    scene = base.scene
    boxes = [_target_box(scene.target)]
    boxes += [_obstacle_box(obstacle) for obstacle in scene.obstacles]  # in the order of the simulation's bodies
    return PickScene(base, tuple(boxes))


def _target_box(target: TargetSpec) -> SceneBox:
    half = target_shape(target.shape).half_extent
    x, y, z = (size * scale for size, scale in zip(half, target.scale, strict=True))
    return SceneBox("target", (x, y, z), target.yaw)


def _obstacle_box(obstacle: ObstacleSpec) -> SceneBox:
    return SceneBox(obstacle.kind, obstacle.shape.half_extent, obstacle.yaw)
