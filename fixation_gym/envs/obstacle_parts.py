"""What obstacles of each kind look like: their parts, drawn by compiled code, since a scene takes a thousand tries.

An obstacle is drawn in a floor frame: z = 0 on the table, +x from where it stands towards the target. What stands
around the target opens towards +x. Every kind is one function of material, generator and the rows to write into; it
returns how many it has written.
"""

from __future__ import annotations

import math

import numpy as np

from fixation_gym.compiled import compiled
from fixation_gym.envs.obstacle_kinds import KIND_NAMES
from fixation_gym.envs.part_rows import (
    COLUMNS,
    CYLINDER,
    DENSITY,
    FINISH,
    LABEL,
    MIRROR,
    MOST_PARTS,
    OPAQUE,
    PRIMITIVE,
    RIM,
    SOLID,
    TRANSLUCENT,
    YAW,
    below,
    either_sign,
    foot,
    parts_of,
    post,
    put,
    rows_of,
    sides,
    stiles,
    turn,
    uniform,
    write_pane,
)
from fixation_gym.envs.shapes import MATERIALS, Part
from fixation_gym.envs.things import THINGS
from fixation_gym.types import FloatArray


def draw_parts(kind: str, material: str, rng: np.random.Generator) -> tuple[Part, ...]:
    """Parts of an obstacle in its floor frame."""
    rows = np.zeros((MOST_PARTS, COLUMNS))
    count = write_parts(rows, KIND_NAMES.index(kind), MATERIALS.index(material), rng)
    return parts_of(rows[:count])


@compiled
def write_parts(rows: FloatArray, kind: int, material: int, rng: np.random.Generator) -> int:
    """Draw the parts of an obstacle, its kind being the index in ``KIND_NAMES``, which is the order here."""
    if kind == 0:
        return _thing(rows, material, rng)
    if kind == 1:
        return _wall(rows, material, rng)
    if kind == 2:
        return _leaning_board(rows, material, rng)
    if kind == 3:
        return _arch(rows, material, rng)
    if kind == 4:
        return _hanging(rows, material, rng)
    if kind == 5:
        return _roof(rows, material, rng)
    if kind == 6:
        return _shelf(rows, material, rng)
    if kind == 7:
        return _cabinet(rows, material, rng)
    return _niche(rows, material, rng) if kind == 8 else _bin(rows, material, rng)


# -- beside the target -------------------------------------------------------------------------------------------------


def _table_of_things() -> tuple[FloatArray, FloatArray]:
    """Rows of all things, shape (materials, shapes, parts, columns), and half their heights; 0 where there is none."""
    most = max(len(shapes) for shapes in THINGS.values())
    rows, heights = np.zeros((len(MATERIALS), most, MOST_PARTS, COLUMNS)), np.zeros((len(MATERIALS), most))
    for material, name in enumerate(MATERIALS):
        for index, shape in enumerate(THINGS[name]):
            rows[material, index, : len(shape.parts)] = rows_of(shape.parts)
            heights[material, index] = shape.half_extent[2]
    return rows, heights


_THINGS, _HALF_HEIGHTS = _table_of_things()
_WALLS = np.array([1, 2])
"""Numbers of side walls of a niche."""
_THING_COUNTS = np.array([len(THINGS[name]) for name in MATERIALS])


@compiled
def _thing(rows: FloatArray, material: int, rng: np.random.Generator) -> int:
    """A block, brick, post, bottle, tumbler, framed panel, mirror or cage as it is."""
    shape, scale = below(rng, _THING_COUNTS[material]), uniform(rng, 0.8, 1.0)
    labelled, count = rng.random() >= 0.3, 0
    for row in _THINGS[material, shape]:
        if row[DENSITY] > 0.0 and (labelled or row[FINISH] != LABEL):
            for column in range(COLUMNS):
                rows[count, column] = row[column] * scale if column < YAW else row[column]
            count += 1
    most = 0.35 if material in (MIRROR, TRANSLUCENT) else 3.1
    turn(rows[:count], uniform(rng, -most, most), _HALF_HEIGHTS[material, shape] * scale)
    return count


