"""Triangles of the primitives that scenes are made of, in their own frames, as arrays. Lengths in m."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fixation_gym.types import FloatArray

_AROUND = 64
"""Corners of what is round. Their chords stay within 0.05 mm of a circle of 4 cm."""
_BETWEEN_POLES = 32
_LEAST_AREA = 1e-15
"""Twice the area of faces that are none, m^2."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles whose corners run counter-clockwise, seen from where their normals point."""

    vertices: FloatArray
    """Shape (n, 3)."""
    faces: NDArray[np.int64]
    """Indices of corners, shape (m, 3)."""
    uv: FloatArray
    """Place in a texture of every vertex, shape (n, 2), (0, 0) at its lower left corner."""
    normals: FloatArray
    """Unit normals of the smooth surface at the vertices, shape (n, 3)."""

    def placed(self, rotation: FloatArray, position: FloatArray) -> Mesh:
        """The mesh turned by ``rotation``, (3, 3), and then moved by ``position``, (3,)."""
        return Mesh(self.vertices @ rotation.T + position, self.faces, self.uv, self.normals @ rotation.T)

    def turned_inside_out(self) -> Mesh:
        """The same surface, seen from the other side."""
        return Mesh(self.vertices, self.faces[:, ::-1], self.uv, -self.normals)


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """All of them as one."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]),
        np.concatenate([mesh.uv for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
    )


_SQUARE = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
_SIDES = tuple((axis, sign) for axis in range(3) for sign in (1.0, -1.0))
TOP = (4,)
"""The face of a box that looks along +z, as ``box`` counts them."""
OTHERS = (0, 1, 2, 3, 5)


def box(half: FloatArray, sides: Sequence[int] = range(6)) -> Mesh:
    """Faces of a box with half sizes ``half``: +x, -x, +y, -y, +z, -z; each shows a whole texture."""
    return joined([_side(half, *_SIDES[side]) for side in sides])


def _side(half: FloatArray, axis: int, sign: float) -> Mesh:
    first, second = (axis + 1) % 3, (axis + 2) % 3
    vertices = np.zeros((4, 3))
    vertices[:, axis] = sign * half[axis]
    vertices[:, first], vertices[:, second] = sign * _SQUARE[:, 0] * half[first], _SQUARE[:, 1] * half[second]
    normals = np.zeros((4, 3))
    normals[:, axis] = sign
    return Mesh(vertices, np.array([(0, 1, 2), (0, 2, 3)]), 0.5 + 0.5 * _SQUARE, normals)


def ellipsoid(half: FloatArray) -> Mesh:
    """An ellipsoid with half axes ``half``."""
    latitudes = np.linspace(-0.5 * math.pi, 0.5 * math.pi, _BETWEEN_POLES + 1)
    profile = np.stack([np.cos(latitudes), np.sin(latitudes)], axis=1)
    profile[[0, -1], 0] = 0.0
    ball = turned_on_lathe(profile, profile)
    normals = ball.normals / half
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Mesh(ball.vertices * half, ball.faces, ball.uv, normals)


def cylinder(radius: float, half_height: float) -> Mesh:
    """An upright cylinder with both of its ends."""
    return vessel_of(((0.0, -half_height), (radius, -half_height), (radius, half_height), (0.0, half_height)))


def vessel_of(corners: Sequence[tuple[float, float]]) -> Mesh:
    """What is turned on a lathe along straight lines between corners (radius, z), with sharp edges.

    Going along the corners, the surface looks to the right: from bottom to top, outwards.
    """
    pieces = []
    for (r0, z0), (r1, z1) in pairwise(corners):
        length = math.hypot(r1 - r0, z1 - z0)
        normal = np.array([(z1 - z0) / length, (r0 - r1) / length])
        pieces.append(turned_on_lathe(np.array([(r0, z0), (r1, z1)]), np.array([normal, normal])))
    return joined(pieces)


def turned_on_lathe(profile: FloatArray, normals: FloatArray) -> Mesh:
    """The surface that a line sweeps when it is turned about z.

    Args:
        profile: points (radius, z) of the line, shape (n, 2).
        normals: of the surface at these points, in the same plane, shape (n, 2), pointing to the right of the line.
    """
    angles = np.linspace(0.0, 2.0 * math.pi, _AROUND + 1)
    cosines, sines = np.cos(angles), np.sin(angles)

    def swept(line: FloatArray) -> FloatArray:
        across, along = line[:, :1], np.broadcast_to(line[:, 1:], (len(line), len(angles)))
        return np.stack([across * cosines, across * sines, along], axis=-1).reshape(-1, 3)

    rows, columns = np.meshgrid(np.arange(len(profile) - 1), np.arange(_AROUND), indexing="ij")
    lower = (rows * (_AROUND + 1) + columns).ravel()
    upper = lower + _AROUND + 1
    faces = np.concatenate([np.stack([lower, lower + 1, upper + 1], 1), np.stack([lower, upper + 1, upper], 1)])
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(profile, axis=0), axis=1))])
    u = np.broadcast_to(4.0 * angles / (2.0 * math.pi), (len(profile), len(angles)))
    v = np.broadcast_to((lengths / lengths[-1])[:, None], u.shape)
    uv = np.stack([u, v], axis=-1).reshape(-1, 2)
    return _without_empty_faces(Mesh(swept(profile), faces, uv, swept(normals)))


def _without_empty_faces(mesh: Mesh) -> Mesh:
    """The mesh without faces that have two corners in one place, as at a pole, and without vertices of no face."""
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    faces = mesh.faces[np.linalg.norm(np.cross(b - a, c - a), axis=1) > _LEAST_AREA]
    used, corners = np.unique(faces, return_inverse=True)
    return Mesh(mesh.vertices[used], corners.reshape(-1, 3), mesh.uv[used], mesh.normals[used])
