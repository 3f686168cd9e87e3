"""Whether boxes meet: compiled tests of sets of boxes, which sampling a scene asks for a million times.

Most boxes are far from each other, and spheres or boxes around them tell; the exact test is for the rest.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fixation_gym.compiled import compiled
from fixation_gym.control.box_pairs import (
    NOWHERE,
    SLACK,
    Triple,
    Triples,
    at,
    axes_of,
    columns,
    difference,
    distance,
    is_beyond,
    is_outside,
    length,
    meets_aligned,
    reach,
    rotation_of,
    row,
    steps_apart,
    turned,
    turned_axes,
    widened,
)
from fixation_gym.geometry.boxes import BoxSet
from fixation_gym.types import FloatArray, MaskArray

BOX_COLUMNS = 15
_FIRST = np.zeros(1, np.int64)
"""0 from an array: for a literal, numba would compile all that takes it once more."""


class Aligned(NamedTuple):
    """Boxes along the axes of a camera, and the box around them all."""

    centres: FloatArray
    """Shape (n, 3), from the target, m."""
    halves: FloatArray
    """Half sizes, shape (n, 3), m."""
    low: FloatArray
    """Lowest corner of all, shape (3,), m."""
    high: FloatArray
    """Highest corner of all, shape (3,), m."""


def aligned(centres: FloatArray, halves: FloatArray) -> Aligned:
    """Boxes along a camera's axes, both of shape (n, 3), m."""
    return Aligned(centres, halves, (centres - halves).min(axis=0), (centres + halves).max(axis=0))


def packed(boxes: BoxSet) -> FloatArray:
    """Boxes as rows of one array, (n, ``BOX_COLUMNS``): centre (3), half sizes (3), and the rotation row by row (9)."""
    return np.concatenate([boxes.centres, boxes.halves, boxes.rotations.reshape(-1, 9)], axis=1)


def packed_hand(others: Aligned) -> FloatArray:
    """Boxes along a camera's axes as rows: lowest and highest corner of all, then centre and half sizes of each."""
    around = np.concatenate([others.low, others.high])[None]
    return np.concatenate([around, np.concatenate([others.centres, others.halves], axis=1)])


def boxes_meet(first: BoxSet, second: BoxSet, gap: float) -> bool:
    """Whether a box of one set comes nearer than about ``gap`` m to one of the other."""
    rows = packed(first)
    return bool(any_pair_meets(rows, 0, len(rows), packed(second), gap))


def any_meets(target: FloatArray, axes: FloatArray, boxes: BoxSet, others: Aligned) -> MaskArray:
    """For each of n cameras, axes (n, 3, 3), whether a box meets one of those along its axes, from the target on."""
    return np.asarray(_any_meets(target, axes, packed(boxes), packed_hand(others)))


@compiled
def _any_meets(target: FloatArray, axes: FloatArray, boxes: FloatArray, hand: FloatArray) -> MaskArray:
    hit = np.zeros(len(axes), np.bool_)
    for camera in range(len(axes)):
        hit[camera] = meets(target, axes, camera, boxes, _FIRST[0], len(boxes), hand)
    return hit


@compiled
def meets(
    target: FloatArray, axes: FloatArray, camera: int, boxes: FloatArray, begin: int, end: int, hand: FloatArray
) -> bool:
    """Whether a box meets one of those along a camera's axes.

    Args:
        target: shape (3,), in base, m: from where on the camera's boxes are given.
        axes: rows x, y, z of cameras, shape (n, 3, 3).
        camera: index of the one.
        boxes: as in ``packed``.
        begin: the first one.
        end: the one after the last one.
        hand: as in ``packed_hand``.
    """
    return _first_met(axes_of(axes, camera), at(target), boxes, begin, end, hand)[0] >= 0


