"""The obstacle term of Eq. 8: where things that hinder the approach are in the image.

The paper takes the centre of mass of all pixels in front of the target. Here only those count that the hand would
touch on its straight way to the target: evidence is weighed by whether it lies in the corridor that fingers, hand,
camera and wrist sweep.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fixation_gym.control.corridor import in_corridor
from fixation_gym.types import FloatArray

_HALF_WIDTH = 0.11
"""Half width of the hand, m: the unit in which the centre of mass is measured."""


@dataclass(frozen=True, slots=True, eq=False)
class ObstacleTerm:
    """What stands in the way."""

    centre: FloatArray
    """obs_xy, shape (2,): centre of mass of the evidence in the corridor, in half hand widths; zero if it is free."""
    evidence: float
    """Evidence in the corridor: number of points, each weighed by how surely it was seen."""
    gap: float
    """Distance along the optical axis from the finger tips to the nearest point in the corridor, m; inf if free."""


def obstacle_term(
    points: FloatArray, weights: FloatArray, distance: float, tool_depth: float, margin: float
) -> ObstacleTerm:
    """Weigh remembered obstacle points by whether they hinder the approach.

    Args:
        points: in ``cam``, shape (n, 3), m.
        weights: evidence of each point, shape (n,).
        distance: Z_f, depth of the target, m.
        tool_depth: depth of the finger tips in ``cam``, m.
        margin: room to keep around the hand, m.
    """
    if not len(points):
        return ObstacleTerm(np.zeros(2), 0.0, np.inf)
    inside = in_corridor(points - [0.0, 0.0, distance], margin) & (points[:, 2] < distance)
    if not inside.any():
        return ObstacleTerm(np.zeros(2), 0.0, np.inf)
    hit, weight = points[inside], weights[inside]
    centre = weight @ hit[:, :2] / weight.sum() / _HALF_WIDTH
    return ObstacleTerm(centre, float(weight.sum()), float(hit[:, 2].min() - tool_depth))
