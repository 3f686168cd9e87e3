"""Obstacles that may come into a scene, as arrays: drawn by the dozen in one compiled call, as few are ever used."""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fixation_gym.compiled import compiled
from fixation_gym.control.box_tests import BOX_COLUMNS
from fixation_gym.envs.beyond import beyond
from fixation_gym.envs.config import Scenario
from fixation_gym.envs.obstacle_kinds import OBSTACLE_KINDS, kinds_of
from fixation_gym.envs.obstacle_parts import write_parts
from fixation_gym.envs.part_rows import COLUMNS, MOST_PARTS, PITCH, YAW, below, uniform
from fixation_gym.envs.room import Room, steps_to_room
from fixation_gym.envs.shapes import MATERIALS
from fixation_gym.types import FloatArray, MaskArray

Indices = NDArray[np.int64]

_STEP_OUT = 0.02
"""An obstacle that is in the free way is moved out by this much at a time, m."""


class Menu(NamedTuple):
    """What a scenario draws its obstacles from."""

    materials: Indices
    """Indices in ``MATERIALS``; the first obstacle is of the first one."""
    kinds: MaskArray
    """Which kinds there are for other obstacles and for the first one, shape (2, materials, kinds)."""
    around: MaskArray
    """Which kinds stand around the target."""
    distances: FloatArray
    """``ObstacleKind.distance`` of all kinds, shape (kinds, 2), m."""
    steepness: FloatArray
    """``ObstacleKind.steepness`` of all kinds, shape (kinds, 2)."""


class Aim(NamedTuple):
    """What obstacles are to leave free and to bar."""

    target: FloatArray
    """Centre of the target in the end, shape (3,), in base, m."""
    azimuth: float
    """Of the free way, in base, rad."""
    free: FloatArray
    """Direction of the free way, shape (3,)."""
    ways: FloatArray
    """Directions of all ways, shape (n, 3)."""
    above: Indices
    """Indices of those from above."""


class Drafts(NamedTuple):
    """What has room, if no other were there: what it is made of and where it stands, but not yet how it looks."""

    kinds: Indices
    materials: Indices
    first: MaskArray
    """Whether it was drawn as the first one of its scene."""
    origins: FloatArray
    """Of the floor frames, shape (n, 3), in base, m."""
    facings: FloatArray
    """Of these frames about the vertical, rad."""
    ends: Indices
    """The parts of draft i are those from ``ends[i]`` to ``ends[i + 1]``, shape (n + 1,)."""
    rows: FloatArray
    """Parts in the floor frames, as in ``part_rows``."""
    boxes: FloatArray
    """Boxes around the parts, in base, as in ``box_tests.packed``."""


@cache
def menu_of(scenario: Scenario) -> Menu:
    """What obstacles of a scenario are drawn from."""
    materials = scenario.obstacle_materials
    kinds = np.zeros((2, len(materials), len(OBSTACLE_KINDS)), bool)
    for index, material in enumerate(materials):
        made = kinds_of(material)
        for first, names in ((0, scenario.obstacle_kinds), (1, scenario.first_kinds or scenario.obstacle_kinds)):
            kinds[first, index] = [
                kind in made and kind.name in names and (first == 1 or not kind.around) for kind in OBSTACLE_KINDS
            ]
    return Menu(
        np.array([MATERIALS.index(name) for name in materials]),
        kinds,
        np.array([kind.around for kind in OBSTACLE_KINDS]),
        np.array([kind.distance for kind in OBSTACLE_KINDS]),
        np.array([kind.steepness for kind in OBSTACLE_KINDS]),
    )


def joined_drafts(first: Drafts, second: Drafts) -> Drafts:
    """All of both."""
    return Drafts(
        np.concatenate([first.kinds, second.kinds]),
        np.concatenate([first.materials, second.materials]),
        np.concatenate([first.first, second.first]),
        np.concatenate([first.origins, second.origins]),
        np.concatenate([first.facings, second.facings]),
        np.concatenate([first.ends, first.ends[-1] + second.ends[1:]]),
        np.concatenate([first.rows, second.rows]),
        np.concatenate([first.boxes, second.boxes]),
    )


def chosen_drafts(drafts: Drafts, chosen: Indices) -> Drafts:
    """Some of them, in the order of their indices."""
    counts, wanted = np.diff(drafts.ends), np.zeros(len(drafts.kinds), bool)
    wanted[chosen] = True
    parts = np.repeat(wanted, counts)
    return Drafts(
        drafts.kinds[chosen],
        drafts.materials[chosen],
        drafts.first[chosen],
        drafts.origins[chosen],
        drafts.facings[chosen],
        np.concatenate([[0], np.cumsum(counts[chosen])]),
        drafts.rows[parts],
        drafts.boxes[parts],
    )


@compiled
def draw_for_ways(
    counts: tuple[int, int], past: tuple[float, float], aim: Aim, room: Room, menu: Menu, rng: np.random.Generator
) -> Drafts:
    """Draw obstacles that bar ways: so many first ones and, if one of these has room, so many others.

    Args:
        counts: numbers of draws.
        past: range of the angle by which they stand beyond the way that they are to bar, seen from the free one, rad.
        aim: the ways.
        room: what they keep clear of.
        menu: what to draw from.
        rng: generator.
    """
    drafts = _empty(counts[0] + counts[1])
    kept = drafts.ends[0]  # 0 from an array: for a literal, numba would compile all that takes it once more
    for index in range(counts[0] + counts[1]):
        first = index < counts[0]
        if index == counts[0] and kept == 0:
            break
        # Half of the ways to be barred come from above, which is the harder to bar.
        above = rng.random() < 0.5
        way = aim.above[below(rng, len(aim.above))] if above else below(rng, len(aim.ways))
        kept += _draw(drafts, kept, first, aim.ways[way], past, aim, room, menu, rng)
    return _filled(drafts, kept)


