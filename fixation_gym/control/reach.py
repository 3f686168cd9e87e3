"""From which directions the arm can come in to a target: its ``Reach`` as directions, spread evenly or drawn."""

from __future__ import annotations

import math

import numpy as np

from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray

_SPACING = math.radians(6.0)


def sample_direction(rng: np.random.Generator, elevation: float, shape: tuple[float, float]) -> tuple[float, float]:
    """Azimuth against the target's bearing and elevation, rad, of a direction in the reach at that elevation, rad.

    Args:
        rng: generator.
        elevation: within the reach.
        shape: of the beta distribution of the azimuth over the reach; (1, 1) is even.
    """
    low, high = ROBOT.arm.reach.azimuths(elevation)
    return low + (high - low) * float(rng.beta(*shape)), elevation


def _grid() -> FloatArray:
    """Azimuths and elevations about 6 degrees apart all over the reach, shape (n, 2), rad."""
    rows, reach = [], ROBOT.arm.reach
    for elevation in np.linspace(reach.lowest, reach.highest, 1 + round((reach.highest - reach.lowest) / _SPACING)):
        low, high = reach.azimuths(float(elevation))
        count = 1 + max(1, round((high - low) * math.cos(elevation) / _SPACING))
        rows += [(azimuth, elevation) for azimuth in np.linspace(low, high, count)]
    return np.array(rows)


REACH_GRID: FloatArray = _grid()
"""Azimuths, against the target's bearing, and elevations that cover the reach evenly, shape (n, 2), rad."""
REACH_GRID.setflags(write=False)
_FLAT, _RISE = -np.cos(REACH_GRID[:, 1]), np.sin(REACH_GRID[:, 1])


def directions(angles: FloatArray, target: FloatArray) -> FloatArray:
    """Unit vectors from target to camera, in base.

    Args:
        angles: azimuths against the target's bearing and elevations, shape (n, 2), rad.
        target: in base, shape (3,), m.

    Returns:
        Shape (n, 3).
    """
    azimuth, elevation = math.atan2(target[1], target[0]) + angles[:, 0], angles[:, 1]
    flat = -np.cos(elevation)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], axis=-1)


def reachable_directions(target: FloatArray) -> FloatArray:
    """Unit vectors from the target to cameras all over the arm's reach, shape (n, 3), in base."""
    azimuth, ways = math.atan2(target[1], target[0]) + REACH_GRID[:, 0], np.empty((len(REACH_GRID), 3))
    ways[:, 0], ways[:, 1], ways[:, 2] = _FLAT * np.cos(azimuth), _FLAT * np.sin(azimuth), _RISE
    return ways
