"""Shapes of targets and obstacles, built of primitives.

Every shape lives in the compiled model from the start; a scene shows, scales and recolours the ones it needs. Lengths
are half sizes in m at scale 1, which is the largest scale a scene may use. A shape's origin is the centre of its
bounding box; +z is up, and a panel or mirror faces +x.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Vector = tuple[float, float, float]
Primitive = Literal["box", "cylinder", "sphere", "ellipsoid"]
Finish = Literal["solid", "glass", "rim", "label", "mirror"]


@dataclass(frozen=True)
class Part:
    """One primitive of a shape."""

    primitive: Primitive
    size: Vector
    """Half sizes along x, y, z; a cylinder is (radius, radius, half height)."""
    pos: Vector = (0.0, 0.0, 0.0)
    yaw: float = 0.0
    """Rotation about z, rad."""
    pitch: float = 0.0
    """Rotation about y before ``yaw``, rad."""
    finish: Finish = "solid"


@dataclass(frozen=True)
class Shape:
    """A rigid object: its parts, bounding box and mass."""

    name: str
    parts: tuple[Part, ...]
    half_extent: Vector
    """Half bounding box at scale 1, m."""
    mass: float
    """Mass at scale 1, kg."""


def _ring(radius: float, half_height: float, thickness: float, segments: int) -> tuple[Part, ...]:
    """Upright hollow cylinder of outer ``radius`` made of boxes."""
    middle = radius - thickness
    half_chord = middle * math.tan(math.pi / segments) + 0.3 * thickness
    angles = [2.0 * math.pi * i / segments for i in range(segments)]
    return tuple(
        Part("box", (thickness, half_chord, half_height), (middle * math.cos(a), middle * math.sin(a), 0.0), yaw=a)
        for a in angles
    )


def _cage(half_x: float, half_y: float, half_z: float, bar: float) -> tuple[Part, ...]:
    """The twelve edges of a box as thin bars."""
    signs = [(a, b) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    x, y, z = half_x - bar, half_y - bar, half_z - bar
    along_x = tuple(Part("box", (half_x, bar, bar), (0.0, a * y, b * z), finish="rim") for a, b in signs)
    along_y = tuple(Part("box", (bar, half_y, bar), (a * x, 0.0, b * z), finish="rim") for a, b in signs)
    along_z = tuple(Part("box", (bar, bar, half_z), (a * x, b * y, 0.0), finish="rim") for a, b in signs)
    return along_x + along_y + along_z


def _framed_panel(half_y: float, half_z: float, face: Part) -> tuple[Part, ...]:
    """A standing panel with a rim around it and a foot wide enough not to topple."""
    bar = 0.006
    return (
        face,
        Part("box", (0.006, bar, half_z), (0.0, half_y - bar, 0.0), finish="rim"),
        Part("box", (0.006, bar, half_z), (0.0, bar - half_y, 0.0), finish="rim"),
        Part("box", (0.006, half_y, bar), (0.0, 0.0, half_z - bar), finish="rim"),
        Part("box", (0.035, half_y, bar), (0.0, 0.0, bar - half_z), finish="rim"),
    )


def _glass_screen(name: str, half_y: float, half_z: float) -> Shape:
    """A pane whose foot is all behind it, so that it can stand close to something."""
    bar, half_x = 0.006, 0.035
    front = half_x - bar
    parts = (
        Part("box", (0.003, half_y - bar, half_z - bar), (front, 0.0, 0.0), finish="glass"),
        Part("box", (bar, bar, half_z), (front, half_y - bar, 0.0), finish="rim"),
        Part("box", (bar, bar, half_z), (front, bar - half_y, 0.0), finish="rim"),
        Part("box", (bar, half_y, bar), (front, 0.0, half_z - bar), finish="rim"),
        Part("box", (half_x, half_y, bar), (0.0, 0.0, bar - half_z), finish="rim"),
    )
    return Shape(name, parts, (half_x, half_y, half_z), 0.8)


TARGET_SHAPES: tuple[Shape, ...] = (
    Shape("box", (Part("box", (0.035, 0.035, 0.035)),), (0.035, 0.035, 0.035), 0.15),
    Shape("cylinder", (Part("cylinder", (0.035, 0.035, 0.04)),), (0.035, 0.035, 0.04), 0.15),
    Shape("ball", (Part("sphere", (0.035, 0.035, 0.035)),), (0.035, 0.035, 0.035), 0.12),
    Shape("ring", _ring(0.035, 0.035, 0.004, 12), (0.035, 0.035, 0.035), 0.10),
    Shape(
        "duck",
        (
            Part("ellipsoid", (0.045, 0.035, 0.026), (-0.005, 0.0, -0.012)),
            Part("sphere", (0.020, 0.020, 0.020), (0.020, 0.0, 0.022)),
            Part("ellipsoid", (0.012, 0.009, 0.005), (0.040, 0.0, 0.018)),
            Part("ellipsoid", (0.014, 0.010, 0.010), (-0.042, 0.0, 0.000), pitch=0.5),
            # A flat foot so that it stands: an ellipsoid alone rolls.
            Part("box", (0.022, 0.018, 0.008), (-0.005, 0.0, -0.034)),
        ),
        (0.055, 0.035, 0.042),
        0.12,
    ),
)

OBSTACLE_SHAPES: dict[str, tuple[Shape, ...]] = {
    "opaque": (
        Shape("block", (Part("box", (0.030, 0.045, 0.100)),), (0.030, 0.045, 0.100), 0.6),
        Shape("post", (Part("cylinder", (0.030, 0.030, 0.110)),), (0.030, 0.030, 0.110), 0.6),
        Shape("brick", (Part("box", (0.035, 0.070, 0.070)),), (0.035, 0.070, 0.070), 0.8),
    ),
    "translucent": (
        Shape(
            "bottle",
            (
                Part("cylinder", (0.033, 0.033, 0.075), (0.0, 0.0, -0.030), finish="glass"),
                Part("cylinder", (0.013, 0.013, 0.025), (0.0, 0.0, 0.070), finish="glass"),
                Part("cylinder", (0.015, 0.015, 0.008), (0.0, 0.0, 0.097), finish="rim"),
                Part("cylinder", (0.0335, 0.0335, 0.022), (0.0, 0.0, -0.030), finish="label"),
            ),
            (0.033, 0.033, 0.105),
            0.5,
        ),
        Shape(
            "tumbler",
            (
                Part("cylinder", (0.040, 0.040, 0.065), finish="glass"),
                Part("cylinder", (0.0405, 0.0405, 0.004), (0.0, 0.0, 0.063), finish="rim"),
                Part("cylinder", (0.0405, 0.0405, 0.006), (0.0, 0.0, -0.061), finish="rim"),
            ),
            (0.040, 0.040, 0.067),
            0.4,
        ),
        Shape(
            "panel",
            _framed_panel(0.075, 0.090, Part("box", (0.003, 0.069, 0.084), finish="glass")),
            (0.035, 0.075, 0.090),
            0.6,
        ),
    ),
    "mirror": (
        Shape(
            "mirror",
            # MuJoCo draws the reflection on a box's local +z face; pitch turns it to the shape's +x.
            _framed_panel(0.075, 0.100, Part("box", (0.094, 0.069, 0.004), pitch=math.pi / 2, finish="mirror")),
            (0.035, 0.075, 0.100),
            0.7,
        ),
    ),
    "wire": (Shape("cage", _cage(0.055, 0.065, 0.090, 0.003), (0.055, 0.065, 0.090), 0.5),),
    "screen": (_glass_screen("high", 0.130, 0.120), _glass_screen("low", 0.130, 0.060)),
}
OBSTACLE_KINDS = tuple(kind for kind in OBSTACLE_SHAPES if kind != "screen")
"""Kinds that may stand anywhere; a screen stands close to the target, alone."""
MAX_OBSTACLES = 4


def target_shape(name: str) -> Shape:
    """The target shape of that name."""
    return next(shape for shape in TARGET_SHAPES if shape.name == name)


def obstacle_shape(kind: str, name: str) -> Shape:
    """The obstacle shape of that kind and name."""
    return next(shape for shape in OBSTACLE_SHAPES[kind] if shape.name == name)
