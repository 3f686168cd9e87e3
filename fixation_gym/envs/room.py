"""The room that an obstacle must leave: above the table, beside the target, and off the free ways of the hand."""

from __future__ import annotations

import math
from typing import NamedTuple

from fixation_gym.compiled import compiled
from fixation_gym.control.box_pairs import Triple
from fixation_gym.control.box_tests import packed, steps_off, steps_past
from fixation_gym.geometry.boxes import BoxSet
from fixation_gym.types import FloatArray

_ORBIT = 0.355
"""What is seen above a slope of ``_FLAT`` from the target stays this near, m: the hand goes around farther out."""
_FLAT = 0.5
_FOR_GOOD = 2
"""Said of an obstacle that is beside the table."""
_TARGET_GAP = 0.012
"""Least room between an obstacle and red things, m."""
FREE_ROOM = 0.01
"""Room around the hand on the free ways, m."""


class Room(NamedTuple):
    """What an obstacle must keep clear of. Arguments, since what is compiled keeps the constants that it once saw."""

    height: float
    """Of the table, in base, m."""
    table: FloatArray
    """Lowest and highest x and y of where obstacles stand, shape (2, 2), in base, m."""
    reds: FloatArray
    """Boxes around the target at all its places, the first one first, as in ``box_tests.packed``."""
    ends: FloatArray
    """Where the target is at first and in the end, shape (n, 3), in base, m."""
    ways: FloatArray
    """Axes of the hand, as in ``corridor.hand_axes``, on the ways to it that stay free, shape (m, 3, 3)."""
    swept: FloatArray
    """What the hand sweeps on them, as in ``box_tests.packed_hand``."""


@compiled
def steps_to_room(boxes: FloatArray, step: Triple, most: int, room: Room) -> int:
    """Number of steps after which an obstacle has room; -1 if it never has.

    Args:
        boxes: of the obstacle's parts at all its places, as in ``box_tests.packed``.
        step: by which it is moved, m.
        most: largest number of steps.
        room: what it must keep clear of.
    """
    latest, count, moved = 0, 0, boxes.copy()
    table, reds, ends, ways, swept = room.table, room.reds, room.ends, room.ways, room.swept
    while count <= most:
        for i in range(len(boxes)):
            for axis in range(3):
                moved[i, axis] = boxes[i, axis] + count * step[axis]
        more = _off_bounds(moved, step, table, reds)
        if more == _FOR_GOOD:
            return -1
        if more == 0:  # what was met a step ago is probably met once more
            more, latest = steps_past(ends, ways, latest, moved, swept, step)
        if more == 0:
            more = steps_off(moved, reds, _TARGET_GAP, step)
        if more == 0:
            return count
        count += more
    return -1


def holds(room: Room, boxes: BoxSet) -> bool:
    """Whether an obstacle has room where it is."""
    return steps_to_room(packed(boxes), (0.0, 0.0, 0.0), 0, room) == 0


@compiled
def _off_bounds(boxes: FloatArray, step: Triple, table: FloatArray, reds: FloatArray) -> int:
    """0 if boxes are above the table, and within ``_ORBIT`` of the target if the hand might meet them there.

    ``_FOR_GOOD`` if they are beside the table, where further steps do not bring them back; 1 if they are out otherwise.
    """
    out = 0
    for i in range(len(boxes)):
        x, y, high = 0.0, 0.0, 0.0
        for axis in range(3):
            reach = 0.0
            for k in range(3):
                reach += abs(boxes[i, 6 + 3 * axis + k]) * boxes[i, 3 + k]
            low, high = boxes[i, axis] - reach, boxes[i, axis] + reach
            if axis < 2:
                if low < table[axis, 0]:
                    out = max(out, _FOR_GOOD if step[axis] <= 0.0 else 1)
                if high > table[axis, 1]:
                    out = max(out, _FOR_GOOD if step[axis] >= 0.0 else 1)
                x, y = y, max(abs(low - reds[0, axis]), abs(high - reds[0, axis]))
        rise = high - reds[0, 2]
        if rise <= 0.0 or rise * rise < 0.99 * _FLAT**2 * (x * x + y * y):
            continue  # surely flat, as most are; the lengths take longer
        across = math.hypot(x, y)
        if rise > _FLAT * across and math.hypot(across, rise) > _ORBIT:
            out = max(out, 1)
    return out
