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
_PARALLEL = 1e-9
"""Less than this is no distance along the normal of two edges, m."""
_SURE = 1e-10
"""Boxes that overlap by this along every axis meet whatever rounding does, m."""


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


Triple = tuple[float, float, float]


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
def part_of(boxes: BoxSet, first: int, end: int) -> BoxSet:
    """Some boxes of a set, one after the other."""
    return BoxSet(boxes.centres[first:end], boxes.rotations[first:end], boxes.halves[first:end])


@njit(cache=True)
def any_meets(target: FloatArray, axes: FloatArray, boxes: BoxSet, others: Aligned) -> MaskArray:
    """For each of n cameras, axes (n, 3, 3), whether a box meets one of those along its axes, from the target on."""
    hit = np.zeros(len(axes), np.bool_)
    for camera in range(len(axes)):
        hit[camera] = meets(target, axes[camera], boxes, others)
    return hit


@njit(cache=True)
def meets(target: FloatArray, axes: FloatArray, boxes: BoxSet, others: Aligned) -> bool:
    """The same for one camera, axes (3, 3)."""
    return _first_met(target, axes, boxes, others)[0] >= 0


@njit(cache=True)
def steps_past(target: FloatArray, axes: FloatArray, boxes: BoxSet, others: Aligned, step: FloatArray) -> int:
    """Number of steps, (3,), m, that surely leave boxes where they meet one along a camera's axes, and one more.

    0 if they meet none as they are.
    """
    i, k = _first_met(target, axes, boxes, others)
    if i < 0:
        return 0
    x, y, z = _turned(axes, boxes.centres[i], target)
    offset = x - others.centres[k, 0], y - others.centres[k, 1], z - others.centres[k, 2]
    rotation = _turned_axes(axes, boxes.rotations[i])
    return _steps_apart(offset, _along(axes, step, 1.0), rotation, _row(boxes.halves, i), _row(others.halves, k))


@njit(cache=True)
def _first_met(target: FloatArray, axes: FloatArray, boxes: BoxSet, others: Aligned) -> tuple[int, int]:
    """Indices of a box and of one along a camera's axes, from the target on, that it meets; -1 if there is none."""
    for i in range(len(boxes.centres)):
        half = _row(boxes.halves, i)
        place = _turned(axes, boxes.centres[i], target)
        if _is_outside(place, others.low, others.high, _length(half)):  # as most are
            continue
        rotation = _turned_axes(axes, boxes.rotations[i])
        for k in range(len(others.centres)):
            offset = (
                place[0] - others.centres[k, 0],
                place[1] - others.centres[k, 1],
                place[2] - others.centres[k, 2],
            )
            if _meets_aligned(offset, rotation, half, _row(others.halves, k)):
                return i, k
    return -1, -1


@njit(cache=True)
def may_meet(target: FloatArray, axes: FloatArray, sphere: FloatArray, others: Aligned) -> bool:
    """Whether anything within a sphere, (4,), could meet a box along a camera's axes, (3, 3)."""
    return not _is_outside(_turned(axes, sphere, target), others.low, others.high, sphere[3] + _SLACK)


@njit(cache=True)
def any_pair_meets(first: BoxSet, second: BoxSet, gap: float) -> bool:
    """Whether a box of one set comes nearer than about ``gap`` m to one of the other."""
    for i in range(len(first.centres)):  # noqa: SIM110 (numba knows no generators)
        if _one_met(first, i, second, gap) >= 0:
            return True
    return False


@njit(cache=True)
def steps_off(first: BoxSet, second: BoxSet, gap: float, step: FloatArray) -> int:
    """Number of steps, (3,), m, that surely leave the first boxes so near to the second ones, and one more.

    0 if they are not so near as they are.
    """
    for i in range(len(first.centres)):
        j = _one_met(first, i, second, gap)
        if j >= 0:
            axes = first.rotations[i].T
            half = first.halves[i, 0] + gap, first.halves[i, 1] + gap, first.halves[i, 2] + gap
            offset, rotation = _turned(axes, second.centres[j], first.centres[i]), _turned_axes(axes, second.rotations[j])
            return _steps_apart(offset, _along(axes, step, -1.0), rotation, _row(second.halves, j), half)
    return 0


