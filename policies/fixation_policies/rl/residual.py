"""The residual learner: the servo policy acts, and the learner adds to its lateral velocity."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from fixation_gym.control import gaze, servo_laws
from fixation_gym.control.gaze import GazeGains
from fixation_gym.control.open_loop import Stage
from fixation_gym.envs.pick_env import FixationPickEnv
from fixation_gym.envs.zfc_observation import fixation_vector, map_levels, proprio_vector, zfc_observation_space
from fixation_gym.geometry.rigid import pose_to_matrix
from fixation_gym.perception.distance.pose_filter import Fixation
from fixation_gym.perception.percept import Percept
from fixation_gym.robots import ROBOT
from fixation_gym.types import Command, FloatArray, Observation
from fixation_policies.catalogue import make_policy
from fixation_policies.servo.phases import Phase
from fixation_policies.servo.servo_policy import ServoPolicy

_SHARE = 0.5
"""Velocity added at action 1, in units of the camera's largest speed."""
_STAGES = {stage.value: stage for stage in Stage}


class ResidualServo:
    """The servo with room for a learner: ``look`` at an observation, then take the ``action`` for a residual."""

    def __init__(self, servo: ServoPolicy) -> None:
        """Use a servo with its perception; a residual of 0 leaves it as it is."""
        self.servo = servo

    def reset(self, seed: int | None = None) -> None:
        """Forget the last episode."""
        self.servo.reset(seed)

    def look(self, reading: Observation, fresh: bool = True) -> dict[str, NDArray[Any]]:
        """Let the servo respond; returns what ``FixationPickZFC-v0`` would show.

        Args:
            reading: the observation of ``FixationPick-v0``.
            fresh: whether its image is new.
        """
        self._command = self.servo.respond(reading, fresh)
        self._T_base_cam = pose_to_matrix(reading.camera_pose)
        stage = _STAGES.get(self.phase)
        return {
            "zfc_map": map_levels(self._percept.zfc.cells),
            "fixation": fixation_vector(self._percept.fixation),
            "proprio": proprio_vector(reading, self._T_base_cam, stage),
        }

    @property
    def _percept(self) -> Percept:
        assert self.servo.percept is not None
        return self.servo.percept

    @property
    def phase(self) -> str:
        """What the servo is doing."""
        assert self.servo.estimate is not None
        return self.servo.estimate.phase

    def action(self, residual: NDArray[np.float32]) -> NDArray[np.float32]:
        """Action of ``FixationPick-v0``, shape (7,), for a residual of shape (2,) in [-1, 1]."""
        command = self._command
        if self.phase != Phase.SEARCH.value and self.phase not in _STAGES:
            gains = self.servo.gains.gaze
            command = _with_lateral(command, residual, self._percept.fixation, self._T_base_cam, gains)
        return np.array([*command.camera_twist / ROBOT.arm.twist_limits, command.gripper], np.float32)


class ResidualEnv(gym.Wrapper[dict[str, Any], NDArray[np.float32], dict[str, Any], NDArray[np.float32]]):
    """``FixationPick-v0`` for the residual learner: observation "zfc", action the residual."""

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        """Wrap ``FixationPick-v0``."""
        super().__init__(env)
        base = env.unwrapped
        assert isinstance(base, FixationPickEnv)
        servo = make_policy("servo", env)
        assert isinstance(servo, ServoPolicy)
        self._base, self._servo = base, ResidualServo(servo)
        self.observation_space = zfc_observation_space("zfc", (base.intrinsics.height, base.intrinsics.width))
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Draw a new scene."""
        obs, info = self.env.reset(seed=seed, options=options)
        self._servo.reset()
        return self._look(obs), info

    def step(self, action: NDArray[np.float32]) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Run one control period."""
        obs, reward, terminated, truncated, info = self.env.step(self._servo.action(action))
        return self._look(obs), float(reward), terminated, truncated, info

    def _look(self, obs: Mapping[str, Any]) -> dict[str, Any]:
        return self._servo.look(Observation.from_dict(obs), self._base.camera_on)


def _with_lateral(
    command: Command, residual: NDArray[np.float32], fixation: Fixation, T_base_cam: FloatArray, gains: GazeGains
) -> Command:
    """Add to v_X and v_Y, within the arm's reach, with the rotation that keeps the gaze where it is.

    The whole is slowed down to what the camera may do.
    """
    before = command.camera_twist[:2]
    wanted = before + _SHARE * ROBOT.arm.linear_speed * np.clip(residual, -1.0, 1.0)
    added = np.array([*(gaze.within_reach(wanted, T_base_cam, fixation.point_base, gains) - before), 0.0])
    rotation = servo_laws.gaze_rotation(fixation.centroid, 0.0, 1.0 / fixation.distance_m, added, 0.0)
    return Command(gaze.within_speed(command.camera_twist + np.array([*added, *rotation, 0.0])), command.gripper)
