# pyright: reportAttributeAccessIssue=false
# (MuJoCo's functions have no type stubs.)
"""What a compiled model shows, as triangles and materials: all geoms that the wrist camera may see.

The model says all of it: a scene's things are in its geoms (``scene_loader.py``). What is see-through there is of real
glass here: boxes are solid, cylinders are vessels with a wall, balls are solid.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np
from scipy.spatial import ConvexHull

from fixation_gym.envs import scene_mjcf
from fixation_gym.envs.photoreal import meshes
from fixation_gym.envs.photoreal.materials import WATER, Finish, Material, linear
from fixation_gym.envs.photoreal.meshes import Mesh
from fixation_gym.types import FloatArray

_GROUPS = (scene_mjcf.VISIBLE_GROUP, scene_mjcf.STAND_IN_GROUP)
_WALL, _FLOOR = 0.0025, 0.006
"""Thickness of the wall and of the bottom of vessels, m."""
_LEVEL = 0.7
"""How full bottles of water are."""
_CLEAR = (1.0, 1.0, 1.0)
_FINISHES: dict[str, Finish] = {
    scene_mjcf.MIRROR_MATERIAL: "mirror",
    "cup": "glass",
    "water": "glass",
    "chrome": "chrome",
    "brushed": "brushed",
    "lacquer": "lacquer",
    "plastic": "plastic",
}
"""Finishes of the model's materials; the others are matt and may be textured."""


@dataclass(frozen=True, eq=False)
class Solid:
    """Everything of one material on one body."""

    body: int
    """Index in the model."""
    material: Material
    mesh: Mesh
    """In the body's frame."""


def solids_of(model: Any) -> list[Solid]:
    """All solids of a compiled ``mjModel`` as it is now."""
    found: dict[tuple[int, Material], list[Mesh]] = {}
    for geom in np.flatnonzero(np.isin(model.geom_group, _GROUPS)).tolist():
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
        for mesh, material in _pieces(model, geom):
            placed = mesh.placed(rotation.reshape(3, 3), model.geom_pos[geom])
            found.setdefault((int(model.geom_bodyid[geom]), material), []).append(placed)
    return [Solid(body, material, meshes.joined(parts)) for (body, material), parts in found.items()]


def _pieces(model: Any, geom: int) -> Iterator[tuple[Mesh, Material]]:
    """Surfaces of one geom in its own frame."""
    material, name = _material(model, geom), _material_name(model, geom)
    size, kind = model.geom_size[geom], mujoco.mjtGeom(model.geom_type[geom])
    if material.finish == "mirror":  # the simulator reflects on a box's +z face only
        yield meshes.box(size, meshes.TOP), material
        yield meshes.box(size, meshes.OTHERS), Material("matt", material.rgb)
    elif material.finish == "glass" and kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        yield from vessel(size[0], size[1], material, is_open=name == "cup", level=_LEVEL if name == "water" else 0.0)
    else:
        yield _surface(model, geom, kind, size), material


def _surface(model: Any, geom: int, kind: Any, size: FloatArray) -> Mesh:
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        mesh = meshes.box(size)
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        mesh = meshes.cylinder(size[0], size[1])
    elif kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        mesh = meshes.ellipsoid(np.full(3, size[0]))
    elif kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        mesh = meshes.ellipsoid(size)
    elif kind == mujoco.mjtGeom.mjGEOM_PLANE:
        mesh = meshes.box(np.array([size[0], size[1], 0.0]), meshes.TOP)
    elif kind == mujoco.mjtGeom.mjGEOM_MESH:
        return _from_file(model, model.geom_dataid[geom])
    else:
        raise ValueError(f"geom {model.geom(geom).name!r} is a {kind.name}, of which no picture is made")
    return _with_repeats(mesh, model, geom, size)


