"""From which directions the arm can come in, found by moving it there in simulation: ``tests/envs/test_reach_sim.py``.

The camera keeps level, goes around the target at 0.42 m and comes straight in until the tool is at the target. Low
down the arm reaches the side that its elbow leaves free; from steeply above it reaches nearly everything.
"""

from __future__ import annotations

import math

import numpy as np

from fixation_gym.types import FloatArray

_REACH_DEG = np.array(
    [
        [40.0, 32.0, 88.0],
        [50.0, 28.0, 98.0],
        [60.0, 18.0, 112.0],
        [70.0, -45.0, 125.0],
        [85.0, -70.0, 130.0],
    ]
)
"""Elevation above the table, lowest and highest azimuth against the bearing of the target from the base, deg."""
LOWEST, HIGHEST = math.radians(_REACH_DEG[0, 0]), math.radians(_REACH_DEG[-1, 0])
"""Range of the elevation, rad."""
_SPACING = math.radians(6.0)


def azimuth_range(elevation: float) -> tuple[float, float]:
    """Lowest and highest azimuth that the arm reaches at an elevation, against the target's bearing; all in rad."""
    angle = math.degrees(elevation)
    low, high = (float(np.interp(angle, _REACH_DEG[:, 0], _REACH_DEG[:, column])) for column in (1, 2))
    return math.radians(low), math.radians(high)


def sample_direction(rng: np.random.Generator, elevation: float, shape: tuple[float, float]) -> tuple[float, float]:
    """Azimuth against the target's bearing and elevation, rad, of a direction in the reach at that elevation, rad.

    Args:
        rng: generator.
        elevation: within the reach.
        shape: of the beta distribution of the azimuth over the reach; (1, 1) is even.
    """
    low, high = azimuth_range(elevation)
    return low + (high - low) * float(rng.beta(*shape)), elevation


def _grid() -> FloatArray:
    """Azimuths and elevations about 6 degrees apart all over the reach, shape (n, 2), rad."""
    rows = []
    for elevation in np.linspace(LOWEST, HIGHEST, 1 + round((HIGHEST - LOWEST) / _SPACING)):
        low, high = azimuth_range(float(elevation))
        count = 1 + max(1, round((high - low) * math.cos(elevation) / _SPACING))
        rows += [(azimuth, elevation) for azimuth in np.linspace(low, high, count)]
    return np.array(rows)


REACH_GRID: FloatArray = _grid()
"""Azimuths, against the target's bearing, and elevations that cover the reach evenly, shape (n, 2), rad."""
REACH_GRID.setflags(write=False)


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
    return directions(REACH_GRID, target)
