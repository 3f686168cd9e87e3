"""Boxes in space, one by one and as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fixation_gym.types import FloatArray


@dataclass(frozen=True)
class Box:
    """A box around an object or a part of it, in the robot base frame."""

    centre: FloatArray
    half_extent: FloatArray
    yaw: float
    """Rotation about the vertical, rad."""
    pitch: float = 0.0
    """Rotation about the box's y axis before ``yaw``, rad; 0: upright."""

    @property
    def rotation(self) -> FloatArray:
        """Rotation of the box's axes in base, shape (3, 3)."""
        return rotations(np.array([self.yaw]), np.array([self.pitch]))[0]


class BoxSet(NamedTuple):
    """Boxes as arrays, for tests of many."""

    centres: FloatArray
    """Shape (n, 3), in base, m."""
    rotations: FloatArray
    """Axes of each box in base, shape (n, 3, 3)."""
    halves: FloatArray
    """Half sizes, shape (n, 3), m."""

    def moved(self, offset: FloatArray) -> BoxSet:
        """The same boxes elsewhere; ``offset`` has shape (3,), m."""
        return self._replace(centres=self.centres + offset)


def box_set(boxes: Sequence[Box]) -> BoxSet:
    """Boxes as arrays."""
    if not boxes:
        return BoxSet(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)))
    centres = np.array([box.centre for box in boxes])
    halves = np.array([box.half_extent for box in boxes])
    yaws, pitches = np.array([(box.yaw, box.pitch) for box in boxes]).T
    return BoxSet(centres, rotations(yaws, pitches), halves)


def joined(sets: Sequence[BoxSet]) -> BoxSet:
    """All boxes of some sets."""
    if not sets:
        return box_set([])
    return BoxSet(*(np.concatenate(arrays) for arrays in zip(*sets, strict=True)))


def rotations(yaws: FloatArray, pitches: FloatArray) -> FloatArray:
    """Rotations of yaw about z after pitch about y, both of shape (n,), rad; shape (n, 3, 3)."""
    cy, sy, cp, sp = np.cos(yaws), np.sin(yaws), np.cos(pitches), np.sin(pitches)
    turns = np.zeros((len(cy), 3, 3))
    turns[:, 0, 0], turns[:, 0, 1], turns[:, 0, 2] = cy * cp, -sy, cy * sp
    turns[:, 1, 0], turns[:, 1, 1], turns[:, 1, 2] = sy * cp, cy, sy * sp
    turns[:, 2, 0], turns[:, 2, 2] = -sp, cp
    return turns
