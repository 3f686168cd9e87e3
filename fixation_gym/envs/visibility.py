"""What the camera sees of target and obstacles at the start, by lines of sight through boxes."""

from __future__ import annotations

import math

import numpy as np

from fixation_gym.compiled import compiled
from fixation_gym.envs.drafts import Drafts
from fixation_gym.envs.object_pool import target_shape
from fixation_gym.envs.part_rows import PITCH, YAW
from fixation_gym.envs.scene import ObstacleSpec, TargetSpec
from fixation_gym.envs.shapes import SEE_THROUGH
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


@compiled
def pass_through(drafts: Drafts, camera: FloatArray, point: FloatArray) -> MaskArray:
    """Which drafts have the line from camera to point pass through the inner part of the box around them."""
    through = np.zeros(len(drafts.kinds), np.bool_)
    for index in range(len(through)):
        middle, half = _box_around(drafts.rows[drafts.ends[index] : drafts.ends[index + 1]])
        c, s = math.cos(drafts.facings[index]), math.sin(drafts.facings[index])
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        centre = drafts.origins[index].copy()
        centre[0] += c * middle[0] - s * middle[1]
        centre[1] += s * middle[0] + c * middle[1]
        centre[2] += half[2]
        through[index] = _crossed(camera, point.reshape(1, 3), centre, turn, 0.85 * half)[0]
    return through


@compiled
def _box_around(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Middle and half sizes of the box around parts, along the axes of their frame."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for row in rows:
        cy, sy, cp, sp = (
            abs(math.cos(row[YAW])),
            abs(math.sin(row[YAW])),
            abs(math.cos(row[PITCH])),
            abs(math.sin(row[PITCH])),
        )
        reach = (
            cy * cp * row[3] + sy * row[4] + cy * sp * row[5],
            sy * cp * row[3] + cy * row[4] + sy * sp * row[5],
            sp * row[3] + cp * row[5],
        )
        for axis in range(3):
            low[axis], high[axis] = min(low[axis], row[axis] - reach[axis]), max(high[axis], row[axis] + reach[axis])
    return 0.5 * (low + high), 0.5 * (high - low)


def _hidden(camera: FloatArray, points: FloatArray, obstacles: list[ObstacleSpec]) -> MaskArray:
    """Points, shape (n, 3), whose line of sight meets something that is not clear glass."""
    hidden = np.zeros(len(points), dtype=bool)
    for obstacle in obstacles:
        boxes = obstacle.shape.boxes(obstacle.position, obstacle.yaw)
        for part, centre, rotation, half in zip(obstacle.shape.parts, *boxes, strict=True):
            if part.finish not in SEE_THROUGH or obstacle.rgba[3] > _CLEAR:
                hidden |= _crossed(camera, points, centre, rotation, half)
    return hidden


@compiled
def _crossed(
    camera: FloatArray, points: FloatArray, centre: FloatArray, rotation: FloatArray, half: FloatArray
) -> MaskArray:
    """Which of the segments from the camera to points, shape (n, 3), meet a box."""
    crossed = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        enter, leave = -np.inf, np.inf
        for axis in range(3):
            begin = end = 0.0
            for k in range(3):
                begin += (camera[k] - centre[k]) * rotation[k, axis]
                end += (points[i, k] - centre[k]) * rotation[k, axis]
            along = end - begin
            if abs(along) < 1e-12:
                along = 1e-12
            near, far = (-half[axis] - begin) / along, (half[axis] - begin) / along
            enter, leave = max(enter, min(near, far)), min(leave, max(near, far))
        crossed[i] = enter <= leave and leave >= 0.0 and enter <= 0.999
    return crossed
