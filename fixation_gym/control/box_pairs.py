"""Whether two boxes meet, and for how many steps they go on to: compiled, in plain numbers.

No parts of arrays are made here, each of which would cost as much as a test.
"""

from __future__ import annotations

import math

import numpy as np

from fixation_gym.compiled import compiled
from fixation_gym.types import FloatArray

SLACK = 1e-6
"""Boxes are only said to be far apart by their spheres if they are so by this much, m: rounding decides nothing."""
_PARALLEL = 1e-9
"""Less than this is no distance along the normal of two edges, m."""
_SURE = 1e-10
"""Boxes that overlap by this along every axis meet whatever rounding does, m."""
Triple = tuple[float, float, float]
Triples = tuple[Triple, Triple, Triple]
NOWHERE = (0.0, 0.0, 0.0)


@compiled
def at(place: FloatArray) -> Triple:
    """A place, shape (3,), as plain numbers."""
    return place[0], place[1], place[2]


@compiled
def row(array: FloatArray, i: int, column: int) -> Triple:
    """Three numbers of a row of an array, (n, columns)."""
    return array[i, column], array[i, column + 1], array[i, column + 2]


@compiled
def axes_of(axes: FloatArray, i: int) -> Triples:
    """One of some matrices, (n, 3, 3)."""
    return (
        (axes[i, 0, 0], axes[i, 0, 1], axes[i, 0, 2]),
        (axes[i, 1, 0], axes[i, 1, 1], axes[i, 1, 2]),
        (axes[i, 2, 0], axes[i, 2, 1], axes[i, 2, 2]),
    )


@compiled
def rotation_of(boxes: FloatArray, i: int) -> Triples:
    """Rows of the rotation of a box, as in ``packed``."""
    return row(boxes, i, 6), row(boxes, i, 9), row(boxes, i, 12)


@compiled
def columns(boxes: FloatArray, i: int) -> Triples:
    """Columns of the rotation of a box."""
    (a, b, c), (d, e, f), (g, h, k) = rotation_of(boxes, i)
    return (a, d, g), (b, e, h), (c, f, k)


@compiled
def length(vector: Triple) -> float:
    """Euclidean."""
    return math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)


@compiled
def difference(first: Triple, second: Triple) -> Triple:
    """The first one minus the second one."""
    return first[0] - second[0], first[1] - second[1], first[2] - second[2]


@compiled
def distance(first: FloatArray, i: int, second: FloatArray, j: int) -> float:
    """Between places at the beginning of rows of two arrays, m."""
    return length(difference(row(first, i, 0), row(second, j, 0)))


@compiled
def widened(half: Triple, gap: float) -> Triple:
    """Half sizes with some room on all sides, m."""
    return half[0] + gap, half[1] + gap, half[2] + gap


@compiled
def _dot(first: Triple, second: Triple) -> float:
    return first[0] * second[0] + first[1] * second[1] + first[2] * second[2]


@compiled
def turned(frame: Triples, place: Triple, origin: Triple) -> Triple:
    """A place in the frame at ``origin`` whose axes are the rows of ``frame``."""
    offset = difference(place, origin)
    return _dot(frame[0], offset), _dot(frame[1], offset), _dot(frame[2], offset)


@compiled
def turned_axes(frame: Triples, rotation: Triples) -> Triples:
    """Rows of a rotation in the frame whose axes are the rows of ``frame``."""
    return _product(frame[0], rotation), _product(frame[1], rotation), _product(frame[2], rotation)


@compiled
def _product(row: Triple, rotation: Triples) -> Triple:
    (a, b, c), (first, second, third) = row, rotation
    return (
        a * first[0] + b * second[0] + c * third[0],
        a * first[1] + b * second[1] + c * third[1],
        a * first[2] + b * second[2] + c * third[2],
    )


@compiled
def is_outside(place: Triple, low: Triple, high: Triple, margin: float) -> bool:
    """Whether a place is farther than ``margin`` m from the box between two corners, along one of its axes."""
    outside = False
    for k in range(3):
        outside |= place[k] < low[k] - margin or place[k] > high[k] + margin
    return outside


@compiled
def reach(row: Triple, half: Triple) -> float:
    """Half width of a box along an axis that has the components ``row`` in its frame, with some slack, m."""
    return abs(row[0]) * half[0] + abs(row[1]) * half[1] + abs(row[2]) * half[2] + SLACK


@compiled
def is_beyond(offset: Triple, reach: Triple, half: Triple) -> bool:
    """Whether what reaches so far is surely apart from an aligned box at the origin, as most boxes are."""
    return (
        abs(offset[0]) > half[0] + reach[0]
        or abs(offset[1]) > half[1] + reach[1]
        or abs(offset[2]) > half[2] + reach[2]
    )


@compiled
def meets_aligned(offset: Triple, rotation: Triples, half: Triple, aligned: Triple) -> bool:
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


@compiled
def steps_apart(offset: Triple, shift: Triple, rotation: Triples, half: Triple, aligned: Triple) -> int:
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


@compiled
def _overlap(along: float, speed: float, reach: float) -> float:
    """For how many steps boxes surely overlap along an axis: as long as ``along``, which grows by ``speed``, is less.

    All in m, ``reach`` being the sum of their half widths.
    """
    reach -= _SURE
    if abs(along) > reach:
        return 0.0
    return np.inf if speed == 0.0 else (reach - math.copysign(1.0, speed) * along) / abs(speed)
