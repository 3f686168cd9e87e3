"""What is remembered of the ways to the target, as the camera would see them: the learner's longest memory."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fixation_gym.control.ways import BARRING_EVIDENCE, WAY_MARGIN, SeenSpace, Ways, known_ways
from fixation_gym.perception.percept import Percept
from fixation_gym.perception.zero_flow.evidence_map import CELLS
from fixation_gym.surroundings import Surroundings
from fixation_gym.types import FloatArray

_WIDEST = np.radians(75.0)
"""Angle between the present line of sight and the ways at the middle of the view's borders, rad."""
_FULL = 3.0 * BARRING_EVIDENCE
"""Evidence at the end of the scale, which grows with its logarithm; the middle is where a way is surely barred."""
_BEYOND = np.cos(np.radians(9.0))
"""Cosine of the angle to the nearest way of the reach from which on the arm does not get there."""


def way_view(percept: Percept, T_base_cam: FloatArray, surroundings: Surroundings) -> NDArray[np.float32]:
    """What is remembered of the ways to the target, as ``ways_in_view`` shows it; all unseen at first."""
    target, seen = percept.fixation.point_base, surroundings.seen
    if seen is None:
        seen = SeenSpace.empty(0.0)
    return ways_in_view(known_ways(*surroundings.obstacles(target), target, seen, WAY_MARGIN), T_base_cam, target)


def ways_in_view(ways: Ways, T_base_cam: FloatArray, target: FloatArray) -> NDArray[np.float32]:
    """Ways to the target around the present line of sight, shape (2, 32, 32), 0..1.

    A cell is a direction from the target to the camera. The middle is the present one; to the right and down in the
    view are those that the camera gets to when it moves to its right and down, 4.7 degrees per cell. The first layer
    is how surely something bars the hand that comes in from there, 1 also where the arm does not reach; the second is
    the share of its corridor that was never looked at.

    Args:
        ways: what is known of them.
        T_base_cam: camera pose, shape (4, 4).
        target: in base, shape (3,), m.
    """
    likeness = _directions(T_base_cam, target) @ ways.directions.T
    nearest = likeness.argmax(axis=-1)
    sure = np.clip(np.log1p(ways.evidence / BARRING_EVIDENCE) / math.log1p(_FULL / BARRING_EVIDENCE), 0.0, 1.0)
    barred = np.where(likeness.max(axis=-1) > _BEYOND, sure[nearest], 1.0)
    return np.stack([barred, ways.unseen[nearest]]).astype(np.float32)


def _directions(T_base_cam: FloatArray, target: FloatArray) -> FloatArray:
    """Unit vectors from the target to the camera of every cell, shape (32, 32, 3), in base."""
    present = T_base_cam[:3, 3] - target
    present /= max(float(np.linalg.norm(present)), 1e-9)
    right, down = (axis - (axis @ present) * present for axis in T_base_cam[:3, :2].T)
    offsets = _WIDEST * ((np.arange(CELLS) + 0.5) / CELLS * 2.0 - 1.0)
    x, y = np.meshgrid(offsets, offsets)
    angle = np.hypot(x, y)
    aside = (x[..., None] * right + y[..., None] * down) * np.sinc(angle / np.pi)[..., None]
    directions = np.cos(angle)[..., None] * present + aside
    return directions / np.linalg.norm(directions, axis=-1, keepdims=True)
