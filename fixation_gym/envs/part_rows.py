"""Parts of shapes as rows of an array, for compiled code, and pieces to put obstacles together from.

A row has what a ``Part`` has. Writers fill the rows from ``count`` on and return how many are filled then.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba.extending import register_jitable

from fixation_gym.compiled import compiled
from fixation_gym.envs.object_pool import SLOTS
from fixation_gym.envs.shapes import FINISHES, MATERIALS, PRIMITIVES, Part
from fixation_gym.types import FloatArray, Vector

# Columns of a row: place (3), half sizes (3) and those that follow.
YAW, PITCH, PRIMITIVE, FINISH, DENSITY = range(6, 11)
COLUMNS = 11
MOST_PARTS = max(SLOTS)
"""Largest number of parts of an obstacle."""
OPAQUE, TRANSLUCENT, MIRROR, WIRE, PLATE_GLASS, CHROME, LACQUER, PLASTIC = range(len(MATERIALS))
BOX, CYLINDER = PRIMITIVES.index("box"), PRIMITIVES.index("cylinder")
SOLID, GLASS, RIM, LABEL, MIRRORING = (FINISHES.index(name) for name in ("solid", "glass", "rim", "label", "mirror"))
_BOARDS = {
    OPAQUE: (0.006, SOLID),
    PLATE_GLASS: (0.005, GLASS),
    CHROME: (0.004, FINISHES.index("brushed")),
    LACQUER: (0.006, FINISHES.index("lacquer")),
    PLASTIC: (0.003, FINISHES.index("plastic")),
}
_FRAMELESS = np.array([material in _BOARDS for material in range(len(MATERIALS))])
_THICKNESSES = np.array([_BOARDS.get(material, (0.0, 0))[0] for material in range(len(MATERIALS))])
"""Half thickness of boards without a frame, by material, m."""
_BOARD_FINISHES = np.array([_BOARDS.get(material, (0.0, 0))[1] for material in range(len(MATERIALS))])
_RIM_WIDTH = 0.005
"""Half width of the rims of panes, m."""
_FOOT_DENSITY = 8.0
_SIGNS = np.array([-1.0, 1.0])


def rows_of(parts: Sequence[Part]) -> FloatArray:
    """Parts as rows, shape (n, ``COLUMNS``)."""
    return np.array([(*part.pos, *part.size, part.yaw, part.pitch, *_codes(part)) for part in parts])


def _codes(part: Part) -> tuple[int, int, float]:
    return PRIMITIVES.index(part.primitive), FINISHES.index(part.finish), part.density


def parts_of(rows: FloatArray) -> tuple[Part, ...]:
    """Rows, shape (n, ``COLUMNS``), as parts."""
    return tuple(
        Part(PRIMITIVES[int(primitive)], (a, b, c), (x, y, z), yaw, pitch, FINISHES[int(finish)], density)
        for x, y, z, a, b, c, yaw, pitch, primitive, finish, density in rows.tolist()
    )


def pane(material: str, half_width: float, half_height: float, centre: Vector) -> tuple[Part, ...]:
    """A flat upright board, as ``write_pane`` makes it, in its own frame."""
    rows = np.zeros((MOST_PARTS, COLUMNS))
    count = write_pane(rows, 0, MATERIALS.index(material), half_width, half_height, *centre, 0.0)
    return parts_of(rows[:count])


@register_jitable
def put(
    rows: FloatArray,
    count: int,
    place: tuple[float, float, float],
    size: tuple[float, float, float],
    pitch: float,
    finish: int,
) -> int:
    """A box that is turned by ``pitch`` about y."""
    row = rows[count]
    for axis in range(3):
        row[axis], row[3 + axis] = place[axis], size[axis]
    row[YAW], row[PITCH], row[PRIMITIVE], row[FINISH], row[DENSITY] = 0.0, pitch, BOX, finish, 1.0
    return count + 1


@register_jitable
def write_pane(
    rows: FloatArray,
    count: int,
    material: int,
    half_width: float,
    half_height: float,
    x: float,
    y: float,
    z: float,
    pitch: float,
) -> int:
    """A flat board of some material that faces +x, leaning by ``pitch`` about y; a mirror reflects on that side.

    Args:
        rows: to write into.
        count: of rows that are filled.
        material: ``TRANSLUCENT`` (glass with a rim), ``MIRROR`` (with a rim), ``WIRE``, or one without a frame.
        half_width: along y, m.
        half_height: along the board's own z, m.
        x: of its centre, m.
        y: of its centre, m.
        z: of its centre, m.
        pitch: rad; -pi/2 makes a horizontal board that faces up.
    """
    centre = (x, y, z)
    if _FRAMELESS[material]:
        return put(
            rows, count, centre, (_THICKNESSES[material], half_width, half_height), pitch, _BOARD_FINISHES[material]
        )
    inner_width, inner_height = half_width - 2 * _RIM_WIDTH, half_height - 2 * _RIM_WIDTH
    if material == MIRROR:
        # MuJoCo draws the reflection on a box's local +z face; a quarter turn takes it to the board's +x.
        count = put(rows, count, centre, (inner_height, inner_width, 0.004), pitch + math.pi / 2, MIRRORING)
    elif material == TRANSLUCENT:
        count = put(rows, count, centre, (0.003, inner_width, inner_height), pitch, GLASS)
    thick = 0.006 if material != WIRE else 0.003
    up_x, up_z = math.sin(pitch), math.cos(pitch)
    for sign in (-1.0, 1.0):
        place = (x, y + sign * (half_width - _RIM_WIDTH), z)
        count = put(rows, count, place, (thick, _RIM_WIDTH, half_height), pitch, RIM)
    for sign in (-1.0, 1.0):
        along = sign * (half_height - _RIM_WIDTH)
        count = put(rows, count, (x + along * up_x, y, z + along * up_z), (thick, half_width, _RIM_WIDTH), pitch, RIM)
    if material == WIRE:
        count = put(rows, count, centre, (0.002, 0.002, half_height), pitch, RIM)
        count = put(rows, count, centre, (0.002, half_width, 0.002), pitch, RIM)
    return count


@compiled
def uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A draw, compiled once: numba would repeat its code wherever it is asked for."""
    return rng.uniform(low, high)