def _with_repeats(mesh: Mesh, model: Any, geom: int, size: FloatArray) -> Mesh:
    """The mesh with its texture as often as the model's material says: per face, or per metre where it is uniform."""
    index = model.geom_matid[geom]
    if index < 0:
        return mesh
    repeats = model.mat_texrepeat[index].astype(float)
    if model.mat_texuniform[index]:
        repeats = repeats * size[:2]
    return Mesh(mesh.vertices, mesh.faces, mesh.uv * repeats, mesh.normals)


def vessel(
    radius: float, half_height: float, glass: Material, *, is_open: bool, level: float
) -> list[tuple[Mesh, Material]]:
    """Surfaces of an upright vessel: to the air around it, to the air in it, and around the water in it.

    Args:
        radius: of the outer wall, m.
        half_height: m.
        glass: what it is made of.
        is_open: at the top, or closed there.
        level: how full of water it is, 0..1.
    """
    inner, bottom, top = radius - _WALL, _FLOOR - half_height, half_height - _WALL
    water = bottom + level * (top - bottom)
    outer = [(0.0, -half_height), (radius, -half_height), (radius, half_height)]
    dry = [(inner, water), (inner, half_height if is_open else top)]
    if is_open:
        outer.append((inner, half_height))
    else:
        outer.append((0.0, half_height))
        dry.append((0.0, top))
    wet = [(0.0, bottom), (inner, bottom), (inner, water)]
    if not level:
        dry = [*wet[:2], *dry[1:]]
    pieces = [(meshes.joined([meshes.vessel_of(outer), meshes.vessel_of(dry).turned_inside_out()]), glass)]
    if level:
        # Normals of the glass point into the water, those of the water's top into the air.
        pieces.append((meshes.vessel_of(wet).turned_inside_out(), replace(glass, outside=WATER)))
        pieces.append((meshes.vessel_of([(inner, water), (0.0, water)]), replace(glass, rgb=_CLEAR, inside=WATER)))
    return pieces


def _from_file(model: Any, index: int) -> Mesh:
    """Convex hull of a mesh of the model, which is what the simulator's contacts see of it, with flat faces."""
    start, count = model.mesh_vertadr[index], model.mesh_vertnum[index]
    points = model.mesh_vert[start : start + count].astype(float)
    hull = ConvexHull(points)
    triangles, outward = points[hull.simplices], hull.equations[:, :3]
    sides = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    inward = np.sum(sides * outward, axis=1) < 0.0
    triangles[inward] = triangles[inward, ::-1]
    vertices = triangles.reshape(-1, 3)
    faces = np.arange(len(vertices)).reshape(-1, 3)
    return Mesh(vertices, faces, np.zeros((len(vertices), 2)), np.repeat(outward, 3, axis=0))


def _material(model: Any, geom: int) -> Material:
    rgba, index = model.geom_rgba[geom], model.geom_matid[geom]
    if index < 0:
        return Material("glass" if rgba[3] < 1.0 else "gloss", _rgb(rgba))
    rgb = _rgb(model.mat_rgba[index] if np.allclose(rgba, scene_mjcf.UNSET_RGBA) else rgba)
    finish = _FINISHES.get(_material_name(model, geom))
    if finish is not None:
        return Material(finish, rgb)
    return Material("matt", rgb, int(model.mat_texid[index, mujoco.mjtTextureRole.mjTEXROLE_RGB]))


def _material_name(model: Any, geom: int) -> str:
    index = model.geom_matid[geom]
    return "" if index < 0 else model.mat(index).name


def _rgb(rgba: FloatArray) -> tuple[float, float, float]:
    red, green, blue = (round(float(value), 6) for value in rgba[:3])
    return red, green, blue


def texture_image(model: Any, material: Material) -> FloatArray:
    """The tinted texture of a material in linear intensities, shape (h, w, 3), float32, top row first."""
    index = material.texture
    width, channels = int(model.tex_width[index]), int(model.tex_nchannel[index])
    start = int(model.tex_adr[index])
    pixels = model.tex_data[start : start + width * width * channels].reshape(width, width, channels)  # a cube's first
    return linear(pixels[..., :3] / 255.0 * material.rgb).astype(np.float32)
