"""The privileged oracle: knows the scene, so it shows what a perfect sense of distance and obstacles could reach."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from fixation_gym.control import servo_laws
from fixation_gym.control.corridor import free_directions
from fixation_gym.robot import TOOL_IN_CAMERA, TWIST_LIMITS
from fixation_gym.types import FloatArray
from policies.base import Action, Estimate

if TYPE_CHECKING:
    from fixation_gym.envs.pick_env import FixationPickEnv

_VIEW_DISTANCE, _GRASP_DISTANCE = 0.42, 0.18
_ROUND_SHAPES = ("cylinder", "ball", "ring")
_CLOSE_SECONDS = 0.8


class OraclePolicy:
    """Circles the target until a straight approach is free, goes in, grasps, lifts; uses true poses only."""

    def __init__(self, env: FixationPickEnv) -> None:
        """Look into ``env``, an unwrapped ``FixationPick-v0``."""
        self._env = env
        self.estimate: Estimate | None = None
        self.reset()

    def reset(self, seed: int | None = None) -> None:
        """Forget the last episode. The behaviour is deterministic; ``seed`` is not used."""
        self._phase = "fixate"
        self._phase_start = 0.0
        self._direction: FloatArray | None = None
        self._goal = np.zeros(3)
        self.estimate = None

    def act(self, obs: Mapping[str, Any]) -> Action:
        """Action of shape (7,); of the observation only the time is used."""
        pose = self._env.sim.arm_state().camera_pose
        target = self._env.sim.body_position("target")
        time = float(obs["time"][0])
        if self._direction is None:
            self._direction = self._choose_direction(pose, target)
        self._advance(pose, target, time)
        if self._phase in ("fixate", "approach"):
            twist = self._fixating_twist(pose, target)
        elif self._phase == "close":
            twist = np.zeros(6)
        else:
            twist = servo_laws.pose_twist(pose, self._waypoint(pose), 4.0, 0.12)
        depth = float(pose[:3, 2] @ (target - pose[:3, 3]))
        self.estimate = Estimate(depth, 1e-6, self._phase)
        twist = twist / max(1.0, float(np.max(np.abs(twist) / TWIST_LIMITS)))
        gripper = 1.0 if self._phase in ("close", "lift") else -1.0
        return np.array([*twist / TWIST_LIMITS, gripper], dtype=np.float32)

    def _choose_direction(self, pose: FloatArray, target: FloatArray) -> FloatArray:
        """Free approach direction nearest to the present one, with as much room as there is."""
        from fixation_gym.envs.scene import reachable_directions

        scene = self._env.scene
        assert scene is not None, "reset the environment before the policy acts"
        boxes = [obstacle.box for obstacle in scene.obstacles]
        directions = reachable_directions(target)
        present = (pose[:3, 3] - target) / np.linalg.norm(pose[:3, 3] - target)
        order = np.argsort(-directions @ present)
        for margin in (0.03, 0.02, 0.01, 0.0):
            free = free_directions(target, boxes, directions[order], margin)
            if free.any():
                return directions[order][int(np.argmax(free))]
        return directions[order[0]]

    def _advance(self, pose: FloatArray, target: FloatArray, time: float) -> None:
        assert self._direction is not None
        present = (pose[:3, 3] - target) / np.linalg.norm(pose[:3, 3] - target)
        distance = float(np.linalg.norm(pose[:3, 3] - target))
        elapsed = time - self._phase_start
        done = {
            "fixate": float(present @ self._direction) > math.cos(math.radians(4.0)) or elapsed > 8.0,
            "approach": distance < _GRASP_DISTANCE * 1.03,
            "grasp": float(np.linalg.norm(self._goal - pose[:3, 3])) < 0.003 or elapsed > 4.0,
            "close": elapsed > _CLOSE_SECONDS,
            "lift": False,
        }[self._phase]
        if not done:
            return
        order = ("fixate", "approach", "grasp", "close", "lift")
        self._phase, self._phase_start = order[order.index(self._phase) + 1], time
        if self._phase == "grasp":
            self._goal = target - pose[:3, :3] @ TOOL_IN_CAMERA
        elif self._phase == "lift":
            self._goal = pose[:3, 3] + [0.0, 0.0, 0.16]

    def _waypoint(self, pose: FloatArray) -> FloatArray:
        """In the grasp, first in line with the approach axis, then forward."""
        if self._phase == "lift":
            return self._goal
        return servo_laws.funnel_waypoint(pose, self._goal, slope=2.0, length=0.06)

    def _fixating_twist(self, pose: FloatArray, target: FloatArray) -> FloatArray:
        assert self._direction is not None
        point = pose[:3, :3].T @ (target - pose[:3, 3])
        centroid, depth = point[:2] / point[2], float(point[2])
        desired = _VIEW_DISTANCE if self._phase == "fixate" else _GRASP_DISTANCE
        offset = pose[:3, :3].T @ (target + depth * self._direction - pose[:3, 3])
        lateral = 3.0 * offset[:2]
        lateral *= min(1.0, 0.13 / max(float(np.linalg.norm(lateral)), 1e-9))
        forward = float(np.clip(1.5 * (depth - desired), -0.10, 0.10))
        v = np.array([*lateral, forward])
        roll = servo_laws.roll_rate(self._roll_error(pose), 2.0)
        w = servo_laws.gaze_rotation(centroid, 4.0, 1.0 / depth, v, roll)
        return np.array([*v, *w, roll])

    def _roll_error(self, pose: FloatArray) -> float:
        """Level for round targets, otherwise across the target's narrow axis, rad."""
        scene = self._env.scene
        assert scene is not None
        if self._phase == "fixate" or scene.target.shape in _ROUND_SHAPES:
            level = math.atan2(pose[2, 0], -pose[2, 1])
            return level * float(np.hypot(pose[2, 0], pose[2, 1]))
        matrix = self._env.sim.data.body("target").xmat.reshape(3, 3)
        across = pose[:3, :3].T @ matrix[:, 1]
        return (math.atan2(across[1], across[0]) + math.pi / 2) % math.pi - math.pi / 2
