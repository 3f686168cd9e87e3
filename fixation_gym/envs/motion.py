"""Motions that a scenario plans for objects: decided at reset, values that depend on time alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fixation_gym.types import FloatArray

_STEP = 0.02
"""Distance between the places of ``places``, m."""


@dataclass(frozen=True)
class Motion:
    """A straight way over the table at constant speed."""

    start_s: float
    """Time since reset at which it begins, s."""
    displacement: tuple[float, float]
    """From the object's place at reset to the other end, along x and y of base, m."""
    speed: float
    """Speed on the way, m/s; above 0."""
    to_and_fro: bool = False
    """True: driven, it goes there and back until the episode ends. False: pushed, it goes once and stays."""

    def __post_init__(self) -> None:
        if self.start_s < 0.0 or self.speed <= 0.0:
            raise ValueError(f"a motion needs start_s >= 0 and speed > 0, got {self.start_s} and {self.speed}")

    @property
    def length(self) -> float:
        """Length of the way, m."""
        return math.hypot(*self.displacement)

    @property
    def end_s(self) -> float:
        """Time since reset at which it is over, s; inf for what is driven."""
        return math.inf if self.to_and_fro else self.start_s + self.length / self.speed


def planned(motion: Motion, time: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Offset from the place at reset in m, and velocity in m/s, along x and y of base, at ``time`` s since reset."""
    length, travelled = motion.length, motion.speed * (time - motion.start_s)
    if travelled <= 0.0 or length == 0.0:
        return (0.0, 0.0), (0.0, 0.0)
    x, y = motion.displacement
    if not motion.to_and_fro and travelled >= length:
        return (x, y), (0.0, 0.0)
    phase = travelled / length % 2.0
    share, direction = (phase, 1.0) if phase < 1.0 else (2.0 - phase, -1.0)
    rate = direction * motion.speed / length
    return (share * x, share * y), (rate * x, rate * y)


def places(motion: Motion | None) -> FloatArray:
    """Offsets from the place at reset along the whole way, at most 2 cm apart, shape (n, 3), m; zero without motion."""
    if motion is None:
        return np.zeros((1, 3))
    shares = np.linspace(0.0, 1.0, 1 + math.ceil(motion.length / _STEP))
    return shares[:, None] * [*motion.displacement, 0.0]
