"""The room that an obstacle must leave: above the table, beside the target, and off the free ways of the hand."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from fixation_gym.control.box_tests import Aligned, steps_off, steps_past
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
    reds: BoxSet
    """Boxes around the target at all its places, the first one first."""
    ends: FloatArray
    """Where the target is at first and in the end, shape (n, 3), in base, m."""
    ways: FloatArray
    """Axes of the hand, as in ``corridor.hand_axes``, on the ways to it that stay free, shape (m, 3, 3)."""
    swept: Aligned
    """What the hand sweeps on them."""


@njit(cache=True)
def steps_to_room(boxes: BoxSet, step: FloatArray, most: int, room: Room) -> int:
    """Number of steps after which an obstacle has room; -1 if it never has.

    Args:
        boxes: of the obstacle's parts at all its places.
        step: by which it is moved, shape (3,), m.
        most: largest number of steps.
        room: what it must keep clear of.
    """
    latest, count = 0, 0
    moved = BoxSet(boxes.centres.copy(), boxes.rotations, boxes.halves)
    while count <= most:
        for i in range(len(boxes.centres)):
            for axis in range(3):
                moved.centres[i, axis] = boxes.centres[i, axis] + count * step[axis]
        more = _off_bounds(moved, step, room)
        if more == _FOR_GOOD:
            return -1
        if more == 0:
            more, latest = _steps_off_ways(moved, step, latest, room)
        if more == 0:
            more = steps_off(moved, room.reds, _TARGET_GAP, step)
        if more == 0:
            return count
        count += more
    return -1


@njit(cache=True)
def _steps_off_ways(boxes: BoxSet, step: FloatArray, latest: int, room: Room) -> tuple[int, int]:
    """Number of steps to a place that may be off the free ways, 0 if this one is, and the way that is met.

    The way with index ``latest`` is looked at first.
    """
    ways = len(room.ways)
    for pair in range(len(room.ends) * ways):
        way = (latest + pair) % (len(room.ends) * ways)
        more = steps_past(room.ends[way // ways], room.ways[way % ways], boxes, room.swept, step)
        if more > 0:
            return more, way
    return 0, latest


def holds(room: Room, boxes: BoxSet) -> bool:
    """Whether an obstacle has room where it is."""
    return steps_to_room(boxes, np.zeros(3), 0, room) == 0


@njit(cache=True)
def _off_bounds(boxes: BoxSet, step: FloatArray, room: Room) -> int:
    """0 if boxes are above the table, and within ``_ORBIT`` of the target if the hand might meet them there.

    ``_FOR_GOOD`` if they are beside the table, where further steps do not bring them back; 1 if they are out otherwise.
    """
    low, high, table, target = np.empty(3), np.empty(3), room.table, room.reds.centres[0]
    out = 0
    for i in range(len(boxes.centres)):
        for axis in range(3):
            reach = 0.0
            for k in range(3):
                reach += abs(boxes.rotations[i, axis, k]) * boxes.halves[i, k]
            low[axis], high[axis] = boxes.centres[i, axis] - reach, boxes.centres[i, axis] + reach
        for axis in range(2):
            if low[axis] < table[axis, 0]:
                out = max(out, _FOR_GOOD if step[axis] <= 0.0 else 1)
            if high[axis] > table[axis, 1]:
                out = max(out, _FOR_GOOD if step[axis] >= 0.0 else 1)
        x = max(abs(low[0] - target[0]), abs(high[0] - target[0]))
        y = max(abs(low[1] - target[1]), abs(high[1] - target[1]))
        across, rise = math.hypot(x, y), high[2] - target[2]
        if rise > _FLAT * across and math.hypot(across, rise) > _ORBIT:
            out = max(out, 1)
    return out
