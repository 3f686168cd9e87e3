"""The motions of policies that know the scene: around the target, straight in, grasp, lift, and once more."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from fixation_gym.control import gaze, open_loop, servo_laws
from fixation_gym.control.corridor import approach_directions
from fixation_gym.envs.object_pool import target_shape
from fixation_gym.envs.scene import SceneSpec
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray
from fixation_policies.base import Action, Estimate, SimulatedWorld
from fixation_policies.grips import half_turn

Choice = tuple[FloatArray, int]
"""A straight way: unit vector from the target to the camera, shape (3,), in base, and the axis of the target along
which the fingers close; -1: any."""

VIEW_DISTANCE, GRASP_DISTANCE = 0.42, 0.18
"""Distance of the camera from the target on the way around it, and at the end of the approach, m."""
_RETREAT_DISTANCE = 0.30
_SPEED = 0.10
"""Of the approach, m/s."""
_HELD = 0.045
"""A target whose centre is farther than this from the tool's point is not held, m."""
_PALM_ROOM = round(ROBOT.hand.palm - 0.002, 4)
"""How deep a body may be that is held at its centre, m: 2 mm stay free before the palm."""
_GAINS = open_loop.OpenLoopGains()
_MOVED = 0.02
"""A target that is farther than this from where it was aimed at is aimed at again, m."""
_NEAR_ANGLE, _NEAR_ROLL = math.radians(2.0), math.radians(3.0)
"""It goes in when it looks along its way this nearly, and its hand is turned as the grasp needs: a hand that turns on
the way in meets what stands beside the way."""
_ARRIVED, _BACK = 0.0015, 0.003
"""The fingers close within this of their goal, m: a thin thing that is held above its middle slips. Backing off need
not be so exact."""
_PHASES = ("fixate", "approach", "grasp", "close", "lift")


