"""The door for robots: what moves, real or simulated. Its numbers are a ``RobotModel``."""

from __future__ import annotations

from typing import Protocol

from fixation_gym.types import Command, Observation


class Robot(Protocol):
    """An arm with a camera in its hand."""

    def observe(self) -> Observation:
        """The newest reading; waits for none, so it may be the one of the last call."""
        ...

    def command(self, command: Command) -> None:
        """Move the camera at this twist, expressed in the moving ``cam``, until the next command.

        A real robot rests by itself when none has come for 0.2 s: the program that sends them may have died.
        """
        ...