@njit(cache=True)
def _one_met(first: BoxSet, i: int, second: BoxSet, gap: float) -> int:
    """Index of a box of the second set that comes so near to one of the first; -1 if none does."""
    half = (first.halves[i, 0] + gap, first.halves[i, 1] + gap, first.halves[i, 2] + gap)
    radius, axes = _length(half), first.rotations[i].T
    for j in range(len(second.centres)):
        offset, other = _turned(axes, second.centres[j], first.centres[i]), _row(second.halves, j)
        if _length(offset) > radius + _length(other) + _SLACK:
            continue
        if _meets_aligned(offset, _turned_axes(axes, second.rotations[j]), other, half):
            return j
    return -1


@njit(cache=True)
def pairs_that_meet(boxes: BoxSet, ends: NDArray[np.int64], gap: float) -> MaskArray:
    """The compiled part of ``meeting_pairs``: set i has the boxes from ``ends[i]`` to ``ends[i + 1]``."""
    count = len(ends) - 1
    meet = np.zeros((count, count), np.bool_)
    spheres = spheres_around(boxes, ends)
    for i in range(count):
        for j in range(i):
            room = spheres[j, 3] + 2.0 * gap + _SLACK
            if _distance(spheres[i], spheres[j]) > spheres[i, 3] + room:
                continue
            others = part_of(boxes, ends[j], ends[j + 1])
            for box in range(ends[i], ends[i + 1]):
                if _distance(boxes.centres[box], spheres[j]) > _length(_row(boxes.halves, box)) + room:
                    continue
                if _one_met(boxes, box, others, gap) >= 0:
                    meet[i, j] = meet[j, i] = True
                    break
    return meet


@njit(cache=True)
def spheres_around(boxes: BoxSet, ends: NDArray[np.int64]) -> FloatArray:
    """Middles and radii of spheres around the boxes from ``ends[i]`` to ``ends[i + 1]``, shape (n, 4), m."""
    spheres = np.zeros((len(ends) - 1, 4))
    for i in range(len(spheres)):
        for box in range(ends[i], ends[i + 1]):
            for axis in range(3):
                spheres[i, axis] += boxes.centres[box, axis] / (ends[i + 1] - ends[i])
        for box in range(ends[i], ends[i + 1]):
            radius = _distance(boxes.centres[box], spheres[i]) + _length(_row(boxes.halves, box))
            spheres[i, 3] = max(spheres[i, 3], radius)
    return spheres


@njit(cache=True)
def _row(array: FloatArray, i: int) -> Triple:
    """A row of an array, (n, 3), as plain numbers."""
    return array[i, 0], array[i, 1], array[i, 2]


@njit(cache=True)
def _length(vector: Triple) -> float:
    return math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)


@njit(cache=True)
def _distance(first: FloatArray, second: FloatArray) -> float:
    return _length((first[0] - second[0], first[1] - second[1], first[2] - second[2]))


@njit(cache=True)
def _turned(axes: FloatArray, place: FloatArray, origin: FloatArray) -> Triple:
    """A place in the frame at ``origin`` whose axes are the rows of ``axes``."""
    x, y, z = place[0] - origin[0], place[1] - origin[1], place[2] - origin[2]
    return (
        axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z,
        axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z,
        axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z,
    )


@njit(cache=True)
def _along(axes: FloatArray, step: FloatArray, sign: float) -> Triple:
    """A step in the frame whose axes are the rows of ``axes``, or the opposite one."""
    x, y, z = sign * step[0], sign * step[1], sign * step[2]
    return (
        axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z,
        axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z,
        axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z,
    )


@njit(cache=True)
def _turned_axes(axes: FloatArray, rotation: FloatArray) -> tuple[Triple, Triple, Triple]:
    """Rows of a rotation in the frame whose axes are the rows of ``axes``."""
    return _product(axes[0], rotation), _product(axes[1], rotation), _product(axes[2], rotation)


@njit(cache=True)
def _product(row: FloatArray, rotation: FloatArray) -> Triple:
    a, b, c = row[0], row[1], row[2]
    return (
        a * rotation[0, 0] + b * rotation[1, 0] + c * rotation[2, 0],
        a * rotation[0, 1] + b * rotation[1, 1] + c * rotation[2, 1],
        a * rotation[0, 2] + b * rotation[1, 2] + c * rotation[2, 2],
    )


@njit(cache=True)
def _is_outside(place: Triple, low: FloatArray, high: FloatArray, margin: float) -> bool:
    outside = False
    for k in range(3):
        outside |= place[k] < low[k] - margin or place[k] > high[k] + margin
    return outside


