"""Places one thing of a hard scene where its place does not give its side away. Knows no simulator.

Whatever stands on the table is nearer than the table behind it, so where the table's plane is nearer than the target,
all that is seen is in front, and no instance can be otherwise. The plane is blind where it is farther than the target:
there, things in front must look as often as things behind. So most things in front are to be seen in that part of the
image alone: they hang, or the target is on a stand.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from fixation_gym.control.box_tests import boxes_meet
from fixation_gym.envs.scene import ObstacleSpec
from fixation_gym.envs.shapes import Shape
from fixation_gym.experiments.scenarios.forms import draw_thing, hung, raised, turned
from fixation_gym.experiments.scenarios.view import SceneView, Sight
from fixation_gym.geometry.boxes import BoxSet
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, Vector

Form = Literal["standing", "raised", "hung"]
TEXTURES = ("wood_light", "wood_dark", "bricks", "metal")
PLAIN_TEXTURE = "wood_plain"
_FRONT, _BEHIND = (0.5, 0.78), (1.2, 1.8)
"""Depth of the middle of things, relative to the target's."""
_ATTEMPTS = 30
_HIDDEN = 0.1
"""Largest share of a thing that another one hides at the start."""
_GAP = 0.01
"""Between things, m."""
_LOW = 0.01
"""Parts that reach as low as this stand on the table: their middle must be over it, m."""
_SCALES = {True: (0.4, 0.75), False: (0.7, 1.1)}
"""Of things in front and behind, so that sizes in the image do not differ as much as distances."""
_LOWEST_ROW = 0.36
"""The middle of what stands on the table is within these rows."""
_ON_TABLE, _HIGHEST_STAND = 0.03, 0.16
"""What would be less than this above the table stands on it; higher than the other it hangs, m."""
_TARGET_ROOM = 0.045
"""What hides nothing stays this far from the line of sight, at the target's depth, m."""
_POLE, _FOOT_NEARNESS = (0.42, 0.66), 0.76
"""Range of the normalised column of the foot of a gallows, and the largest depth of one in front, relative to the
target's."""
_CLEAR = ("translucent", "glass")
"""Kinds that the target is seen through."""
_LEAST_SIGHT = 7
"""Lines of sight that meet a thing; fewer are too little of it to be asked about."""
_TOLD, _NOT_TOLD = 0.15, 0.03
"""Least share of a thing for which the plane says "in front" where it may, and largest where it must not."""


@dataclass(frozen=True)
class Wish:
    """What a thing shall be."""

    kind: str
    in_front: bool
    columns: tuple[float, float]
    """Range of its middle's normalised column."""
    row: float | None = None
    """Normalised row of its middle; what hardly needs to be lifted stands on the table. None: it stands there."""
    told: bool | None = False
    """In front: whether the table alone tells it; None for either."""
    across: bool = False
    """Whether it must be across the line of sight to the target."""
    plain: bool = False
    """Whether solid parts have no texture."""
    nearness: tuple[float, float] | None = None
    """Range of the depth of its middle, relative to the target's; None for the usual one of its side."""
    scales: tuple[float, float] | None = None
    """Range of its size; None for the usual one of its side."""


def find_thing(
    view: SceneView, wish: Wish, reds: list[BoxSet], others: list[ObstacleSpec], rng: np.random.Generator
) -> ObstacleSpec | None:
    """Draw things until one is as wished, has room and hides no other one; None if none is.

    Args:
        view: camera and target.
        wish: what the thing shall be.
        reds: target and stand.
        others: things that are there already.
        rng: generator.
    """
    taken = [*reds, *(other.boxes for other in others)]
    lines = [view.sight(other).lines for other in others]
    for _ in range(_ATTEMPTS):
        drawn = draw(view, wish, rng)
        if drawn is None or not has_room(view, drawn, taken) or not fulfils(view, wish, drawn):
            continue
        sight = view.sight(drawn)
        if all(sight.overlap(other) <= _HIDDEN for other in lines):
            return drawn
    return None


def draw(view: SceneView, wish: Wish, rng: np.random.Generator) -> ObstacleSpec | None:
    """A thing in some form at some place; None if its middle is out of sight."""
    shape = draw_thing(wish.kind, wish.scales or _SCALES[wish.in_front], rng)
    solid = wish.kind == "opaque"
    turn = float(rng.uniform(-math.pi, math.pi) if solid else rng.uniform(-0.35, 0.35))
    if solid:
        shape, turn = turned(shape, turn), 0.0
    x = float(rng.uniform(*wish.columns))
    depth = view.depth * float(rng.uniform(*(wish.nearness or (_FRONT if wish.in_front else _BEHIND))))
    half = shape.half_extent[2]
    lift = 0.0 if wish.row is None else float(view.point(0.0, wish.row, depth)[2]) - ROBOT.workspace.table_height - half
    if lift < -_ON_TABLE:
        return None
    form = _form(lift, rng)
    height = half if form == "standing" else half + lift
    y = view.row(depth, height)
    if abs(y) > _LOWEST_ROW:
        return None
    centre = view.point(x, y, depth)
    held, origin = _held(view, form, wish.in_front, shape, (x, depth, height), rng)
    yaw = view.facing(centre) + turn
    tint = rng.uniform(0.55, 0.95, 3) * [0.75, 1.0, 1.0]
    return ObstacleSpec(
        kind=wish.kind,
        shape=held,
        position=_moved(centre, origin, yaw),
        yaw=yaw,
        rgba=(float(tint[0]), float(tint[1]), float(tint[2]), float(rng.uniform(0.3, 0.9))),
        texture=PLAIN_TEXTURE if wish.plain else str(rng.choice(TEXTURES)),
    )