@compiled
def _wall(rows: FloatArray, material: int, rng: np.random.Generator) -> int:
    """A standing board with its foot behind it."""
    half_width, half_height = uniform(rng, 0.03, 0.09), uniform(rng, 0.07, 0.16)
    count = write_pane(rows, 0, material, half_width, half_height, 0.0, 0.0, half_height, 0.0)
    return foot(rows, count, -0.035, 0.0, 0.035, half_width)


@compiled
def _leaning_board(rows: FloatArray, material: int, rng: np.random.Generator) -> int:
    """A board that leans over towards the target or away from it, on a strut."""
    pitch = either_sign(rng) * uniform(rng, 0.25, 0.6)
    half_width, half_height = uniform(rng, 0.04, 0.09), uniform(rng, 0.08, 0.16)
    middle = half_height * math.cos(pitch)
    count = write_pane(rows, 0, material, half_width, half_height, 0.0, 0.0, middle + 0.012, pitch)
    low = -half_height * math.sin(pitch)  # where the board's lower edge stands
    count = put(rows, count, (-0.012, 0.0, 0.5 * middle), (0.006, 0.006, 0.5 * middle), 0.0, RIM)
    return foot(rows, count, 0.5 * low - 0.02, 0.0, 0.05 + 0.5 * abs(low), 0.7 * half_width)


@compiled
def _arch(rows: FloatArray, material: int, rng: np.random.Generator) -> int:
    """A lintel across the way on two posts."""
    half_width, half_depth = uniform(rng, 0.06, 0.12), uniform(rng, 0.02, 0.04)
    middle = uniform(rng, 0.12, 0.26)
    count = write_pane(rows, 0, material, half_width, half_depth, 0.0, 0.0, middle, 0.0)
    for side in (-1.0, 1.0):
        count = post(rows, count, 0.0, side * (half_width + 0.008), middle + half_depth, 0.008)
    for side in (-1.0, 1.0):
        count = foot(rows, count, 0.0, side * (half_width + 0.008), 0.045, 0.02)
    return count


@compiled
def _hanging(rows: FloatArray, material: int, rng: np.random.Generator) -> int:
    """A board or a lamp that hangs from a stand at the side."""
    side = either_sign(rng)
    half_width, half_height = uniform(rng, 0.03, 0.07), uniform(rng, 0.03, 0.05)
    middle = uniform(rng, 0.18, 0.26)
    pole, top = side * (half_width + uniform(rng, 0.03, 0.06)), middle + half_height + 0.03
    if material == OPAQUE and rng.random() < 0.5:
        count = put(rows, 0, (0.0, 0.0, middle), (half_width, half_width, half_height), 0.0, SOLID)
        rows[0, PRIMITIVE] = CYLINDER
    else:
        count = write_pane(rows, 0, material, half_width, half_height, 0.0, 0.0, middle, uniform(rng, -0.4, 0.4))
    count = put(rows, count, (0.0, 0.5 * pole, top), (0.006, 0.5 * abs(pole) + 0.006, 0.006), 0.0, RIM)
    count = put(rows, count, (0.0, 0.0, top - 0.02), (0.003, 0.003, 0.02), 0.0, RIM)  # the cord
    count = post(rows, count, 0.0, pole, top, 0.008)
    return foot(rows, count, 0.0, 0.6 * pole, 0.055, 0.05 + 0.4 * abs(pole))


@compiled
def _roof(rows: FloatArray, material: int, rng: np.random.Generator) -> int:
    """A horizontal board on four posts, like a small table."""
    half_x, half_y, height = uniform(rng, 0.05, 0.10), uniform(rng, 0.06, 0.11), uniform(rng, 0.20, 0.28)
    count = write_pane(rows, 0, material, half_y, half_x, 0.0, 0.0, height, -math.pi / 2)
    for x in (-1.0, 1.0):
        for y in (-1.0, 1.0):
            count = post(rows, count, x * (half_x - 0.008), y * (half_y - 0.008), height, 0.008)
    return count


