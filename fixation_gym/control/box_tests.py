"""Whether boxes meet: compiled tests of sets of boxes, which sampling a scene asks for a million times.

Most boxes are far from each other, and spheres or boxes around them tell; the exact test is for the rest.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fixation_gym.geometry.boxes import BoxSet
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


BOX_COLUMNS = 15
Triple = tuple[float, float, float]
Triples = tuple[Triple, Triple, Triple]
_NOWHERE = (0.0, 0.0, 0.0)


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


@njit(cache=True)
def _any_meets(target: FloatArray, axes: FloatArray, boxes: FloatArray, hand: FloatArray) -> MaskArray:
    hit = np.zeros(len(axes), np.bool_)
    for camera in range(len(axes)):
        hit[camera] = meets(target, axes, camera, boxes, 0, len(boxes), hand)
    return hit


@njit(cache=True)
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
    return _first_met(_axes_of(axes, camera), _at(target), boxes, begin, end, hand)[0] >= 0


@njit(cache=True)
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
        frame, target = _axes_of(axes, index % ways), _row(targets, index // ways, 0)
        i, k = _first_met(frame, target, boxes, 0, len(boxes), hand)
        if i >= 0:
            offset = _difference(_turned(frame, _row(boxes, i, 0), target), _row(hand, k, 0))
            rotation = _turned_axes(frame, _rotation_of(boxes, i))
            shift, half, other = _turned(frame, step, _NOWHERE), _row(boxes, i, 3), _row(hand, k, 3)
            return _steps_apart(offset, shift, rotation, half, other), index
    return 0, latest


@njit(cache=True)
def _first_met(
    frame: Triples, target: Triple, boxes: FloatArray, begin: int, end: int, hand: FloatArray
) -> tuple[int, int]:
    """Indices of a box and of one along the axes ``frame`` that it meets; -1 if there is none."""
    low, high = _row(hand, 0, 0), _row(hand, 0, 3)
    for i in range(begin, end):
        half, place = _row(boxes, i, 3), _turned(frame, _row(boxes, i, 0), target)
        if _is_outside(place, low, high, _length(half)):  # as most are
            continue
        rotation = _turned_axes(frame, _rotation_of(boxes, i))
        reach = _reach(rotation[0], half), _reach(rotation[1], half), _reach(rotation[2], half)
        for k in range(1, len(hand)):
            offset, other = _difference(place, _row(hand, k, 0)), _row(hand, k, 3)
            if not _is_beyond(offset, reach, other) and _meets_aligned(offset, rotation, half, other):
                return i, k
    return -1, -1


@njit(cache=True)
def may_meet(
    target: FloatArray, axes: FloatArray, camera: int, spheres: FloatArray, i: int, hand: FloatArray
) -> bool:
    """Whether anything within a sphere, one of ``spheres_around``, could meet a box along a camera's axes."""
    place = _turned(_axes_of(axes, camera), _row(spheres, i, 0), _at(target))
    return not _is_outside(place, _row(hand, 0, 0), _row(hand, 0, 3), spheres[i, 3] + _SLACK)


@njit(cache=True)
def any_pair_meets(first: FloatArray, begin: int, end: int, second: FloatArray, gap: float) -> bool:
    """Whether one of some boxes comes nearer than about ``gap`` m to one of others; both as in ``packed``."""
    for i in range(begin, end):  # noqa: SIM110 (numba knows no generators)
        if _one_met(first, i, second, 0, len(second), gap) >= 0:
            return True
    return False


@njit(cache=True)
def steps_off(first: FloatArray, second: FloatArray, gap: float, step: Triple) -> int:
    """Number of steps, m, that surely leave the first boxes so near to the second ones, and one more.

    0 if they are not so near as they are.
    """
    for i in range(len(first)):
        j = _one_met(first, i, second, 0, len(second), gap)
        if j >= 0:
            frame, half = _columns(first, i), _widened(_row(first, i, 3), gap)
            offset, shift = _turned(frame, _row(second, j, 0), _row(first, i, 0)), _turned(frame, _NOWHERE, step)
            rotation = _turned_axes(frame, _rotation_of(second, j))
            return _steps_apart(offset, shift, rotation, _row(second, j, 3), half)
    return 0


@njit(cache=True)
def _one_met(first: FloatArray, i: int, second: FloatArray, begin: int, end: int, gap: float) -> int:
    """Index of one of the second boxes that comes so near to one of the first; -1 if none does."""
    centre, half, frame = _row(first, i, 0), _widened(_row(first, i, 3), gap), _columns(first, i)
    radius = _length(half)
    for j in range(begin, end):
        offset, other = _turned(frame, _row(second, j, 0), centre), _row(second, j, 3)
        if _length(offset) > radius + _length(other) + _SLACK:
            continue
        if _meets_aligned(offset, _turned_axes(frame, _rotation_of(second, j)), other, half):
            return j
    return -1


@njit(cache=True)
def pairs_that_meet(boxes: FloatArray, ends: NDArray[np.int64], gap: float) -> MaskArray:
    """For n sets of boxes, which come nearer than about ``gap`` m to each other, shape (n, n).

    Set i has the boxes from ``ends[i]`` to ``ends[i + 1]``; they are as in ``packed``.
    """
    count = len(ends) - 1
    meet, spheres = np.zeros((count, count), np.bool_), spheres_around(boxes, ends)
    for i in range(count):
        for j in range(i):
            room = spheres[j, 3] + 2.0 * gap + _SLACK
            if _distance(spheres, i, spheres, j) > spheres[i, 3] + room:
                continue
            for box in range(ends[i], ends[i + 1]):
                if _distance(boxes, box, spheres, j) > _length(_row(boxes, box, 3)) + room:
                    continue
                if _one_met(boxes, box, boxes, ends[j], ends[j + 1], gap) >= 0:
                    meet[i, j] = meet[j, i] = True
                    break
    return meet