def _form(lift: float, rng: np.random.Generator) -> Form:
    """What holds up a thing whose lower edge is to be so far above the table, m."""
    if lift < _ON_TABLE:
        return "standing"
    return "raised" if lift < _HIGHEST_STAND and rng.random() < 0.5 else "hung"


def _held(
    view: SceneView,
    form: Form,
    in_front: bool,
    shape: Shape,
    at: tuple[float, float, float],
    rng: np.random.Generator,
) -> tuple[Shape, Vector]:
    """The thing with what holds it up, and where its origin is, seen from the thing's centre.

    ``at``: normalised column, depth and height over the table of the thing's centre, m.
    """
    x, depth, height = at
    if form == "standing":
        return shape, (0.0, 0.0, 0.0)
    if form == "raised":
        return raised(shape, height, float(rng.uniform(0.03, 0.045)))
    # The pole is towards the border of the image and, of what hangs in front, so near that its foot is in front, too.
    sine, cosine = -view.T_base_cam[2, 2], math.hypot(*view.T_base_cam[:2, 2])
    down = depth + height * sine
    ahead = max(0.0, (down - _FOOT_NEARNESS * view.depth) / cosine) if in_front else 0.0
    aside = float(rng.uniform(*_POLE)) * (down - ahead * cosine) - abs(x) * depth
    return hung(shape, height, (ahead, math.copysign(max(shape.half_extent[1] + 0.03, aside), x)))


def _moved(centre: FloatArray, origin: Vector, yaw: float) -> Vector:
    c, s = math.cos(yaw), math.sin(yaw)
    x, y, z = origin
    return float(centre[0] + c * x - s * y), float(centre[1] + s * x + c * y), float(centre[2] + z)


def fulfils(view: SceneView, wish: Wish, obstacle: ObstacleSpec) -> bool:
    """Whether what is seen of a thing is on its side and told or not told as wished."""
    sight = view.sight(obstacle)
    if len(sight.depths) < _LEAST_SIGHT or not sight.is_clearly(wish.in_front):
        return False
    if wish.across and not view.is_across(obstacle):
        return False
    if wish.in_front and hides(view, sight if wish.kind not in _CLEAR else _holder_sight(view, obstacle)):
        return False
    if not wish.in_front or wish.told is None:
        return True
    return sight.low_share > _TOLD if wish.told else sight.low_share < _NOT_TOLD


def _holder_sight(view: SceneView, obstacle: ObstacleSpec) -> Sight | None:
    """What is seen of what holds a see-through thing up, its solid parts; None if it stands on the table."""
    parts = tuple(part for part in obstacle.shape.parts if part.finish == "solid")
    return view.sight(replace(obstacle, shape=replace(obstacle.shape, parts=parts))) if parts else None


def has_room(view: SceneView, obstacle: ObstacleSpec, others: list[BoxSet]) -> bool:
    """Whether a thing is on the table and keeps clear of the others and of the hand."""
    boxes = obstacle.boxes
    lower_edges = boxes.centres[:, 2] - np.einsum("nj,nj->n", np.abs(boxes.rotations[:, 2]), boxes.halves)
    low = boxes.centres[lower_edges < ROBOT.workspace.table_height + _LOW]
    on_table = np.all((low[:, 0] > 0.18) & (low[:, 0] < 0.94)) and np.all(np.abs(low[:, 1]) < 0.38)
    if not on_table or any(boxes_meet(boxes, other, _GAP) for other in others):
        return False
    return view.has_room_for_hand(boxes)


def hides(view: SceneView, sight: Sight | None) -> bool:
    """Whether a thing comes too near to the line of sight to the target."""
    if sight is None or not len(sight.places):
        return False
    return bool(np.hypot(*sight.places.T).min() < _TARGET_ROOM / view.depth)


def changed(obstacle: ObstacleSpec, position: FloatArray, yaw: float) -> ObstacleSpec:
    """The same obstacle elsewhere."""
    x, y, z = position
    return replace(obstacle, position=(float(x), float(y), float(z)), yaw=yaw)