@compiled
def _shelf(rows: FloatArray, material: int, rng: np.random.Generator) -> int:
    """A board that stands out from a wall, over the target or beside it."""
    half_x, half_y, height = uniform(rng, 0.04, 0.08), uniform(rng, 0.06, 0.11), uniform(rng, 0.18, 0.27)
    count = write_pane(rows, 0, material, half_y, half_x, 0.0, 0.0, height, -math.pi / 2)
    middle = 0.5 * height + 0.01
    count = write_pane(rows, count, _second(material), half_y, middle, -half_x - 0.006, 0.0, middle, 0.0)
    return foot(rows, count, -half_x - 0.02, 0.0, 0.04, half_y)


# -- around the target -------------------------------------------------------------------------------------------------


@compiled
def _cabinet(rows: FloatArray, material: int, rng: np.random.Generator) -> int:
    """A box that is open at one side."""
    half_x, half_y, top = uniform(rng, 0.06, 0.08), uniform(rng, 0.14, 0.18), uniform(rng, 0.26, 0.32)
    shift = -uniform(rng, 0.02, 0.05)  # the opening is not far from the target
    second = _second(material)
    count = write_pane(rows, 0, material, half_y, 0.5 * top, shift - half_x, 0.0, 0.5 * top, 0.0)
    count = write_pane(rows, count, second, half_y, half_x, shift, 0.0, top, -math.pi / 2)
    count = sides(rows, count, second, half_x, half_y, top, shift)
    return stiles(rows, count, material, half_x, half_y, top, shift)


@compiled
def _niche(rows: FloatArray, material: int, rng: np.random.Generator) -> int:
    """Three walls in a U, or two in an L, without a roof."""
    half_x, half_y, top = uniform(rng, 0.08, 0.11), uniform(rng, 0.12, 0.16), uniform(rng, 0.12, 0.26)
    walls = _WALLS[below(rng, len(_WALLS))]
    first = write_pane(rows, 0, material, half_y, 0.5 * top, -half_x, 0.0, 0.5 * top, 0.0)
    count = sides(rows, first, _second(material), half_x, half_y, top, 0.0)
    if walls == 1:
        middle = first + (count - first) // 2
        if rng.random() >= 0.5:
            for row in range(first, middle):
                for column in range(COLUMNS):
                    rows[row, column] = rows[row + count - middle, column]
        count = middle
    return foot(rows, count, -half_x - 0.02, 0.0, 0.03, half_y)


@compiled
def _bin(rows: FloatArray, material: int, rng: np.random.Generator) -> int:
    """Four low walls, and a lid over the half that is turned away."""
    half_x, half_y, top = uniform(rng, 0.15, 0.19), uniform(rng, 0.14, 0.18), uniform(rng, 0.03, 0.06)
    lid_height, lid_edge = top + uniform(rng, 0.05, 0.10), -uniform(rng, 0.02, 0.05)
    second, half_depth = _second(material), 0.5 * (lid_edge + half_x)
    count = write_pane(rows, 0, material, half_y, 0.5 * lid_height, -half_x, 0.0, 0.5 * lid_height, 0.0)
    count = write_pane(rows, count, second, half_y, 0.5 * top, half_x, 0.0, 0.5 * top, 0.0)
    count = sides(rows, count, second, half_x, half_y, top, 0.0)
    return write_pane(rows, count, second, half_y, half_depth, half_depth - half_x, 0.0, lid_height, -math.pi / 2)


@compiled
def _second(material: int) -> int:
    """Material of the other boards of a piece: MuJoCo draws the reflection of one board only."""
    return OPAQUE if material == MIRROR else material
