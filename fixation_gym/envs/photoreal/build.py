"""Mitsuba's scene of a model: shapes, materials, lights and camera. Mitsuba's own objects have no type stubs here."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fixation_gym.envs.photoreal.lighting import DOT_IRRADIANCE, dot_pattern, lights
from fixation_gym.envs.photoreal.materials import Material, bsdf
from fixation_gym.envs.photoreal.meshes import Mesh
from fixation_gym.types import FloatArray

_DEPTH, _SURE_DEPTH = 16, 4
"""Longest path of light, and up to where it surely goes on. Through a vessel and back it meets eight surfaces."""
PROJECTOR = "dots"
"""Name of the projector in a scene."""
_NEAR = 0.005
"""Nearest thing that the camera shows, m."""


def camera(mitsuba: Any, T_world_cam: FloatArray, fovy: float, size: tuple[int, int], samples: int) -> dict[str, Any]:
    """Description of the camera.

    Args:
        mitsuba: the module.
        T_world_cam: its pose in Mitsuba's axes, shape (4, 4).
        fovy: vertical field of view, rad.
        size: height and width of the image, px.
        samples: rays per pixel.
    """
    film = {"type": "hdrfilm", "height": size[0], "width": size[1], "rfilter": {"type": "box"}}
    return {
        "type": "perspective",
        "fov": math.degrees(fovy),
        "fov_axis": "y",
        "near_clip": _NEAR,
        "to_world": mitsuba.ScalarTransform4f(T_world_cam),
        "film": film | {"pixel_format": "rgb", "component_format": "float32"},
        "sampler": {"type": "multijitter", "sample_count": samples},
    }


def scene(
    mitsuba: Any,
    sensor: dict[str, Any],
    shapes: Mapping[str, Any],
    direction: FloatArray,
    middle: FloatArray,
    projector: Mapping[str, Any] | None = None,
) -> Any:
    """The scene.

    Args:
        mitsuba: the module.
        sensor: as from ``camera``.
        shapes: by the names that their parameters get.
        direction: in which the light shines, shape (3,), in world.
        middle: of the table top, shape (3,), in world, m.
        projector: as from ``dots``, if there is one.
    """
    light = lights(direction, middle)
    if projector is not None:
        light[PROJECTOR] = projector
    light["panel"]["to_world"] = mitsuba.ScalarTransform4f(light["panel"]["to_world"])
    integrator = {"type": "path", "max_depth": _DEPTH, "rr_depth": _SURE_DEPTH}
    return mitsuba.load_dict({"type": "scene", "integrator": integrator, "sensor": sensor, **light, **shapes})


def dots(mitsuba: Any, T_world_projector: FloatArray, fovy: float, size: tuple[int, int]) -> dict[str, Any]:
    """Description of a depth camera's projector of dots.

    Args:
        mitsuba: the module.
        T_world_projector: its pose in Mitsuba's axes, shape (4, 4).
        fovy: vertical angle that it fills, rad.
        size: height and width of the imagers' pictures, px: the pattern has their form.
    """
    image = mitsuba.Bitmap(dot_pattern(*size))
    return {
        "type": "projector",
        "irradiance": {"type": "bitmap", "bitmap": image, "raw": True},
        "scale": DOT_IRRADIANCE,
        "fov": math.degrees(fovy),
        "fov_axis": "y",
        "to_world": mitsuba.ScalarTransform4f(T_world_projector),
    }


def shape(mitsuba: Any, mesh: Mesh, material: Any) -> Any:
    """A mesh in world as a shape of Mitsuba's, of one of its materials."""
    properties = mitsuba.Properties()
    properties["bsdf"] = material
    made = mitsuba.Mesh(
        "solid", len(mesh.vertices), len(mesh.faces), properties, has_vertex_normals=True, has_vertex_texcoords=True
    )
    parameters = mitsuba.traverse(made)
    fill(parameters, "vertex_texcoords", mesh.uv)
    fill(parameters, "faces", mesh.faces)
    move(parameters, {"": mesh})
    return made


def move(parameters: Any, meshes: Mapping[str, Mesh]) -> None:
    """Set where shapes are, by the beginnings of their parameters' names."""
    for prefix, mesh in meshes.items():
        fill(parameters, f"{prefix}vertex_positions", mesh.vertices)
    parameters.update()
    for prefix, mesh in meshes.items():  # afterwards, for when vertices change Mitsuba computes normals of its own
        fill(parameters, f"{prefix}vertex_normals", mesh.normals)
    parameters.update()


def fill(parameters: Any, name: str, values: NDArray[Any]) -> None:
    """Set an array of numbers, in the type that Mitsuba's variant has for it."""
    parameters[name] = type(parameters[name])(np.ascontiguousarray(values, np.float32).ravel())


def material(mitsuba: Any, described: Material, image: FloatArray | None) -> Any:
    """A material of Mitsuba's, with its texture as linear intensities, shape (h, w, 3), or none."""
    texture = None
    if image is not None:
        texture = mitsuba.load_dict({"type": "bitmap", "bitmap": mitsuba.Bitmap(image), "raw": True})
    return mitsuba.load_dict(bsdf(described, texture))
