"""What hinders the approach: evidence of obstacles in the volume that the hand sweeps.

The paper takes all pixels in front of the target. Here only those count that the hand would touch on its straight way
to the target: evidence is weighed by whether it lies in the corridor that fingers, hand, camera and wrist sweep.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fixation_gym.control.corridor import in_corridor
from fixation_gym.types import FloatArray


@dataclass(frozen=True, slots=True)
class ObstacleTerm:
    """What stands in the way."""

    evidence: float
    """Evidence in the corridor: number of points, each weighed by how surely it was seen."""
    gap: float
    """Distance along the optical axis from the finger tips to the nearest point in the corridor, m; inf if free."""


FREE = ObstacleTerm(0.0, np.inf)


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
    inside = in_corridor(points - [0.0, 0.0, distance], margin) & (points[:, 2] < distance)
    if not inside.any():
        return FREE
    return ObstacleTerm(float(weights[inside].sum()), float(points[inside, 2].min() - tool_depth))
