"""Optic flow at random points on the edges of the target, by three estimators, from three cut-outs of the image.

``gradient`` is the project's gradient flow at one resolution; ``warped`` adds its pyramid and first warps the frames as
if all were in the fixated plane, so that only the residual is differentiated; ``dis`` is OpenCV's Dense Inverse Search
(Kroeger et al. 2016), the mean of the motions to the next and from the last frame. All belong to the middle frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import inverse
from fixation_gym.perception.distance.flow_filters import FlowSamples
from fixation_gym.perception.flow.optic_flow import Flow, FlowSettings, estimate_flow, flow_grid, plane_homography
from fixation_gym.types import FloatArray, ImageArray, MaskArray

FlowName = Literal["gradient", "warped", "dis"]
FLOW_NAMES: tuple[FlowName, ...] = ("gradient", "warped", "dis")

SAMPLE_COUNT = 30
"""Flow samples per frame (the paper's n)."""
_INDEPENDENT = 10
"""How many of them count as independent: neighbours share their window."""
_LEAST_STD_PX = 0.1
"""Least standard deviation of a gradient sample, px of the full image per frame."""
_DIS_STD_PX = 0.2
"""Standard deviation of a DIS sample across an edge, px of the full image per frame."""
_WINDOW = 9
"""Side of the window that tells the direction of an edge, px."""
_UNKNOWN = 10.0
"""Standard deviation of a motion about which nothing is known, 1/s."""
_MARGIN = 40
"""Pixels kept around the target: what the coarsest windows reach."""
_MAX_GAP_S = 0.15
"""Frames farther apart than this are not differentiated, s."""
_LARGEST_SIDE = 320
"""Larger cut-outs are halved, px."""


@dataclass(frozen=True, slots=True, eq=False)
class CutOut:
    """Part of a grey image around the target."""

    time: float
    """s."""
    grey: ImageArray
    """Shape (h, w)."""
    corner: tuple[int, int]
    """Column and row of its top-left pixel in the full image."""
    mask: MaskArray
    """Pixels of the target, shape (h, w)."""
    T_base_cam: FloatArray
    """Believed camera pose, shape (4, 4)."""


def sample_flow(
    frames: tuple[CutOut, CutOut, CutOut], intrinsics: Intrinsics, inverse_distance: float, rng: np.random.Generator
) -> dict[FlowName, FlowSamples] | None:
    """Flow at ``SAMPLE_COUNT`` edge points of the target in the middle one of three frames; None if it has no edges.

    Args:
        frames: consecutive cut-outs; frames that are missing or out of order leave no flow.
        intrinsics: of the full image.
        inverse_distance: of the plane for the warp, 1/m.
        rng: chooses the points.
    """
    gaps = np.diff([frame.time for frame in frames])
    window = _common_window(frames, intrinsics)
    if window is None or not np.all((gaps > 0.0) & (gaps < _MAX_GAP_S)):
        return None
    left, top, right, bottom = window
    images = [_part(frame.grey, frame.corner, window) for frame in frames]
    mask = _part(frames[1].mask.view(np.uint8), frames[1].corner, window)
    camera = Intrinsics(
        right - left, bottom - top, intrinsics.fx, intrinsics.fy, intrinsics.cx - left, intrinsics.cy - top
    )
    if max(mask.shape) > _LARGEST_SIDE:
        height, width = mask.shape[0] // 2, mask.shape[1] // 2
        camera = camera.scaled(height, width)
        images = [_resized(image, width, height, cv2.INTER_AREA) for image in images]
        mask = _resized(mask, width, height, cv2.INTER_NEAREST)
    points = _edge_points(mask, rng)
    if points is None:
        return None
    std_per_px = 2.0 / (intrinsics.fx * (frames[2].time - frames[0].time))
    return {
        **_gradient_samples(frames, images, camera, inverse_distance, points, std_per_px),
        "dis": _dis_samples(frames, images, camera, points, std_per_px),
    }


def _common_window(frames: tuple[CutOut, CutOut, CutOut], intrinsics: Intrinsics) -> tuple[int, int, int, int] | None:
    """(left, top, right, bottom) around the middle target and inside all three cut-outs, of even size."""
    middle = frames[1]
    columns, rows = np.flatnonzero(middle.mask.any(axis=0)), np.flatnonzero(middle.mask.any(axis=1))
    if columns.size == 0:
        return None
    x, y = middle.corner
    left, right = x + int(columns[0]) - _MARGIN, x + int(columns[-1]) + 1 + _MARGIN
    top, bottom = y + int(rows[0]) - _MARGIN, y + int(rows[-1]) + 1 + _MARGIN
    left, top = max([left, 0, *(f.corner[0] for f in frames)]), max([top, 0, *(f.corner[1] for f in frames)])
    right = min([right, intrinsics.width, *(f.corner[0] + f.grey.shape[1] for f in frames)])
    bottom = min([bottom, intrinsics.height, *(f.corner[1] + f.grey.shape[0] for f in frames)])
    right, bottom = right - (right - left) % 4, bottom - (bottom - top) % 4
    return (left, top, right, bottom) if min(right - left, bottom - top) >= 32 else None


def _part(image: ImageArray, corner: tuple[int, int], window: tuple[int, int, int, int]) -> ImageArray:
    left, top, right, bottom = window
    return np.ascontiguousarray(image[top - corner[1] : bottom - corner[1], left - corner[0] : right - corner[0]])


def _resized(image: ImageArray, width: int, height: int, interpolation: int) -> ImageArray:
    return np.asarray(cv2.resize(image, (width, height), interpolation=interpolation), np.uint8)


def _edge_points(mask: ImageArray, rng: np.random.Generator) -> FloatArray | None:
    """Columns and rows of random pixels on the outline, shape (n, 2); None if there are hardly any."""
    outline = cv2.morphologyEx(mask, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
    outline[[0, 1, -2, -1], :] = outline[:, [0, 1, -2, -1]] = 0
    rows, columns = np.nonzero(outline)
    if rows.size < 8:
        return None
    chosen = rng.choice(rows.size, SAMPLE_COUNT, replace=rows.size < SAMPLE_COUNT)
    return np.column_stack([columns[chosen], rows[chosen]]).astype(np.float64)


def edge_samples(flow: Flow, target: MaskArray, rng: np.random.Generator) -> FlowSamples | None:
    """Samples of a flow at random edge points of the target; None if it has hardly any.

    Args:
        flow: of the whole image.
        target: its pixels at the time of the flow, shape (H, W).
        rng: chooses the points.
    """
    grid = flow.intrinsics
    height, width = flow.overlap.shape
    points = _edge_points(_resized(target.view(np.uint8), 2 * width, 2 * height, cv2.INTER_NEAREST), rng)
    return None if points is None else _at_grid(flow, grid, points, 1.0 / (grid.fx * 2.0 * flow.period))


def _gradient_samples(
    frames: tuple[CutOut, CutOut, CutOut],
    images: Sequence[ImageArray],
    camera: Intrinsics,
    inverse_distance: float,
    points: FloatArray,
    std_per_px: float,
) -> dict[FlowName, FlowSamples]:
    floats = [image.astype(np.float32) for image in images]
    times = [frame.time for frame in frames]
    settings = FlowSettings(max_width=2 * _LARGEST_SIDE)
    poses = [frame.T_base_cam for frame in frames]
    to_first, to_last = (
        plane_homography(inverse(pose) @ poses[1], inverse_distance, camera) for pose in (poses[0], poses[2])
    )
    # The flow needs to know the size of the images only, and takes the principal point for their middle.
    middle = replace(camera, cx=0.5 * (camera.width - 1), cy=0.5 * (camera.height - 1))
    single = estimate_flow(floats, times, middle, settings=replace(settings, levels=1))
    warped = estimate_flow(floats, times, middle, (to_first, to_last), inverse_distance, settings)
    grid = flow_grid(camera)
    return {
        "gradient": _at_grid(single, grid, points, std_per_px),
        "warped": _at_grid(warped, grid, points, std_per_px),
    }


def _at_grid(flow: Flow, grid: Intrinsics, points: FloatArray, std_per_px: float) -> FlowSamples:
    """Flow at the grid pixels that hold the points, in normalised coordinates."""
    columns = np.minimum(points[:, 0] // 2, grid.width - 1).astype(int)
    rows = np.minimum(points[:, 1] // 2, grid.height - 1).astype(int)
    values = flow.flow[rows, columns].astype(np.float64) / [grid.fx, grid.fy]
    xx, xy, yy = np.moveaxis(flow.cov[rows, columns].astype(np.float64) / grid.fx**2, -1, 0)
    # Single precision can leave the covariance of an edge indefinite: rebuilt from its limited principal values.
    variances, axes = np.linalg.eigh(np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -2))
    variances = np.clip(variances, 0.0, _UNKNOWN**2) + (_LEAST_STD_PX * std_per_px) ** 2
    cov = axes @ (variances[..., None] * np.swapaxes(axes, 1, 2)) * (SAMPLE_COUNT / _INDEPENDENT)
    places = grid.normalise(np.column_stack([columns, rows]).astype(np.float64))
    return FlowSamples(places, values, cov)


def _dis_samples(
    frames: tuple[CutOut, CutOut, CutOut],
    images: Sequence[ImageArray],
    camera: Intrinsics,
    points: FloatArray,
    std_per_px: float,
) -> FlowSamples:
    dis = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_ULTRAFAST)
    first, middle, last = images
    forward, backward = (
        np.asarray(dis.calc(middle, other, np.zeros((*middle.shape, 2), np.float32))) for other in (last, first)
    )
    columns, rows = points[:, 0].astype(int), points[:, 1].astype(int)
    displacement = (forward - backward)[rows, columns].astype(np.float64)
    values = displacement / (frames[2].time - frames[0].time) / [camera.fx, camera.fy]
    std = _DIS_STD_PX * std_per_px
    cov = std**2 * SAMPLE_COUNT / _INDEPENDENT * _edge_shape(middle)[rows, columns]
    return FlowSamples(camera.normalise(points), values, cov)


def _edge_shape(grey: ImageArray) -> FloatArray:
    """Covariance shape of a motion seen through a small window, shape (h, w, 2, 2): 1 across an edge, large along it.

    DIS states no uncertainty, and at an edge it finds little more than the motion across it.
    """
    image = cv2.GaussianBlur(grey.astype(np.float32), (0, 0), 1.0)
    ix, iy = cv2.Scharr(image, cv2.CV_32F, 1, 0), cv2.Scharr(image, cv2.CV_32F, 0, 1)
    xx, xy, yy = (cv2.blur(product, (_WINDOW, _WINDOW)).astype(np.float64) for product in (ix * ix, ix * iy, iy * iy))
    strength = 0.5 * (xx + yy) + np.sqrt(0.25 * (xx - yy) ** 2 + xy**2) + 1e-9
    least = 1e-4 * strength
    determinant = (xx + least) * (yy + least) - xy**2
    inverse_tensor = np.stack([np.stack([yy + least, -xy], -1), np.stack([-xy, xx + least], -1)], -2)
    return inverse_tensor * (strength / determinant)[..., None, None]
