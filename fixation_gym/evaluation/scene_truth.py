"""Where things truly are in a running episode of the pick task, for traces."""

from __future__ import annotations

from dataclasses import dataclass

import gymnasium
import numpy as np

from fixation_gym.envs.object_pool import obstacle_shape, target_shape
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
    for body in base.sim.obstacles:  # they need not be in the order of the scene: a mirror has a body of its own
        position = base.sim.body_position(body)
        spec = min(scene.obstacles, key=lambda obstacle: float(np.linalg.norm(position - obstacle.position)))
        boxes.append(_obstacle_box(spec))
    return PickScene(base, tuple(boxes))


def _target_box(target: TargetSpec) -> SceneBox:
    half = target_shape(target.shape).half_extent
    x, y, z = (size * scale for size, scale in zip(half, target.scale, strict=True))
    return SceneBox("target", (x, y, z), target.yaw)


def _obstacle_box(obstacle: ObstacleSpec) -> SceneBox:
    x, y, z = (size * obstacle.scale for size in obstacle_shape(obstacle.kind, obstacle.shape).half_extent)
    return SceneBox(obstacle.kind, (x, y, z), obstacle.yaw)