@njit(cache=True)
def _meets_aligned(offset: Triple, rotation: tuple[Triple, Triple, Triple], half: Triple, aligned: Triple) -> bool:
    """Whether a turned box meets an aligned one at the origin (separating axes, Gottschalk).

    Args:
        offset: where the turned box is, m.
        rotation: its axes, row by row.
        half: its half sizes, m.
        aligned: those of the aligned one, m.
    """
    (x, y, z), (h0, h1, h2), (g0, g1, g2) = offset, half, aligned
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = rotation
    a00, a01, a02 = abs(r00), abs(r01), abs(r02)
    a10, a11, a12 = abs(r10), abs(r11), abs(r12)
    a20, a21, a22 = abs(r20), abs(r21), abs(r22)
    return not (
        # axes of the aligned box
        abs(x) > g0 + a00 * h0 + a01 * h1 + a02 * h2
        or abs(y) > g1 + a10 * h0 + a11 * h1 + a12 * h2
        or abs(z) > g2 + a20 * h0 + a21 * h1 + a22 * h2
        # axes of the turned one
        or abs(x * r00 + y * r10 + z * r20) > h0 + a00 * g0 + a10 * g1 + a20 * g2
        or abs(x * r01 + y * r11 + z * r21) > h1 + a01 * g0 + a11 * g1 + a21 * g2
        or abs(x * r02 + y * r12 + z * r22) > h2 + a02 * g0 + a12 * g1 + a22 * g2
        # normals of pairs of edges; parallel ones have none, which the small number says
        or abs(z * r10 - y * r20) > g1 * a20 + g2 * a10 + (h1 * a02 + h2 * a01) + _PARALLEL
        or abs(z * r11 - y * r21) > g1 * a21 + g2 * a11 + (h2 * a00 + h0 * a02) + _PARALLEL
        or abs(z * r12 - y * r22) > g1 * a22 + g2 * a12 + (h0 * a01 + h1 * a00) + _PARALLEL
        or abs(x * r20 - z * r00) > g2 * a00 + g0 * a20 + (h1 * a12 + h2 * a11) + _PARALLEL
        or abs(x * r21 - z * r01) > g2 * a01 + g0 * a21 + (h2 * a10 + h0 * a12) + _PARALLEL
        or abs(x * r22 - z * r02) > g2 * a02 + g0 * a22 + (h0 * a11 + h1 * a10) + _PARALLEL
        or abs(y * r00 - x * r10) > g0 * a10 + g1 * a00 + (h1 * a22 + h2 * a21) + _PARALLEL
        or abs(y * r01 - x * r11) > g0 * a11 + g1 * a01 + (h2 * a20 + h0 * a22) + _PARALLEL
        or abs(y * r02 - x * r12) > g0 * a12 + g1 * a02 + (h0 * a21 + h1 * a20) + _PARALLEL
    )


@njit(cache=True)
def _steps_apart(
    offset: Triple, shift: Triple, rotation: tuple[Triple, Triple, Triple], half: Triple, aligned: Triple
) -> int:
    """Number of steps after which two boxes that meet, as above, may do so no more: 1 or more.

    Along each of the axes they overlap for some steps, and they meet while they do along all of them. ``shift`` is how
    one step moves the turned box, m.
    """
    last = 1e6
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        reach, other, along, speed = aligned[i], half[i], 0.0, 0.0
        for m in range(3):
            reach += abs(rotation[i][m]) * half[m]
            other += abs(rotation[m][i]) * aligned[m]
            along, speed = along + offset[m] * rotation[m][i], speed + shift[m] * rotation[m][i]
        last = min(last, _overlap(offset[i], shift[i], reach), _overlap(along, speed, other))
        for m in range(3):
            n, o = (m + 1) % 3, (m + 2) % 3
            edges = aligned[j] * abs(rotation[k][m]) + aligned[k] * abs(rotation[j][m]) + _PARALLEL
            edges += half[n] * abs(rotation[i][o]) + half[o] * abs(rotation[i][n])
            along = offset[k] * rotation[j][m] - offset[j] * rotation[k][m]
            speed = shift[k] * rotation[j][m] - shift[j] * rotation[k][m]
            last = min(last, _overlap(along, speed, edges))
    return max(1, math.ceil(last))


@njit(cache=True)
def _overlap(along: float, speed: float, reach: float) -> float:
    """For how many steps boxes surely overlap along an axis: as long as ``along``, which grows by ``speed``, is less.

    All in m, ``reach`` being the sum of their half widths.
    """
    reach -= _SURE
    if abs(along) > reach:
        return 0.0
    return np.inf if speed == 0.0 else (reach - math.copysign(1.0, speed) * along) / abs(speed)