@compiled
def draw_across(
    count: int, sight: int, past: tuple[float, float], aim: Aim, room: Room, menu: Menu, rng: np.random.Generator
) -> Drafts:
    """Draw first obstacles that all stand beyond one way."""
    drafts = _empty(count)
    kept, first = drafts.ends[0], count > 0  # 0 and True, and no literals, as above
    for _ in range(count):
        kept += _draw(drafts, kept, first, aim.ways[sight], past, aim, room, menu, rng)
    return _filled(drafts, kept)


@compiled
def _empty(count: int) -> Drafts:
    most = count * MOST_PARTS
    kinds, materials, first = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count, np.bool_)
    ends, rows = np.zeros(count + 1, np.int64), np.empty((most, COLUMNS))
    boxes = np.empty((most, BOX_COLUMNS))
    return Drafts(kinds, materials, first, np.empty((count, 3)), np.empty(count), ends, rows, boxes)


@compiled
def _filled(drafts: Drafts, count: int) -> Drafts:
    """The first ``count`` of them."""
    most = drafts.ends[count]
    return Drafts(
        drafts.kinds[:count],
        drafts.materials[:count],
        drafts.first[:count],
        drafts.origins[:count],
        drafts.facings[:count],
        drafts.ends[: count + 1],
        drafts.rows[:most],
        drafts.boxes[:most],
    )


@compiled
def _draw(
    drafts: Drafts,
    index: int,
    first: bool,
    way: FloatArray,
    past: tuple[float, float],
    aim: Aim,
    room: Room,
    menu: Menu,
    rng: np.random.Generator,
) -> int:
    """Draw an obstacle beyond ``way``, as near to the target as the free ways allow; returns 1 if it has room, or 0."""
    x, y, steepness = beyond(aim.free, way, uniform(rng, past[0], past[1]))
    choice = 0 if first else below(rng, len(menu.materials))
    kinds = menu.kinds[int(first), choice]
    suitable = _suitable_kind(menu, kinds, steepness, len(kinds))[1]
    if suitable == 0:
        return 0
    kind = _suitable_kind(menu, kinds, steepness, below(rng, suitable))[0]
    around, nearest, farthest = menu.around[kind], menu.distances[kind, 0], menu.distances[kind, 1]
    bearing = aim.azimuth if around else math.atan2(-y, -x) + rng.normal(0.0, 0.2)
    origin, most = drafts.origins[index], int((farthest - nearest) / _STEP_OUT)
    origin[0] = aim.target[0] - nearest * math.cos(bearing)
    origin[1] = aim.target[1] - nearest * math.sin(bearing)
    origin[2] = room.height
    facing = bearing + uniform(rng, -0.4, 0.4) + (math.pi if around else 0.0)
    begin = drafts.ends[index]
    end = begin + write_parts(drafts.rows[begin:], kind, menu.materials[choice], rng)
    boxes = drafts.boxes[begin:end]
    _place(drafts.rows[begin:end], origin, facing, boxes)
    outward = bearing + math.pi if around else bearing  # what stands around the target draws back from the way
    step = (-_STEP_OUT * math.cos(outward), -_STEP_OUT * math.sin(outward), 0.0)
    steps = steps_to_room(boxes, step, most, room)
    if steps < 0:
        return 0
    for axis in range(3):
        origin[axis] += steps * step[axis]
        for i in range(len(boxes)):
            boxes[i, axis] += steps * step[axis]
    drafts.kinds[index], drafts.materials[index], drafts.first[index] = kind, menu.materials[choice], first
    drafts.facings[index], drafts.ends[index + 1] = facing, end
    return 1


@compiled
def _suitable_kind(menu: Menu, kinds: MaskArray, steepness: float, wanted: int) -> tuple[int, int]:
    """Of those of some kinds that stand around the target, or where the sine of the elevation is ``steepness``.

    The one with the index ``wanted``, and how many come before it, which is all of them if there is no such one.
    """
    count = 0
    for kind in range(len(kinds)):
        fits = menu.steepness[kind, 0] <= steepness and steepness <= menu.steepness[kind, 1]
        if kinds[kind] and (fits or menu.around[kind]):
            if count == wanted:
                return kind, count
            count += 1
    return -1, count


@compiled
def _place(rows: FloatArray, origin: FloatArray, facing: float, boxes: FloatArray) -> None:
    """Write the boxes around parts whose floor frame is at a place, (3,), turned by ``facing`` about the vertical."""
    c, s = math.cos(facing), math.sin(facing)
    for i in range(len(rows)):
        x, y = rows[i, 0], rows[i, 1]
        boxes[i, 0], boxes[i, 1] = c * x - s * y + origin[0], s * x + c * y + origin[1]
        boxes[i, 2] = rows[i, 2] + origin[2]
        for axis in range(3, 6):
            boxes[i, axis] = rows[i, axis]
        cy, sy = math.cos(rows[i, YAW] + facing), math.sin(rows[i, YAW] + facing)
        cp, sp = math.cos(rows[i, PITCH]), math.sin(rows[i, PITCH])
        boxes[i, 6], boxes[i, 7], boxes[i, 8] = cy * cp, -sy, cy * sp
        boxes[i, 9], boxes[i, 10], boxes[i, 11] = sy * cp, cy, sy * sp
        boxes[i, 12], boxes[i, 13], boxes[i, 14] = -sp, 0.0, cp
