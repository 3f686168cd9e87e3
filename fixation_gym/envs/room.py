"""The room that an obstacle must leave: above the table, beside the target, and off the free ways of the hand."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from fixation_gym.control.box_tests import Aligned, any_pair_meets, meets
from fixation_gym.geometry.boxes import BoxSet
from fixation_gym.types import FloatArray

_ORBIT = 0.355
"""What is seen above a slope of ``_FLAT`` from the target stays this near, m: the hand goes around farther out."""
_FLAT = 0.5
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
    latest, ways = 0, len(room.ways)
    moved = BoxSet(boxes.centres.copy(), boxes.rotations, boxes.halves)
    for count in range(most + 1):
        for i in range(len(boxes.centres)):
            for axis in range(3):
                moved.centres[i, axis] = boxes.centres[i, axis] + count * step[axis]
        met = -1
        for pair in range(len(room.ends) * ways):
            # What was met a step ago is probably met once more.
            way = (latest + pair) % (len(room.ends) * ways)
            if meets(room.ends[way // ways], room.ways[way % ways], moved, room.swept):
                met = way
                break
            if pair == 0 and not _is_clear(moved, room):
                met = latest
                break
        if met < 0:
            return count
        latest = met
    return -1


@njit(cache=True)
def _is_clear(boxes: BoxSet, room: Room) -> bool:
    """Whether an obstacle is above the table and beside the target."""
    within = _within_bounds(boxes, room.table, room.reds.centres[0])
    return within and not any_pair_meets(boxes, room.reds, _TARGET_GAP)


def holds(room: Room, boxes: BoxSet) -> bool:
    """Whether an obstacle has room where it is."""
    return steps_to_room(boxes, np.zeros(3), 0, room) == 0


@njit(cache=True)
def _within_bounds(boxes: BoxSet, table: FloatArray, target: FloatArray) -> bool:
    """Whether boxes are above the table, and within ``_ORBIT`` of the target if the hand might meet them there."""
    low, high = np.empty(3), np.empty(3)
    for i in range(len(boxes.centres)):
        for axis in range(3):
            reach = 0.0
            for k in range(3):
                reach += abs(boxes.rotations[i, axis, k]) * boxes.halves[i, k]
            low[axis], high[axis] = boxes.centres[i, axis] - reach, boxes.centres[i, axis] + reach
        for axis in range(2):
            if low[axis] < table[axis, 0] or high[axis] > table[axis, 1]:
                return False
        x = max(abs(low[0] - target[0]), abs(high[0] - target[0]))
        y = max(abs(low[1] - target[1]), abs(high[1] - target[1]))
        across, rise = math.hypot(x, y), high[2] - target[2]
        if rise > _FLAT * across and math.hypot(across, rise) > _ORBIT:
            return False
    return True
