"""Things of the hard scenes and how they are held up: they stand on the table, on a stand, or hang from a gallows.

A thing is held in a frame of its own: the origin is its centre, +x faces the camera, +y points to the right in the
image, the table is at z = -height.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fixation_gym.envs.obstacle_parts import draw_parts
from fixation_gym.envs.shapes import Part, Shape, centred, scaled, without
from fixation_gym.envs.things import THINGS
from fixation_gym.types import Vector

STAND = "stand"
_FOOT_SHARE = 9.0
"""Mass of a foot by that of the thing it holds: the centre of mass is over the foot."""
_HALF_FOOT = 0.055
"""Half side of the foot of a gallows, m."""


def draw_thing(kind: str, scales: tuple[float, float], rng: np.random.Generator) -> Shape:
    """A thing of a material; solid ones are often a leaning board, others have a label or not."""
    scale = float(rng.uniform(*scales))
    if kind == "opaque" and rng.random() < 0.25:
        return scaled(centred("leaning board", draw_parts("leaning_board", kind, rng), 0.6)[0], scale)
    shapes = THINGS[kind]
    shape = scaled(shapes[int(rng.integers(len(shapes)))], scale)
    return without(shape, "label") if rng.random() < 0.5 else shape


def turned(shape: Shape, yaw: float) -> Shape:
    """The shape turned about the vertical; its box grows with it."""
    c, s = math.cos(yaw), math.sin(yaw)
    parts = tuple(
        replace(
            part,
            yaw=part.yaw + yaw,
            pos=(c * part.pos[0] - s * part.pos[1], s * part.pos[0] + c * part.pos[1], part.pos[2]),
        )
        for part in shape.parts
    )
    return centred(shape.name, parts, shape.mass)[0]


def raised(shape: Shape, height: float, radius: float) -> tuple[Shape, Vector]:
    """A thing on a round stand whose centre is at ``height`` over the table; also where the new shape's origin is."""
    half = 0.5 * (height - shape.half_extent[2])
    stand = Part("cylinder", (radius, radius, half), (0.0, 0.0, half - height))
    return centred(f"{shape.name} on a stand", (*shape.parts, stand), 2.0 * shape.mass)


def hung(shape: Shape, height: float, pole: tuple[float, float]) -> tuple[Shape, Vector]:
    """A thing that hangs with its centre at ``height`` over the table; also where the new shape's origin is.

    Args:
        shape: the thing.
        height: of its centre over the table, m.
        pole: where the pole stands, x and y, m.
    """
    top, (x, y) = shape.half_extent[2] + 0.02, pole
    cord = Part("box", (0.003, 0.003, 0.012), (0.0, 0.0, top - 0.012))
    arm = Part("box", (0.5 * math.hypot(x, y), 0.008, 0.008), (0.5 * x, 0.5 * y, top), yaw=math.atan2(y, x))
    post = Part("box", (0.01, 0.01, 0.5 * (top + height)), (x, y, 0.5 * (top - height)))
    size = (_HALF_FOOT, _HALF_FOOT, 0.006)
    heavy = _FOOT_SHARE * sum(math.prod(part.size) for part in shape.parts) / math.prod(size)
    foot = Part("box", size, (x, y, 0.006 - height), density=heavy)
    return centred(f"hung {shape.name}", (*shape.parts, cord, arm, post, foot), (1.0 + _FOOT_SHARE) * shape.mass)


def stand_shape(radius: float, height: float) -> Shape:
    """The stand under the target."""
    return Shape(STAND, (Part("cylinder", (radius, radius, 0.5 * height)),), (radius, radius, 0.5 * height), 1.0)
