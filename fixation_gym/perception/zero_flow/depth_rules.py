"""Front rules that measure depth and compare: rivals of the zero-flow test, behind the same door.

``depth_rule`` takes what a depth camera says, ``motion_stereo`` dense flow that is triangulated with the known poses,
``plane_parallax`` calls whatever moves unlike the table an obstacle. None of them knows what moves by itself.
"""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
from scipy.special import ndtr

from fixation_gym.geometry.rigid import inverse
from fixation_gym.perception.scratch import Float32Array
from fixation_gym.perception.zero_flow.front_rule import FrontQuestion
from fixation_gym.perception.zero_flow.pixel_answers import PixelAnswers, PixelQuestion
from fixation_gym.types import MaskArray

_BASELINE_M, _DISPARITY_STD_PX = 0.05, 0.3
"""Of the depth camera: distance of its imagers, m, and noise of its disparities, px of its picture."""
_FLOW_STD_PX = 0.08
"""Noise of dense flow along each axis, px of the frames."""
_AGREE_PX = 1.0
"""Where a point misses its two epipolar lines by more than this, the flow is wrong or the thing moves: no evidence."""
_BELOW_TABLE = 2.0
"""What seems to be below the table by so many margins moves unlike it, too: the table counts with its tolerance."""


def depth_rule(asked: FrontQuestion) -> PixelAnswers:
    """What a depth camera says is nearer than the fixated object and above the table.

    Raises:
        ValueError: if there is no depth camera.
    """
    if asked.pictures is None or asked.pictures.depth is None:
        raise ValueError("depth_rule needs what a depth camera measured: make the environment with depth_camera=True")
    depth, shape, camera = asked.pictures.depth, asked.usable.shape, asked.flow.frame_intrinsics
    rows, columns = (_centres(length, count) for length, count in zip(depth.shape, shape, strict=True))
    inverse_depth = np.reciprocal(depth[np.ix_(rows, columns)].astype(np.float32))
    focal = camera.fx * depth.shape[1] / camera.width
    std = np.full(shape, _DISPARITY_STD_PX / (focal * _BASELINE_M), np.float32)
    return measured_answers(inverse_depth, std, asked.usable, asked.exact)


def motion_stereo(asked: FrontQuestion) -> PixelAnswers:
    """What dense flow between the pictures, triangulated with their poses, says is nearer and above the table.

    Raises:
        ValueError: without pictures.
    """
    return measured_answers(*_triangulated(asked), asked.usable, asked.exact)


def plane_parallax(asked: FrontQuestion) -> PixelAnswers:
    """Whatever moves unlike the table is an obstacle, be it nearer than the fixated object or not.

    How far it is, which the memory needs, is triangulated. Without a table nothing has evidence.

    Raises:
        ValueError: without pictures.
    """
    inverse_depth, std = _triangulated(asked)
    answers = measured_answers(inverse_depth, std, asked.usable, asked.exact)
    table = _surface(asked.exact)
    with np.errstate(invalid="ignore"):
        above, below = inverse_depth - table, (1.0 - _BELOW_TABLE * asked.margin) * table - inverse_depth
        unlike = ndtr(np.maximum(above, below) / std).astype(np.float32)
    supported = answers.supported & np.isfinite(table)
    return answers._replace(p_nearer=np.where(supported, unlike, np.float32(0.5)), supported=supported)


