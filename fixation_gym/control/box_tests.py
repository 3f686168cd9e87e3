"""Whether boxes meet: compiled tests of sets of boxes, which sampling a scene asks for a million times.

Most boxes are far from each other, and spheres or boxes around them tell; the exact test is for the rest.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fixation_gym.geometry.boxes import BoxSet, joined
from fixation_gym.types import FloatArray, MaskArray

_SLACK = 1e-6
"""Boxes are only said to be far apart by their spheres if they are so by this much, m: rounding decides nothing."""


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


Scratch = tuple[FloatArray, FloatArray]
"""Room for a place, (3,), and for a rotation, (3, 3): a test that makes its own takes twice as long."""


def aligned(centres: FloatArray, halves: FloatArray) -> Aligned:
    """Boxes along a camera's axes, both of shape (n, 3), m."""
    return Aligned(centres, halves, (centres - halves).min(axis=0), (centres + halves).max(axis=0))


def boxes_meet(first: BoxSet, second: BoxSet, gap: float) -> bool:
    """Whether a box of one set comes nearer than about ``gap`` m to one of the other."""
    return bool(any_pair_meets(first, second, gap))


def meeting_pairs(sets: Sequence[BoxSet], gap: float) -> MaskArray:
    """For n sets of boxes, which of them come nearer than about ``gap`` m to each other, shape (n, n)."""
    ends = np.cumsum([0, *(len(boxes.centres) for boxes in sets)])
    return np.asarray(pairs_that_meet(joined(sets), ends, gap))


@njit(cache=True)
def scratch() -> Scratch:
    """Room for the tests that follow."""
    return np.empty(3), np.empty((3, 3))


@njit(cache=True)
def part_of(boxes: BoxSet, first: int, end: int) -> BoxSet:
    """Some boxes of a set, one after the other."""
    return BoxSet(boxes.centres[first:end], boxes.rotations[first:end], boxes.halves[first:end])


@njit(cache=True)
def any_meets(target: FloatArray, axes: FloatArray, boxes: BoxSet, others: Aligned) -> MaskArray:
    """For each of n cameras, axes (n, 3, 3), whether a box meets one of those along its axes, from the target on."""
    hit, room = np.zeros(len(axes), np.bool_), scratch()
    for camera in range(len(axes)):
        hit[camera] = meets(target, axes[camera], boxes, others, room)
    return hit


@njit(cache=True)
def meets(target: FloatArray, axes: FloatArray, boxes: BoxSet, others: Aligned, room: Scratch) -> bool:
    """The same for one camera, axes (3, 3)."""
    offset, rotation = room
    for i in range(len(boxes.centres)):
        half = boxes.halves[i]
        radius = _length(half)
        _turn(axes, boxes.centres[i], target, offset)
        if _is_outside(offset, others.low, others.high, radius):  # as most are
            continue
        turned = False
        for k in range(len(others.centres)):
            if _is_far(offset, others.centres[k], others.halves[k], radius + _SLACK):
                continue
            if not turned:
                _multiply(axes, boxes.rotations[i], rotation)
                turned = True
            if _boxes_meet(offset, others.centres[k], rotation, half, others.halves[k]):
                return True
    return False


@njit(cache=True)
def may_meet(
    target: FloatArray, axes: FloatArray, middle: FloatArray, radius: float, others: Aligned, room: Scratch
) -> bool:
    """Whether anything within a sphere could meet a box along a camera's axes, (3, 3)."""
    _turn(axes, middle, target, room[0])
    return not _is_outside(room[0], others.low, others.high, radius + _SLACK)


@njit(cache=True)
def any_pair_meets(first: BoxSet, second: BoxSet, gap: float) -> bool:
    """Whether a box of one set comes nearer than about ``gap`` m to one of the other."""
    room = scratch()
    for i in range(len(first.centres)):
        if _one_meets(first, i, second, gap, _length(first.halves[i] + gap), room):
            return True
    return False


@njit(cache=True)
def _one_meets(first: BoxSet, i: int, second: BoxSet, gap: float, radius: float, room: Scratch) -> bool:
    """The same for one box of the first set, with the radius of a sphere around what must stay empty."""
    origin, (offset, rotation) = np.zeros(3), room
    half, axes = first.halves[i] + gap, first.rotations[i].T
    for j in range(len(second.centres)):
        _turn(axes, second.centres[j], first.centres[i], offset)
        if _length(offset) > radius + _length(second.halves[j]):
            continue
        _multiply(axes, second.rotations[j], rotation)
        if _boxes_meet(offset, origin, rotation, second.halves[j], half):
            return True
    return False


