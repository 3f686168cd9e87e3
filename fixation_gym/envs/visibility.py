"""What the camera sees of target and obstacles at the start, by lines of sight through boxes."""

from __future__ import annotations

import math

import numpy as np

from fixation_gym.envs.object_pool import target_shape
from fixation_gym.envs.scene import ObstacleSpec, TargetSpec
from fixation_gym.geometry.boxes import Box
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, MaskArray

_CLEAR = 0.45
"""Opacity up to which glass leaves the target its colour."""
_ASPECT = 4.0 / 3.0
"""Width of the wrist image by its height."""


def visible_share(camera: FloatArray, target: TargetSpec, obstacles: list[ObstacleSpec]) -> float:
    """Share of the target's box that is in view past all that is not clear glass, 0..1."""
    half = np.array(target_shape(target.shape).half_extent) * target.scale
    steps = np.array([(x, y, z) for x in (-0.7, 0.0, 0.7) for y in (-0.7, 0.0, 0.7) for z in (-0.6, 0.6)])
    points = target.box.centre + (steps * half) @ target.box.rotation.T
    return float(np.mean(~_hidden(camera, points, obstacles)))


def is_seen(obstacle: ObstacleSpec, T_base_cam: FloatArray, others: list[ObstacleSpec]) -> bool:
    """Whether more than a corner of an obstacle is within the image and not behind the others."""
    boxes = obstacle.shape.boxes(obstacle.position, obstacle.yaw)
    corners = np.array([(x, y, z) for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0) for z in (-1.0, 0.0, 1.0)])
    points = boxes.centres[:, None] + np.einsum("nij,nkj->nki", boxes.rotations, corners * boxes.halves[:, None])
    points = points.reshape(-1, 3)
    local = (points - T_base_cam[:3, 3]) @ T_base_cam[:3, :3]
    tangent = math.tan(ROBOT.camera.fovy / 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        inside = (local[:, 2] > 0.05) & (np.abs(local[:, 1]) < tangent * local[:, 2])
        inside &= np.abs(local[:, 0]) < _ASPECT * tangent * local[:, 2]
    seen = inside & ~_hidden(T_base_cam[:3, 3], points, others)
    return bool(seen.mean() > 0.15)


def passes_through(box: Box, camera: FloatArray, point: FloatArray) -> bool:
    """Whether the line from camera to point passes through the inner part of a box."""
    return bool(_crossed(camera, point[None], box.centre, box.rotation, 0.85 * box.half_extent)[0])


def _hidden(camera: FloatArray, points: FloatArray, obstacles: list[ObstacleSpec]) -> MaskArray:
    """Points, shape (n, 3), whose line of sight meets something that is not clear glass."""
    hidden = np.zeros(len(points), dtype=bool)
    for obstacle in obstacles:
        boxes = obstacle.shape.boxes(obstacle.position, obstacle.yaw)
        for part, centre, rotation, half in zip(obstacle.shape.parts, *boxes, strict=True):
            if part.finish != "glass" or obstacle.rgba[3] > _CLEAR:
                hidden |= _crossed(camera, points, centre, rotation, half)
    return hidden


def _crossed(
    camera: FloatArray, points: FloatArray, centre: FloatArray, rotation: FloatArray, half: FloatArray
) -> MaskArray:
    """Which of the segments from the camera to points, shape (n, 3), meet a box."""
    begin, ends = (camera - centre) @ rotation, (points - centre) @ rotation
    along = ends - begin
    along = np.where(np.abs(along) < 1e-12, 1e-12, along)
    near, far = (-half - begin) / along, (half - begin) / along
    enter, leave = np.minimum(near, far).max(axis=1), np.maximum(near, far).min(axis=1)
    return (enter <= leave) & (leave >= 0.0) & (enter <= 0.999)