def measured_answers(
    inverse_depth: Float32Array, std: Float32Array, usable: MaskArray, question: PixelQuestion
) -> PixelAnswers:
    """The test of measured inverse depths against fixated object and table, as ``pixel_answers`` makes it.

    Args:
        inverse_depth: of every pixel, shape (h, w), 1/m; not finite where nothing was measured.
        std: their standard deviations, shape (h, w), 1/m.
        usable: pixels that may have evidence, shape (h, w).
        question: what to test against.
    """
    known = usable & np.isfinite(inverse_depth) & (std < question.max_std)
    table = _surface(question)
    extra = np.where(table <= question.boundary, question.boundary_variance, np.float32(0.0))
    with np.errstate(invalid="ignore"):
        z = (inverse_depth - np.maximum(table, question.boundary)) / np.sqrt(std * std + extra)
    return PixelAnswers(
        inverse_depth=np.where(known, inverse_depth, np.float32(np.nan)).astype(np.float32),
        inverse_depth_std=std.astype(np.float32),
        p_nearer=np.where(known, ndtr(z), 0.5).astype(np.float32),
        supported=known,
        moving=np.zeros(usable.shape, np.bool_),
    )


def _surface(question: PixelQuestion) -> Float32Array:
    """Inverse depth of the table along every ray, shape (h, w), 1/m; -inf without one."""
    return question.surface_rows[:, None] + question.surface_columns


def _triangulated(asked: FrontQuestion) -> tuple[Float32Array, Float32Array]:
    """Inverse depth on the grid, shape (h, w), and its standard deviation, by least squares over both outer pictures.

    A point x + u in another picture with pose R, t fulfils (x + u) x (R x + d t) = 0, which is linear in d.
    """
    flow, question, pictures = asked.flow, asked.exact, asked.pictures
    if pictures is None:
        raise ValueError("motion_stereo and plane_parallax need the pictures that the flow was made of")
    first, middle, last = (np.rint(np.clip(grey, 0.0, 255.0)).astype(np.uint8) for grey in pictures.grey)
    grid = flow.intrinsics
    x, y = (axis.astype(np.float32) for axis in grid.grid)
    rays = np.stack([x, y, np.ones_like(x)], axis=-1)
    scale = np.array([1.0 / flow.frame_intrinsics.fx, 1.0 / flow.frame_intrinsics.fy], np.float32)
    slopes, offsets = [], []
    for outer, T_base_outer in ((first, pictures.T_base_cam[0]), (last, pictures.T_base_cam[2])):
        moved = _dense_flow().calc(middle, outer, None)  # pyright: ignore[reportCallIssue, reportArgumentType]
        motion = cv2.resize(moved, (grid.width, grid.height), interpolation=cv2.INTER_AREA)
        T_outer_middle = (inverse(T_base_outer) @ pictures.T_base_cam[1]).astype(np.float32)
        turned, shift = rays @ T_outer_middle[:3, :3].T, T_outer_middle[:3, 3]
        for axis in range(2):
            there = rays[..., axis] + motion[..., axis] * scale[axis]
            slopes.append(shift[axis] - there * shift[2])
            offsets.append(there * turned[..., 2] - turned[..., axis])
    a, b = np.stack(slopes), np.stack(offsets)
    information = np.maximum((a * a).sum(axis=0), np.float32(1e-12))
    inverse_depth = (a * b).sum(axis=0) / information
    miss = np.sqrt(np.square(a * inverse_depth - b).mean(axis=0)) / scale[0]
    # The question's noise is that of motion over two intervals; here each picture is one interval away.
    poses = 4.0 * (question.rotation_noise + question.position_noise * asked.fixated**2) / grid.fx**2
    std = np.sqrt((np.square(_FLOW_STD_PX * scale[0]) + np.float32(poses)) / information)
    return np.where(miss < _AGREE_PX, inverse_depth, np.float32(np.nan)), std


def _centres(length: int, count: int) -> np.ndarray:
    """Indices of ``count`` evenly spaced pixels of ``length``."""
    return ((np.arange(count) + 0.5) * (length / count)).astype(int)


@lru_cache(maxsize=1)
def _dense_flow() -> cv2.DISOpticalFlow:
    """Dense inverse search (Kroeger et al. 2016), from OpenCV."""
    dense = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    dense.setFinestScale(0)  # the preset stops at half the resolution; between frames things move by a pixel or less
    return dense