@compiled
def steps_past(
    targets: FloatArray, axes: FloatArray, latest: int, boxes: FloatArray, hand: FloatArray, step: Triple
) -> tuple[int, int]:
    """Number of steps, m, that surely leave boxes where they meet a hand, and one more; 0 if they meet none.

    There is a hand at each of the targets, (n, 3), for each of the axes, (m, 3, 3); the one with the index ``latest``
    is looked at first. Also the index of the one that is met.
    """
    ways = len(axes)
    for pair in range(len(targets) * ways):
        index = (latest + pair) % (len(targets) * ways)
        frame, target = axes_of(axes, index % ways), row(targets, index // ways, 0)
        i, k = _first_met(frame, target, boxes, _FIRST[0], len(boxes), hand)
        if i >= 0:
            offset = difference(turned(frame, row(boxes, i, 0), target), row(hand, k, 0))
            rotation = turned_axes(frame, rotation_of(boxes, i))
            shift, half, other = turned(frame, step, NOWHERE), row(boxes, i, 3), row(hand, k, 3)
            return steps_apart(offset, shift, rotation, half, other), index
    return 0, latest


@compiled
def _first_met(
    frame: Triples, target: Triple, boxes: FloatArray, begin: int, end: int, hand: FloatArray
) -> tuple[int, int]:
    """Indices of a box and of one along the axes ``frame`` that it meets; -1 if there is none."""
    low, high = row(hand, 0, 0), row(hand, 0, 3)
    for i in range(begin, end):
        half, place = row(boxes, i, 3), turned(frame, row(boxes, i, 0), target)
        if is_outside(place, low, high, length(half)):  # as most are
            continue
        rotation = turned_axes(frame, rotation_of(boxes, i))
        reaches = reach(rotation[0], half), reach(rotation[1], half), reach(rotation[2], half)
        for k in range(1, len(hand)):
            offset, other = difference(place, row(hand, k, 0)), row(hand, k, 3)
            if not is_beyond(offset, reaches, other) and meets_aligned(offset, rotation, half, other):
                return i, k
    return -1, -1


@compiled
def may_meet(target: FloatArray, axes: FloatArray, camera: int, spheres: FloatArray, i: int, hand: FloatArray) -> bool:
    """Whether anything within a sphere, one of ``spheres_around``, could meet a box along a camera's axes."""
    place = turned(axes_of(axes, camera), row(spheres, i, 0), at(target))
    return not is_outside(place, row(hand, 0, 0), row(hand, 0, 3), spheres[i, 3] + SLACK)


@compiled
def any_pair_meets(first: FloatArray, begin: int, end: int, second: FloatArray, gap: float) -> bool:
    """Whether one of some boxes comes nearer than about ``gap`` m to one of others; both as in ``packed``."""
    for i in range(begin, end):  # noqa: SIM110 (numba knows no generators)
        if _one_met(first, i, second, _FIRST[0], len(second), gap) >= 0:
            return True
    return False


@compiled
def steps_off(first: FloatArray, second: FloatArray, gap: float, step: Triple) -> int:
    """Number of steps, m, that surely leave the first boxes so near to the second ones, and one more.

    0 if they are not so near as they are.
    """
    for i in range(len(first)):
        j = _one_met(first, i, second, _FIRST[0], len(second), gap)
        if j >= 0:
            frame, half = columns(first, i), widened(row(first, i, 3), gap)
            offset, shift = turned(frame, row(second, j, 0), row(first, i, 0)), turned(frame, NOWHERE, step)
            rotation = turned_axes(frame, rotation_of(second, j))
            return steps_apart(offset, shift, rotation, row(second, j, 3), half)
    return 0


@compiled
def _one_met(first: FloatArray, i: int, second: FloatArray, begin: int, end: int, gap: float) -> int:
    """Index of one of the second boxes that comes so near to one of the first; -1 if none does."""
    centre, half, frame = row(first, i, 0), widened(row(first, i, 3), gap), columns(first, i)
    radius = length(half)
    for j in range(begin, end):
        offset, other = turned(frame, row(second, j, 0), centre), row(second, j, 3)
        if length(offset) > radius + length(other) + SLACK:
            continue
        if meets_aligned(offset, turned_axes(frame, rotation_of(second, j)), other, half):
            return j
    return -1


@compiled
def pairs_that_meet(boxes: FloatArray, ends: NDArray[np.int64], gap: float) -> MaskArray:
    """For n sets of boxes, which come nearer than about ``gap`` m to each other, shape (n, n).

    Set i has the boxes from ``ends[i]`` to ``ends[i + 1]``; they are as in ``packed``.
    """
    count = len(ends) - 1
    meet, spheres = np.zeros((count, count), np.bool_), spheres_around(boxes, ends)
    for i in range(count):
        for j in range(i):
            room = spheres[j, 3] + 2.0 * gap + SLACK
            if distance(spheres, i, spheres, j) > spheres[i, 3] + room:
                continue
            for box in range(ends[i], ends[i + 1]):
                if distance(boxes, box, spheres, j) > length(row(boxes, box, 3)) + room:
                    continue
                if _one_met(boxes, box, boxes, ends[j], ends[j + 1], gap) >= 0:
                    meet[i, j] = meet[j, i] = True
                    break
    return meet


@compiled
def spheres_around(boxes: FloatArray, ends: NDArray[np.int64]) -> FloatArray:
    """Middles and radii of spheres around the boxes from ``ends[i]`` to ``ends[i + 1]``, shape (n, 4), m."""
    spheres = np.zeros((len(ends) - 1, 4))
    for i in range(len(spheres)):
        for box in range(ends[i], ends[i + 1]):
            for axis in range(3):
                spheres[i, axis] += boxes[box, axis] / (ends[i + 1] - ends[i])
        for box in range(ends[i], ends[i + 1]):
            spheres[i, 3] = max(spheres[i, 3], distance(boxes, box, spheres, i) + length(row(boxes, box, 3)))
    return spheres
