"""Around what is in the way: the nearest direction from which the hand could come straight in past all that was seen.

Pushing away from an obstacle alone gets stuck where the arm's reach ends, or between two obstacles. The corridor test
is therefore also asked about the other directions that the arm reaches; what was never seen counts as free.
"""

from __future__ import annotations

import math

import numpy as np

from fixation_gym.control.corridor import approach_directions, in_corridor, level_axes
from fixation_gym.control.gaze import GazeGains
from fixation_gym.types import FloatArray

_AZIMUTHS, _ELEVATIONS = 9, np.radians([45.0, 55.0, 64.0, 73.0, 81.0])
"""Directions to ask about: number of azimuths within the reach; elevations."""
_STEEP = math.radians(66.0)
_FLATNESS_COST = 0.5
"""Cost per radian of an elevation below ``_STEEP``: what stands behind a thing is not seen from low down."""
_CLOSE = math.sin(math.radians(6.0))
"""Sine of the angle to the best direction below which the motion slows down."""
_BLOCKED_COST = 1.5
"""Cost of a direction per natural logarithm of its evidence, where that is enough to be sure."""


def way_out(
    points: FloatArray,
    weights: FloatArray,
    target: FloatArray,
    T_base_cam: FloatArray,
    full_weight: float,
    margin: float,
    gains: GazeGains,
) -> FloatArray:
    """Direction in which to move the camera around the target, lateral in ``cam``, shape (2,), of length 1 until close.

    Args:
        points: remembered obstacle points in base, shape (n, 3), m.
        weights: evidence of each point, shape (n,).
        target: fixated point in base, shape (3,), m.
        T_base_cam: camera pose, shape (4, 4).
        full_weight: evidence in a corridor at which it is surely blocked.
        margin: room to keep around the hand, m.
        gains: with the azimuths that the arm reaches.
    """
    bearing = math.atan2(target[1], target[0])
    azimuths = bearing + np.linspace(*gains.azimuth_range, _AZIMUTHS)
    directions = approach_directions(azimuths, _ELEVATIONS)
    axes = level_axes(directions)
    seen = np.einsum("kij,nj->kni", axes, points - target)
    evidence = (in_corridor(seen, margin) & (seen[..., 2] < 0.0)) @ weights
    present = T_base_cam[:3, 3] - target
    present /= np.linalg.norm(present)
    angle = np.arccos(np.clip(directions @ present, -1.0, 1.0))
    flatness = np.maximum(0.0, _STEEP - np.arcsin(directions[:, 2]))
    cost = angle + _FLATNESS_COST * flatness + _BLOCKED_COST * np.log1p(evidence / full_weight)
    lateral = T_base_cam[:3, :2].T @ directions[int(np.argmin(cost))]
    return np.asarray(lateral / max(float(np.linalg.norm(lateral)), _CLOSE))