@compiled
def below(rng: np.random.Generator, count: int) -> int:
    """A whole number from 0 on and less than ``count``, compiled once, too."""
    return int(rng.integers(0, count))


@compiled
def either_sign(rng: np.random.Generator) -> float:
    """-1 or 1."""
    return _SIGNS[below(rng, len(_SIGNS))]


@compiled
def post(rows: FloatArray, count: int, x: float, y: float, top: float, half: float) -> int:
    """A square post from the table up to ``top``."""
    return put(rows, count, (x, y, 0.5 * top), (half, half, 0.5 * top), 0.0, RIM)


@compiled
def foot(rows: FloatArray, count: int, x: float, y: float, half_x: float, half_y: float) -> int:
    """A heavy plate on the table."""
    count = put(rows, count, (x, y, 0.005), (half_x, half_y, 0.005), 0.0, RIM)
    rows[count - 1, DENSITY] = _FOOT_DENSITY
    return count


@compiled
def turn(rows: FloatArray, angle: float, rise: float) -> None:
    """Turn all rows about the vertical, and raise them."""
    c, s = math.cos(angle), math.sin(angle)
    for i in range(len(rows)):
        x, y = rows[i, 0], rows[i, 1]
        rows[i, 0], rows[i, 1], rows[i, 2] = c * x - s * y, s * x + c * y, rows[i, 2] + rise
        rows[i, YAW] += angle


@compiled
def sides(rows: FloatArray, count: int, material: int, half_x: float, half_y: float, top: float, shift: float) -> int:
    """Two boards along x at both ends of y: a board that faces +x, turned by a quarter about the vertical."""
    for side in (-1.0, 1.0):
        first = count
        count = write_pane(rows, count, material, half_x, 0.5 * top, 0.0, 0.0, 0.5 * top, 0.0)
        turn(rows[first:count], math.pi / 2, 0.0)
        for i in range(first, count):
            rows[i, 0], rows[i, 1] = rows[i, 0] + shift, rows[i, 1] + side * half_y
    return count


@compiled
def stiles(rows: FloatArray, count: int, material: int, half_x: float, half_y: float, top: float, shift: float) -> int:
    """Edges of what is see-through, so that something of it can be seen."""
    if material == OPAQUE:
        return count
    for side in (-1.0, 1.0):
        count = post(rows, count, shift + half_x, side * half_y, top, 0.005)
    return count
