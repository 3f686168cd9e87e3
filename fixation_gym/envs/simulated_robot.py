"""``SimulatedRobot``: the robot of ``FixationPick-v0`` behind the door for real ones."""

from __future__ import annotations

from typing import Any

import gymnasium as gym

from fixation_gym.fixator import action_of
from fixation_gym.robot_loop import REST
from fixation_gym.types import Command, Observation

_STEP_SHARE = 1e-6
"""A time that is missed by less than this share of a step is reached."""


class SimulatedRobot:
    """A ``Robot``, and the clock of its world: simulated time passes while somebody waits, and nowhere else.

    Like a real one it knows no episodes: it moves on after a success or when the environment's time is over.
    """

    def __init__(self, env: gym.Env[Any, Any], seed: int | None = None) -> None:
        """Reset a ``FixationPick-v0``; it stays the caller's to close."""
        self._env: Any = env.unwrapped
        self._sensed, self.info = self._env.reset(seed=seed)
        """``info`` of the environment, for who wants to know the truth."""
        self._steps, self._command = 0, REST

    def observe(self) -> Observation:
        """What the environment shows now."""
        return Observation.from_dict(self._sensed)

    def command(self, command: Command) -> None:
        """Move so from now on."""
        self._command = command

    def now(self) -> float:
        """Simulated time, s."""
        return self._steps / self._env.control_frequency

    def wait_until(self, time_s: float) -> None:
        """Run the simulation until then, in whole steps."""
        while self.now() < time_s - _STEP_SHARE / self._env.control_frequency:
            self._sensed, _, _, _, self.info = self._env.step(action_of(self._command))
            self._steps += 1
