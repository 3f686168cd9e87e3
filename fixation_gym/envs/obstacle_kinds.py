"""Kinds of obstacles, each one object: what it looks like and where it stands. Add a kind here.

An obstacle is drawn in a floor frame: z = 0 on the table, +x from where it stands towards the target. What stands
around the target opens towards +x.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fixation_gym.envs.object_pool import THINGS
from fixation_gym.envs.shapes import Part, Shape, pane, scaled, without
from fixation_gym.types import Vector

MATERIALS = ("opaque", "translucent", "mirror", "wire")
"""Wood, bricks or metal; glass with rims; one framed mirror; bars."""

Parts = tuple[Part, ...]
Draw = Callable[[str, np.random.Generator], Parts]
_FOOT_DENSITY = 8.0


@dataclass(frozen=True)
class ObstacleKind:
    """One kind of obstacle."""

    name: str
    distance: tuple[float, float]
    """Range of the horizontal distance between its place and the target, m; 0 for what stands around it."""
    steepness: tuple[float, float]
    """Range of the sine of the elevation in which it is seen from the target, for what stands beside it."""
    draw: Draw
    """Parts in the floor frame for a material and a generator."""
    materials: tuple[str, ...] = MATERIALS
    around: bool = False
    """Whether it stands around the target."""


def kinds_of(material: str) -> tuple[ObstacleKind, ...]:
    """Kinds that exist in a material."""
    return tuple(kind for kind in OBSTACLE_KINDS if material in kind.materials)


# -- beside the target -------------------------------------------------------------------------------------------------


def _thing(material: str, rng: np.random.Generator) -> Parts:
    """A block, brick, post, bottle, tumbler, framed panel, mirror or cage as it is."""
    shapes = THINGS[material]
    shape: Shape = scaled(shapes[int(rng.integers(len(shapes)))], float(rng.uniform(0.8, 1.0)))
    if rng.random() < 0.3:
        shape = without(shape, "label")
    turn = float(rng.uniform(-0.35, 0.35)) if material in ("mirror", "translucent") else float(rng.uniform(-3.1, 3.1))
    return _turned(shape.parts, turn, shape.half_extent[2])


def _wall(material: str, rng: np.random.Generator) -> Parts:
    """A standing board with its foot behind it."""
    half_width, half_height = rng.uniform(0.03, 0.09), rng.uniform(0.07, 0.16)
    board = pane(material, half_width, half_height, (0.0, 0.0, half_height))
    return (*board, _foot(-0.035, 0.0, 0.035, half_width))


def _leaning_board(material: str, rng: np.random.Generator) -> Parts:
    """A board that leans over towards the target or away from it, on a strut."""
    pitch = float(rng.choice((-1.0, 1.0)) * rng.uniform(0.25, 0.6))
    half_width, half_height = rng.uniform(0.04, 0.09), rng.uniform(0.08, 0.16)
    middle = half_height * math.cos(pitch)
    board = pane(material, half_width, half_height, (0.0, 0.0, middle + 0.012), pitch)
    low = -half_height * math.sin(pitch)  # where the board's lower edge stands
    strut = Part("box", (0.006, 0.006, 0.5 * middle), (-0.012, 0.0, 0.5 * middle), finish="rim")
    return (*board, strut, _foot(0.5 * low - 0.02, 0.0, 0.05 + 0.5 * abs(low), 0.7 * half_width))


def _arch(material: str, rng: np.random.Generator) -> Parts:
    """A lintel across the way on two posts."""
    half_width, half_depth = rng.uniform(0.06, 0.12), rng.uniform(0.02, 0.04)
    middle = rng.uniform(0.12, 0.26)
    lintel = pane(material, half_width, half_depth, (0.0, 0.0, middle))
    top = middle + half_depth
    posts = [_post(0.0, side * (half_width + 0.008), top, 0.008) for side in (-1.0, 1.0)]
    feet = [_foot(0.0, side * (half_width + 0.008), 0.045, 0.02) for side in (-1.0, 1.0)]
    return (*lintel, *posts, *feet)


def _hanging(material: str, rng: np.random.Generator) -> Parts:
    """A board or a lamp that hangs from a stand at the side."""
    side = float(rng.choice((-1.0, 1.0)))
    half_width, half_height = rng.uniform(0.03, 0.07), rng.uniform(0.03, 0.05)
    middle = rng.uniform(0.18, 0.26)
    pole, top = side * (half_width + rng.uniform(0.03, 0.06)), middle + half_height + 0.03
    if material == "opaque" and rng.random() < 0.5:
        hung: Parts = (Part("cylinder", (half_width, half_width, half_height), (0.0, 0.0, middle)),)
    else:
        hung = pane(material, half_width, half_height, (0.0, 0.0, middle), float(rng.uniform(-0.4, 0.4)))
    arm = Part("box", (0.006, 0.5 * abs(pole) + 0.006, 0.006), (0.0, 0.5 * pole, top), finish="rim")
    cord = Part("box", (0.003, 0.003, 0.02), (0.0, 0.0, top - 0.02), finish="rim")
    return (*hung, arm, cord, _post(0.0, pole, top, 0.008), _foot(0.0, 0.6 * pole, 0.055, 0.05 + 0.4 * abs(pole)))


def _roof(material: str, rng: np.random.Generator) -> Parts:
    """A horizontal board on four posts, like a small table."""
    half_x, half_y, height = rng.uniform(0.05, 0.10), rng.uniform(0.06, 0.11), rng.uniform(0.20, 0.28)
    board = pane(material, half_y, half_x, (0.0, 0.0, height), -math.pi / 2)
    corners = [(x, y) for x in (-1.0, 1.0) for y in (-1.0, 1.0)]
    return (*board, *(_post(x * (half_x - 0.008), y * (half_y - 0.008), height, 0.008) for x, y in corners))


def _shelf(material: str, rng: np.random.Generator) -> Parts:
    """A board that stands out from a wall, over the target or beside it."""
    half_x, half_y, height = rng.uniform(0.04, 0.08), rng.uniform(0.06, 0.11), rng.uniform(0.18, 0.27)
    board = pane(material, half_y, half_x, (0.0, 0.0, height), -math.pi / 2)
    back = pane(_second(material), half_y, 0.5 * height + 0.01, (-half_x - 0.006, 0.0, 0.5 * height + 0.01))
    return (*board, *back, _foot(-half_x - 0.02, 0.0, 0.04, half_y))


# -- around the target -------------------------------------------------------------------------------------------------


def _cabinet(material: str, rng: np.random.Generator) -> Parts:
    """A box that is open at one side."""
    half_x, half_y, top = rng.uniform(0.06, 0.08), rng.uniform(0.14, 0.18), rng.uniform(0.26, 0.32)
    shift = -rng.uniform(0.02, 0.05)  # the opening is not far from the target
    second = _second(material)
    back = pane(material, half_y, 0.5 * top, (shift - half_x, 0.0, 0.5 * top))
    roof = pane(second, half_y, half_x, (shift, 0.0, top), -math.pi / 2)
    return (*back, *roof, *_sides(second, half_x, half_y, top, shift), *_stiles(half_x, half_y, top, shift, material))


def _niche(material: str, rng: np.random.Generator) -> Parts:
    """Three walls in a U, or two in an L, without a roof."""
    half_x, half_y, top = rng.uniform(0.08, 0.11), rng.uniform(0.12, 0.16), rng.uniform(0.12, 0.26)
    second, sides = _second(material), int(rng.integers(1, 3))
    back = pane(material, half_y, 0.5 * top, (-half_x, 0.0, 0.5 * top))
    left = _sides(second, half_x, half_y, top, 0.0)
    chosen = left if sides == 2 else left[: len(left) // 2] if rng.random() < 0.5 else left[len(left) // 2 :]
    return (*back, *chosen, _foot(-half_x - 0.02, 0.0, 0.03, half_y))


def _bin(material: str, rng: np.random.Generator) -> Parts:
    """Four low walls, and a lid over the half that is turned away."""
    half_x, half_y, top = rng.uniform(0.15, 0.19), rng.uniform(0.14, 0.18), rng.uniform(0.03, 0.06)
    second, lid_height, lid_edge = _second(material), top + rng.uniform(0.05, 0.10), -rng.uniform(0.02, 0.05)
    back = pane(material, half_y, 0.5 * lid_height, (-half_x, 0.0, 0.5 * lid_height))
    front = pane(second, half_y, 0.5 * top, (half_x, 0.0, 0.5 * top))
    half_depth = 0.5 * (lid_edge + half_x)
    lid = pane(second, half_y, half_depth, (half_depth - half_x, 0.0, lid_height), -math.pi / 2)
    return (*back, *front, *_sides(second, half_x, half_y, top, 0.0), *lid)


# -- pieces ------------------------------------------------------------------------------------------------------------


def _second(material: str) -> str:
    """Material of the other boards of a piece: MuJoCo draws the reflection of one board only."""
    return "opaque" if material == "mirror" else material


def _sides(material: str, half_x: float, half_y: float, top: float, shift: float) -> Parts:
    """Two boards along x at both ends of y: a board that faces +x, turned by a quarter about the vertical."""
    board = pane(material, half_x, 0.5 * top, (0.0, 0.0, 0.5 * top))
    turned = _turned(board, math.pi / 2, 0.0)
    return tuple(_moved(part, (shift, side * half_y, 0.0)) for side in (-1.0, 1.0) for part in turned)


def _stiles(half_x: float, half_y: float, top: float, shift: float, material: str) -> Parts:
    """Edges of what is see-through, so that something of it can be seen."""
    if material == "opaque":
        return ()
    return tuple(_post(shift + half_x, side * half_y, top, 0.005) for side in (-1.0, 1.0))


def _post(x: float, y: float, top: float, half: float) -> Part:
    return Part("box", (half, half, 0.5 * top), (x, y, 0.5 * top), finish="rim")


def _foot(x: float, y: float, half_x: float, half_y: float) -> Part:
    return Part("box", (half_x, half_y, 0.005), (x, y, 0.005), finish="rim", density=_FOOT_DENSITY)


def _turned(parts: Parts, angle: float, rise: float) -> Parts:
    """Parts turned about the vertical and raised."""
    c, s = math.cos(angle), math.sin(angle)
    return tuple(
        replace(part, yaw=part.yaw + angle, pos=(c * x - s * y, s * x + c * y, z + rise))
        for part in parts
        for x, y, z in (part.pos,)
    )


def _moved(part: Part, offset: Vector) -> Part:
    x, y, z = part.pos
    return replace(part, pos=(x + offset[0], y + offset[1], z + offset[2]))


OBSTACLE_KINDS: tuple[ObstacleKind, ...] = (
    ObstacleKind("thing", (0.08, 0.30), (0.0, 0.75), _thing),
    ObstacleKind("wall", (0.06, 0.30), (0.0, 0.9), _wall),
    ObstacleKind("leaning_board", (0.08, 0.30), (0.0, 0.9), _leaning_board),
    ObstacleKind("arch", (0.06, 0.30), (0.2, 0.9), _arch),
    ObstacleKind("hanging", (0.02, 0.28), (0.5, 1.0), _hanging),
    ObstacleKind("roof", (0.04, 0.28), (0.6, 1.0), _roof),
    ObstacleKind("shelf", (0.04, 0.28), (0.5, 1.0), _shelf),
    ObstacleKind("cabinet", (0.0, 0.12), (0.0, 1.0), _cabinet, around=True),
    ObstacleKind("niche", (0.0, 0.10), (0.0, 1.0), _niche, around=True),
    ObstacleKind("bin", (0.0, 0.08), (0.0, 1.0), _bin, around=True),
)
KIND_NAMES = tuple(kind.name for kind in OBSTACLE_KINDS)