@njit(cache=True)
def pairs_that_meet(boxes: BoxSet, ends: NDArray[np.int64], gap: float) -> MaskArray:
    """The compiled part of ``meeting_pairs``: set i has the boxes from ``ends[i]`` to ``ends[i + 1]``."""
    count, room = len(ends) - 1, scratch()
    meet = np.zeros((count, count), np.bool_)
    middles, radii = np.empty((count, 3)), np.empty(count)
    for i in range(count):
        middles[i], radii[i] = sphere_around(part_of(boxes, ends[i], ends[i + 1]))
    for i in range(count):
        for j in range(i):
            if _length(middles[i] - middles[j]) > radii[i] + radii[j] + 2.0 * gap + _SLACK:
                continue
            others = part_of(boxes, ends[j], ends[j + 1])
            for box in range(ends[i], ends[i + 1]):
                if _one_meets(boxes, box, others, gap, _length(boxes.halves[box]) + 2.0 * gap, room):
                    meet[i, j] = meet[j, i] = True
                    break
    return meet


@njit(cache=True)
def sphere_around(boxes: BoxSet) -> tuple[FloatArray, float]:
    """Middle, (3,), and radius of a sphere around some boxes, m."""
    middle, radius = np.zeros(3), 0.0
    for centre in boxes.centres:
        middle += centre / len(boxes.centres)
    for i in range(len(boxes.centres)):
        radius = max(radius, _length(boxes.centres[i] - middle) + _length(boxes.halves[i]))
    return middle, radius


@njit(cache=True)
def _length(vector: FloatArray) -> float:
    return math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)


@njit(cache=True)
def _turn(axes: FloatArray, place: FloatArray, origin: FloatArray, out: FloatArray) -> None:
    """A place in the frame at ``origin`` whose axes are the rows of ``axes``."""
    for k in range(3):
        out[k] = 0.0
        for axis in range(3):
            out[k] += axes[k, axis] * (place[axis] - origin[axis])


@njit(cache=True)
def _multiply(first: FloatArray, second: FloatArray, out: FloatArray) -> None:
    for k in range(3):
        for axis in range(3):
            out[k, axis] = 0.0
            for m in range(3):
                out[k, axis] += first[k, m] * second[m, axis]


@njit(cache=True)
def _is_outside(place: FloatArray, low: FloatArray, high: FloatArray, margin: float) -> bool:
    outside = False
    for k in range(3):
        outside |= place[k] < low[k] - margin or place[k] > high[k] + margin
    return outside


@njit(cache=True)
def _is_far(place: FloatArray, centre: FloatArray, half: FloatArray, radius: float) -> bool:
    """Whether a sphere around a place misses an aligned box."""
    square = 0.0
    for k in range(3):
        beyond = max(abs(place[k] - centre[k]) - half[k], 0.0)
        square += beyond * beyond
    return square > radius * radius


@njit(cache=True)
def _boxes_meet(
    offset: FloatArray, centre: FloatArray, rotation: FloatArray, turned: FloatArray, half: FloatArray
) -> bool:
    """Whether a box turned by ``rotation`` at ``offset`` meets an aligned one (separating axes, Gottschalk)."""
    d = (offset[0] - centre[0], offset[1] - centre[1], offset[2] - centre[2])
    for i in range(3):
        reach = half[i]
        for k in range(3):
            reach += abs(rotation[i, k]) * turned[k]
        if abs(d[i]) > reach:
            return False
    for i in range(3):
        along, reach = 0.0, turned[i]
        for k in range(3):
            along += d[k] * rotation[k, i]
            reach += abs(rotation[k, i]) * half[k]
        if abs(along) > reach:
            return False
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            k, m = (j + 1) % 3, (j + 2) % 3
            reach = half[a] * abs(rotation[b, j]) + half[b] * abs(rotation[a, j])
            reach += turned[k] * abs(rotation[i, m]) + turned[m] * abs(rotation[i, k])
            # Parallel edges have no cross product: their axis is none, which the small number says.
            if abs(d[b] * rotation[a, j] - d[a] * rotation[b, j]) > reach + 1e-9:
                return False
    return True
