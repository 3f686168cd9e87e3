"""Rigid shapes as values: parts, which are primitives, and what follows from them. Lengths are half sizes in m.

A shape's origin is the centre of its bounding box; +z is up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from fixation_gym.geometry.boxes import BoxSet, rotations
from fixation_gym.types import FloatArray, Vector

Primitive = Literal["box", "cylinder", "sphere", "ellipsoid"]
Finish = Literal["solid", "glass", "rim", "label", "mirror", "cup", "water", "chrome", "brushed", "lacquer", "plastic"]
PRIMITIVES: tuple[Primitive, ...] = get_args(Primitive)
FINISHES: tuple[Finish, ...] = get_args(Finish)
SEE_THROUGH = ("glass", "cup")
"""Finishes through which the target may be seen; what is behind a bottle of water or thin plastic is not known."""
PLAIN_MATERIALS = ("opaque", "translucent", "mirror", "wire")
"""What obstacles are made of: wood, bricks or metal; glass with rims; a framed mirror; bars."""
MATERIALS = (*PLAIN_MATERIALS, "glass", "chrome", "lacquer", "plastic")
"""Also: thick glass without rims; polished and brushed metal; glossy paint; thin, cloudy plastic. Their pictures are
right in ``renderer="mitsuba"`` only."""


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
    density: float = 1.0
    """Relative to the other parts of the shape: a heavy foot keeps what leans over from toppling."""

    @property
    def rotation(self) -> FloatArray:
        """Rotation of the part's axes in the shape's, shape (3, 3)."""
        return rotations(np.array([self.yaw]), np.array([self.pitch]))[0]


@dataclass(frozen=True)
class Shape:
    """A rigid object: its parts, bounding box and mass."""

    name: str
    parts: tuple[Part, ...]
    half_extent: Vector
    """Half bounding box, m."""
    mass: float
    """kg."""

    def boxes(self, position: Vector, yaw: float) -> BoxSet:
        """Boxes around all its parts for a shape at ``position``, turned by ``yaw`` about the vertical, in base."""
        return placed_boxes(self.parts, position, yaw)


def placed_boxes(parts: tuple[Part, ...], origin: Vector, yaw: float) -> BoxSet:
    """Boxes around parts whose frame is at ``origin`` in base, turned by ``yaw`` about the vertical."""
    values = np.array([(*part.pos, *part.size, part.yaw + yaw, part.pitch) for part in parts])
    c, s = math.cos(yaw), math.sin(yaw)
    centres = values[:, :3] @ np.array([(c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)]) + origin
    return BoxSet(centres, rotations(values[:, 6], values[:, 7]), values[:, 3:6])


def centred(name: str, parts: tuple[Part, ...], mass: float) -> tuple[Shape, Vector]:
    """A shape of parts given in any frame, and where its origin, the centre of its bounding box, is in that frame."""
    values = np.array([(*part.pos, *part.size, part.yaw, part.pitch) for part in parts])
    reach = np.einsum("nij,nj->ni", np.abs(rotations(values[:, 6], values[:, 7])), values[:, 3:6])
    low, high = (values[:, :3] - reach).min(axis=0), (values[:, :3] + reach).max(axis=0)
    origin, half = 0.5 * (low + high), 0.5 * (high - low)
    places = (values[:, :3] - origin).tolist()
    moved = tuple(_placed(part, (x, y, z)) for part, (x, y, z) in zip(parts, places, strict=True))
    return Shape(name, moved, _vector(half), mass), _vector(origin)


def _placed(part: Part, pos: Vector) -> Part:
    """The part elsewhere; quicker than ``dataclasses.replace``."""
    return Part(part.primitive, part.size, pos, part.yaw, part.pitch, part.finish, part.density)


def scaled(shape: Shape, factor: float) -> Shape:
    """The shape with all lengths multiplied by ``factor``, of the same density."""
    parts = tuple(
        replace(part, size=_vector(np.array(part.size) * factor), pos=_vector(np.array(part.pos) * factor))
        for part in shape.parts
    )
    return Shape(shape.name, parts, _vector(np.array(shape.half_extent) * factor), shape.mass * factor**3)


def without(shape: Shape, finish: Finish) -> Shape:
    """The shape without the parts of one finish, as a bottle without its label."""
    return replace(shape, parts=tuple(part for part in shape.parts if part.finish != finish))


def _vector(values: FloatArray) -> Vector:
    return (float(values[0]), float(values[1]), float(values[2]))


# -- what is made of several parts -----------------------------------------------------------------------------------


def ring(radius: float, half_height: float, thickness: float, segments: int) -> tuple[Part, ...]:
    """Upright hollow cylinder of outer ``radius`` made of boxes."""
    middle = radius - thickness
    half_chord = middle * math.tan(math.pi / segments) + 0.3 * thickness
    angles = [2.0 * math.pi * i / segments for i in range(segments)]
    return tuple(
        Part("box", (thickness, half_chord, half_height), (middle * math.cos(a), middle * math.sin(a), 0.0), yaw=a)
        for a in angles
    )


def cage(half_x: float, half_y: float, half_z: float, bar: float) -> tuple[Part, ...]:
    """The twelve edges of a box as thin bars."""
    signs = [(a, b) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    x, y, z = half_x - bar, half_y - bar, half_z - bar
    along_x = tuple(Part("box", (half_x, bar, bar), (0.0, a * y, b * z), finish="rim") for a, b in signs)
    along_y = tuple(Part("box", (bar, half_y, bar), (a * x, 0.0, b * z), finish="rim") for a, b in signs)
    along_z = tuple(Part("box", (bar, bar, half_z), (a * x, b * y, 0.0), finish="rim") for a, b in signs)
    return along_x + along_y + along_z