class PrivilegedPolicy:
    """Circles the target, goes in straight, grasps, lifts; uses true poses only.

    It does not know that the target will be pushed: when the target has moved, or the hand is empty, it backs off and
    starts again. A subclass says by ``choose`` which way it takes, and may say by ``come_in`` how.
    """

    view_distance = VIEW_DISTANCE

    def __init__(self, env: SimulatedWorld) -> None:
        """Look into ``env``, such as an unwrapped ``FixationPick-v0``."""
        self._env = env
        self.estimate: Estimate | None = None
        self.reset()

    def reset(self, seed: int | None = None) -> None:
        """Forget the last episode. The behaviour is deterministic; ``seed`` is not used."""
        self._phase = "fixate"
        self._phase_start = 0.0
        self._aim = np.full(3, np.inf)
        self._now = 0.0
        self._direction, self._grip = np.array([0.0, 0.0, 1.0]), -1
        self._goal = np.zeros(3)
        self.estimate = None

    def act(self, obs: Mapping[str, Any]) -> Action:
        """Action of shape (7,); of the observation only the time is used."""
        pose = self._env.sim.arm_state().camera_pose
        target = self._env.sim.body_position("target")
        self._now = float(obs["time"][0])
        self._advance(pose, target, self._now)
        if self._phase in ("fixate", "approach"):
            twist = self._fixating_twist(pose, target)
        elif self._phase == "close":
            twist = np.zeros(6)
        else:
            twist = servo_laws.pose_twist(pose, self._waypoint(pose), 4.0, 0.12)
        depth = float(pose[:3, 2] @ (target - pose[:3, 3]))
        self.estimate = Estimate(depth, 1e-6, self._phase)
        gripper = 1.0 if self._phase in ("close", "lift") else -1.0
        return np.array([*gaze.within_speed(twist) / ROBOT.arm.twist_limits, gripper], dtype=np.float32)

    # -- phases --------------------------------------------------------------------------------------------------

    def _advance(self, pose: FloatArray, target: FloatArray, time: float) -> None:
        """Choose the phase in which to act now."""
        elapsed = time - self._phase_start
        distance = float(np.linalg.norm(pose[:3, 3] - target))
        if self._phase in ("fixate", "approach", "grasp") and np.linalg.norm(target - self._aim) > _MOVED:
            self._aim_at(pose, target, time)
            if self._phase == "grasp":
                self._begin("recover", pose, target, time)
            elif not self._is_lined_up(pose, target):
                self._begin("fixate", pose, target, time)
            return
        held = np.linalg.norm(target - self._env.sim.tool_position()) < _HELD
        if self._phase in ("close", "lift") and elapsed > _GAINS.close_seconds and not held:
            self._begin("recover", pose, target, time)
            return
        left = float(np.linalg.norm(self._goal - pose[:3, 3]))
        arrived, near = left < _ARRIVED, left < _BACK
        done = {
            "fixate": self._is_lined_up(pose, target) or elapsed > 8.0,
            "approach": distance < GRASP_DISTANCE * 1.03,
            "grasp": arrived or elapsed > 4.0,
            "close": elapsed > _GAINS.close_seconds,
            "lift": False,
            "recover": near or elapsed > 3.0,
        }[self._phase]
        if done and self._phase == "recover":
            self._aim_at(pose, target, time)
            self._begin("fixate", pose, target, time)
        elif done:
            self._begin(_PHASES[_PHASES.index(self._phase) + 1], pose, target, time)

    def _begin(self, phase: str, pose: FloatArray, target: FloatArray, time: float) -> None:
        self._phase, self._phase_start = phase, time
        if phase == "grasp":
            self._goal = self._grasp_point(pose, target) - pose[:3, :3] @ ROBOT.tool_in_camera
        elif phase == "lift":
            self._goal = open_loop.lifted(pose, _GAINS.lift_height)
        elif phase == "recover":
            back = max(0.0, _RETREAT_DISTANCE - float(pose[:3, 2] @ (target - pose[:3, 3])))
            self._goal = pose[:3, 3] - back * pose[:3, 2]

    def _aim_at(self, pose: FloatArray, target: FloatArray, time: float) -> None:
        self._direction, self._grip = self.choose(pose, target, time)
        self._aim = target.copy()

    # -- the way -------------------------------------------------------------------------------------------------

    def choose(self, pose: FloatArray, target: FloatArray, time: float) -> Choice:
        """Choose the straight way that is gone next; a subclass says how.

        Args:
            pose: T_base_cam, shape (4, 4).
            target: its centre in base, shape (3,), m.
            time: since reset, s.

        Returns:
            Unit vector from the target to the camera, shape (3,), in base, and the axis of the target along which the
            fingers close; -1: any.
        """
        raise NotImplementedError

    def come_in(self, depth: float, seconds: float) -> tuple[FloatArray, float]:
        """Direction from which to look, shape (3,), in base, and speed of the approach, m/s.

        Args:
            depth: of the target, m; inf before the approach.
            seconds: since the approach began, s.
        """
        return self._direction, _SPEED

    @property
    def _rotation(self) -> FloatArray:
        """Of the target, shape (3, 3), in base."""
        return self._env.sim.data.body("target").xmat.reshape(3, 3)

    @property
    def _scene(self) -> SceneSpec:
        scene = self._env.scene
        assert scene is not None, "reset the environment before the policy acts"
        return scene

    def _wanted(self, pose: FloatArray, target: FloatArray) -> tuple[FloatArray, float]:
        """Direction from which to look now, shape (3,), and speed of the approach, m/s."""
        if self._phase != "approach":
            return self.come_in(math.inf, 0.0)
        return self.come_in(float(pose[:3, 2] @ (target - pose[:3, 3])), self._now - self._phase_start)

    def _angle(self, pose: FloatArray, target: FloatArray) -> float:
        """Angle between the present and the wanted direction, rad."""
        present = (pose[:3, 3] - target) / np.linalg.norm(pose[:3, 3] - target)
        return math.acos(float(np.clip(present @ self._wanted(pose, target)[0], -1.0, 1.0)))

    def _is_lined_up(self, pose: FloatArray, target: FloatArray) -> bool:
        """Whether the hand is on its way, and turned as it will be at the target."""
        return self._angle(pose, target) < _NEAR_ANGLE and abs(self._roll_error(pose)) < _NEAR_ROLL

    def _grasp_point(self, pose: FloatArray, target: FloatArray) -> FloatArray:
        """Where the tool goes, shape (3,), in base: to the target's centre, but neither palm nor fingers touch."""
        point = target - self._back_off(pose[:3, 2]) * pose[:3, 2]
        lowest = open_loop.lowest_grasp(pose, float(target[2]), ROBOT.workspace.table_height, _GAINS)
        point[2] = max(point[2], lowest)
        return point

    def _back_off(self, axis: FloatArray) -> float:
        """How far before the target's centre the tool stops so that the palm does not touch it, m."""
        spec, rotation = self._scene.target, self._rotation
        half = np.array(target_shape(spec.shape).half_extent) * spec.scale
        x, y, z = np.abs(rotation.T @ axis)
        depth = {
            "box": half @ [x, y, z],
            "cylinder": half[0] * math.hypot(x, y) + half[2] * z,
            "ring": half[0] * math.hypot(x, y) + half[2] * z,
            "ball": half[0],
            "duck": 0.0,  # only its body is broad enough to be held; what is above it fits between the fingers
        }[spec.shape]
        return float(np.clip(depth - _PALM_ROOM, 0.0, 0.02))

    # -- motions -------------------------------------------------------------------------------------------------

    def _waypoint(self, pose: FloatArray) -> FloatArray:
        """In the grasp, first in line with the approach axis, then forward."""
        if self._phase != "grasp":
            return self._goal
        return servo_laws.funnel_waypoint(pose, self._goal, slope=2.0, length=0.06)

    def _fixating_twist(self, pose: FloatArray, target: FloatArray) -> FloatArray:
        point = pose[:3, :3].T @ (target - pose[:3, 3])
        centroid, depth = point[:2] / point[2], float(point[2])
        towards, speed = self._wanted(pose, target)
        desired = GRASP_DISTANCE
        if self._phase == "fixate":
            desired, towards, speed = self.view_distance, _next_direction(pose, target, towards), _SPEED
        offset = pose[:3, :3].T @ (target + depth * towards - pose[:3, 3])
        lateral = 3.0 * offset[:2]
        lateral *= min(1.0, 0.13 / max(float(np.linalg.norm(lateral)), 1e-9))
        forward = float(np.clip(1.5 * (depth - desired), -_SPEED, speed))
        v = np.array([*lateral, forward])
        roll = servo_laws.roll_rate(self._roll_error(pose), 2.0)
        w = servo_laws.gaze_rotation(centroid, 4.0, 1.0 / depth, v, roll)
        return np.array([*v, *w, roll])

    def _roll_error(self, pose: FloatArray) -> float:
        """Level for round targets, otherwise across the target's chosen axis, rad."""
        if self._grip < 0:
            level = math.atan2(pose[2, 0], -pose[2, 1])
            return level * float(np.hypot(pose[2, 0], pose[2, 1]))
        across = pose[:3, :3].T @ self._rotation[:, self._grip]
        return float(half_turn(math.atan2(across[1], across[0])))


def _next_direction(pose: FloatArray, target: FloatArray, direction: FloatArray) -> FloatArray:
    """Direction to go to on the way to another one: up first, down last, around in between."""
    present = pose[:3, 3] - target
    height = math.atan2(present[2], math.hypot(present[0], present[1]))
    wanted = math.asin(float(np.clip(direction[2], -1.0, 1.0)))
    if wanted < height + math.radians(8.0):
        return direction
    azimuth = math.atan2(-present[1], -present[0])
    return approach_directions(np.array([azimuth]), np.array([wanted]))[0]
