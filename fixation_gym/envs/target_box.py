"""Which thing is the target: a box around it in the first picture, as a person would draw it."""

from __future__ import annotations

import math

import numpy as np

from fixation_gym.envs.lens import bent_box
from fixation_gym.envs.object_pool import target_shape
from fixation_gym.envs.scene import TargetSpec
from fixation_gym.envs.shapes import Part
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import inverse, transform
from fixation_gym.types import FloatArray


def target_box(target: TargetSpec, T_base_cam: FloatArray, intrinsics: Intrinsics) -> FloatArray:
    """Box around all of the target in a picture, also where something stands in front of it.

    Args:
        target: what is seen, where it stands at reset.
        T_base_cam: camera pose, shape (4, 4).
        intrinsics: of the picture.

    Returns:
        x, y of the top-left corner, width and height, shape (4,), px of whole pixels within the picture, as its lens
        shows it; all 0 if the target is not in it.
    """
    points = transform(inverse(T_base_cam), _surface(target))
    pixels = intrinsics.project(points[points[:, 2] > 0.01])
    if not len(pixels):
        return np.zeros(4)
    size = np.array([intrinsics.width, intrinsics.height])
    low = np.clip(np.floor(pixels.min(axis=0) + 0.5), 0, size)
    high = np.clip(np.floor(pixels.max(axis=0) + 0.5) + 1, 0, size)
    return bent_box(np.concatenate([low, high - low]), intrinsics) if np.all(high > low) else np.zeros(4)


def target_sight(T_base_cam: FloatArray, centre: FloatArray, intrinsics: Intrinsics) -> tuple[float, float]:
    """Depth of the target's centre, shape (3,) in base, m, and its offset from the optical axis, px; NaN behind it."""
    x, y, z = (T_base_cam[:3, :3].T @ (centre - T_base_cam[:3, 3])).tolist()
    return z, math.hypot(intrinsics.fx * x / z, intrinsics.fy * y / z) if z > 0.0 else math.nan


def _surface(target: TargetSpec) -> FloatArray:
    """Points on the surface of the target, shape (n, 3), in base, m."""
    scale = np.array(target.scale)
    points = np.concatenate([_part_surface(part) for part in target_shape(target.shape).parts]) * scale
    c, s = math.cos(target.yaw), math.sin(target.yaw)
    return points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) + target.position


def _part_surface(part: Part) -> FloatArray:
    """Points on the surface of a part, shape (n, 3), in the frame of its shape, m."""
    unit = {"box": _CORNERS, "cylinder": _RIMS}.get(part.primitive, _SPHERE)
    return unit * np.array(part.size) @ part.rotation.T + part.pos


_ANGLES = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=-1)
_RIMS = np.concatenate([np.column_stack([_CIRCLE, np.full(len(_CIRCLE), z)]) for z in (-1.0, 1.0)])
_SPHERE = np.concatenate(
    [
        np.column_stack([math.cos(up) * _CIRCLE, np.full(len(_CIRCLE), math.sin(up))])
        for up in np.linspace(-1.57, 1.57, 25)
    ]
)