@njit(cache=True)
def spheres_around(boxes: FloatArray, ends: NDArray[np.int64]) -> FloatArray:
    """Middles and radii of spheres around the boxes from ``ends[i]`` to ``ends[i + 1]``, shape (n, 4), m."""
    spheres = np.zeros((len(ends) - 1, 4))
    for i in range(len(spheres)):
        for box in range(ends[i], ends[i + 1]):
            for axis in range(3):
                spheres[i, axis] += boxes[box, axis] / (ends[i + 1] - ends[i])
        for box in range(ends[i], ends[i + 1]):
            spheres[i, 3] = max(spheres[i, 3], _distance(boxes, box, spheres, i) + _length(_row(boxes, box, 3)))
    return spheres


# Below here are plain numbers and no parts of arrays, each of which would cost as much as a test.


@njit(cache=True)
def _at(place: FloatArray) -> Triple:
    return place[0], place[1], place[2]


@njit(cache=True)
def _row(array: FloatArray, i: int, column: int) -> Triple:
    """Three numbers of a row of an array, (n, columns)."""
    return array[i, column], array[i, column + 1], array[i, column + 2]


@njit(cache=True)
def _axes_of(axes: FloatArray, i: int) -> Triples:
    """One of some matrices, (n, 3, 3)."""
    return (
        (axes[i, 0, 0], axes[i, 0, 1], axes[i, 0, 2]),
        (axes[i, 1, 0], axes[i, 1, 1], axes[i, 1, 2]),
        (axes[i, 2, 0], axes[i, 2, 1], axes[i, 2, 2]),
    )


@njit(cache=True)
def _rotation_of(boxes: FloatArray, i: int) -> Triples:
    """Rows of the rotation of a box, as in ``packed``."""
    return _row(boxes, i, 6), _row(boxes, i, 9), _row(boxes, i, 12)


@njit(cache=True)
def _columns(boxes: FloatArray, i: int) -> Triples:
    """Columns of the rotation of a box."""
    (a, b, c), (d, e, f), (g, h, k) = _rotation_of(boxes, i)
    return (a, d, g), (b, e, h), (c, f, k)


@njit(cache=True)
def _length(vector: Triple) -> float:
    return math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)


@njit(cache=True)
def _difference(first: Triple, second: Triple) -> Triple:
    return first[0] - second[0], first[1] - second[1], first[2] - second[2]


@njit(cache=True)
def _distance(first: FloatArray, i: int, second: FloatArray, j: int) -> float:
    """Between places at the beginning of rows of two arrays, m."""
    return _length(_difference(_row(first, i, 0), _row(second, j, 0)))


@njit(cache=True)
def _widened(half: Triple, gap: float) -> Triple:
    return half[0] + gap, half[1] + gap, half[2] + gap


@njit(cache=True)
def _dot(first: Triple, second: Triple) -> float:
    return first[0] * second[0] + first[1] * second[1] + first[2] * second[2]


@njit(cache=True)
def _turned(frame: Triples, place: Triple, origin: Triple) -> Triple:
    """A place in the frame at ``origin`` whose axes are the rows of ``frame``."""
    offset = _difference(place, origin)
    return _dot(frame[0], offset), _dot(frame[1], offset), _dot(frame[2], offset)


@njit(cache=True)
def _turned_axes(frame: Triples, rotation: Triples) -> Triples:
    """Rows of a rotation in the frame whose axes are the rows of ``frame``."""
    return _product(frame[0], rotation), _product(frame[1], rotation), _product(frame[2], rotation)


@njit(cache=True)
def _product(row: Triple, rotation: Triples) -> Triple:
    (a, b, c), (first, second, third) = row, rotation
    return (
        a * first[0] + b * second[0] + c * third[0],
        a * first[1] + b * second[1] + c * third[1],
        a * first[2] + b * second[2] + c * third[2],
    )


@njit(cache=True)
def _is_outside(place: Triple, low: Triple, high: Triple, margin: float) -> bool:
    outside = False
    for k in range(3):
        outside |= place[k] < low[k] - margin or place[k] > high[k] + margin
    return outside


@njit(cache=True)
def _reach(row: Triple, half: Triple) -> float:
    """Half width of a box along an axis that has the components ``row`` in its frame, with some slack, m."""
    return abs(row[0]) * half[0] + abs(row[1]) * half[1] + abs(row[2]) * half[2] + _SLACK


@njit(cache=True)
def _is_beyond(offset: Triple, reach: Triple, half: Triple) -> bool:
    """Whether what reaches so far is surely apart from an aligned box at the origin, as most boxes are."""
    return (
        abs(offset[0]) > half[0] + reach[0] or abs(offset[1]) > half[1] + reach[1] or abs(offset[2]) > half[2] + reach[2]
    )


@njit(cache=True)
def _meets_aligned(offset: Triple, rotation: Triples, half: Triple, aligned: Triple) -> bool:
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
    offset: Triple, shift: Triple, rotation: Triples, half: Triple, aligned: Triple
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
