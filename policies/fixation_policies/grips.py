"""How the fingers may close on a target whose pose is known. Pure functions; frame: robot base."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fixation_gym.control.corridor import level_axes
from fixation_gym.types import FloatArray

IntArray = NDArray[np.int64]

LARGEST_SLANT = math.radians(22.0)
"""Angle between a grip's axis and that along which the fingers close from which on a broad target slips, rad."""
_ROUND_SHAPES = ("cylinder", "ball", "ring")


def grips_of(shape: str) -> IntArray:
    """Axes of a target along which the fingers close on it, shape (n,); -1: all are alike, the hand stays level.

    Both sides of a box fit between the fingers.
    """
    return np.array([-1] if shape in _ROUND_SHAPES else [1, 0] if shape == "box" else [1])


def rolls(directions: FloatArray, grips: IntArray, rotation: FloatArray) -> FloatArray:
    """How far a hand that comes from each direction turns about it for a grip, shape (n,), rad.

    Args:
        directions: unit vectors from target to camera, shape (n, 3).
        grips: axes of the target as in ``grips_of``, shape (n,).
        rotation: of the target, shape (3, 3).
    """
    across = np.einsum("nij,nj->ni", level_axes(directions), rotation.T[np.maximum(grips, 0)])
    return np.where(grips < 0, 0.0, half_turn(np.arctan2(across[:, 1], across[:, 0])))


def slants(directions: FloatArray, grips: IntArray, rotation: FloatArray) -> FloatArray:
    """How far a grip's axis is out of the image's plane, in which the fingers close, shape (n,), rad; as ``rolls``."""
    along = np.abs(np.einsum("ni,ni->n", directions, rotation.T[np.maximum(grips, 0)]))
    return np.where(grips < 0, 0.0, np.arcsin(np.minimum(along, 1.0)))


def widths(directions: FloatArray, grips: IntArray, rotation: FloatArray, half: FloatArray) -> FloatArray:
    """How wide the box around a target is along the line on which the fingers close, shape (n,), m; as ``rolls``.

    What is round, or thinner where it is not held, is as wide as it is along its grip.

    Args:
        directions: unit vectors from target to camera, shape (n, 3).
        grips: axes of the target as in ``grips_of``, shape (n,).
        rotation: of the target, shape (3, 3).
        half: half sizes of the box, shape (3,), m.
    """
    axes = rotation.T[np.maximum(grips, 0)]
    closing = axes - np.einsum("ni,ni->n", directions, axes)[:, None] * directions
    closing /= np.linalg.norm(closing, axis=1, keepdims=True)
    return np.where(grips < 0, 2.0 * half[1], 2.0 * np.abs(closing @ rotation) @ half)


def half_turn(angle: Any) -> Any:
    """Angle or angles, rad, taken to [-pi/2, pi/2): a grip turned by half a turn is the same."""
    return (angle + math.pi / 2) % math.pi - math.pi / 2
