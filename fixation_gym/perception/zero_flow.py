"""Exact zero-flow test: which pixels show something nearer than the fixated object.

The flow is d A v + B w (Eq. 1). After the flow of the fixated plane is taken out, the rest is (d - d_f) g with
g = A v, a vector along the epipolar line. Its length along g gives the inverse depth d = d_f + s with a standard
deviation per pixel, straight from the windowed gradients, so an edge not parallel to g suffices. This holds for any
twist, also during approach, where the dot-product rule of the paper ("Avoiding obstacles") bends away.

A thing is an obstacle if it is nearer than both the fixated object and the support surface, whose depth follows from
its height and the camera pose.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.special import ndtr

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.interaction import epipolar_direction
from fixation_gym.perception.optic_flow import Float32Array, Flow
from fixation_gym.types import FloatArray, ImageArray, MaskArray

CELLS = 32
"""Cells along each side of the map."""
UNKNOWN = 128
"""Cell value where there is no evidence; otherwise P(nearer) times 255."""


@dataclass(frozen=True, slots=True)
class ZeroFlowSettings:
    """Margins and gates of the test."""

    depth_margin: float = 0.05
    """An obstacle's inverse depth exceeds the fixated one by this share at least."""
    height_margin_m: float = 0.015
    """An obstacle rises above the support surface by this much at least, m."""
    max_relative_std: float = 0.25
    """A pixel has evidence if its inverse depth is known to this share of the fixated one."""
    position_std_m: float = 1e-4
    """Noise of each camera position, m."""
    rotation_std_rad: float = 2e-4
    """Noise of each camera orientation, rad."""
    moving_gate: float = 15.0
    """Motion across the epipolar line is independent above this chi-square (1 degree of freedom; 99.99 %)."""
    moving_px: float = 0.25
    """... and above this motion, px of the flow grid per frame interval."""
    target_margin_px: int = 3
    """The target is widened by this much, px of the flow grid: windows at its outline mix it with what is behind."""
    cell_min_share: float = 0.06
    """Least share of a cell's pixels that must have evidence."""
    cell_min_front: float = 0.15
    """Least front evidence in a cell and its 8 neighbours together, in cells; less is speckle."""
    front_weight: float = 2.0
    """Front evidence counts this much more than evidence of the free background in the same cell."""


@dataclass(frozen=True, slots=True, eq=False)
class Gaze:
    """What is fixated, seen from the camera at the time of the flow."""

    twist: FloatArray
    """Mean camera twist [v, w] over the frames of the flow, expressed in ``cam``, shape (6,), m/s and rad/s."""
    inverse_distance: float
    """d_f of the fixated object along the optical axis, 1/m."""
    inverse_distance_std: float
    """Its standard deviation, 1/m."""
    target: MaskArray
    """Pixels of the object, any shape (H, W); it is resampled to the flow grid."""
    T_base_cam: FloatArray
    """Camera pose in base, shape (4, 4); only used with a support height."""


@dataclass(frozen=True, slots=True, eq=False)
class ZeroFlow:
    """Result of the test on the flow's grid (h, w) and on the coarse map."""

    p_nearer: Float32Array
    """P(nearer than the fixated object and above the support surface), shape (h, w); 0.5 without evidence."""
    supported: MaskArray
    """Pixels with evidence, shape (h, w)."""
    moving: MaskArray
    """Pixels that move off their epipolar line: something moves by itself there, shape (h, w)."""
    cells: ImageArray
    """The map for policies, shape (32, 32): P(nearer) * 255 where known, 128 elsewhere; moving pixels count as near."""
    inverse_depth: Float32Array
    """Estimated inverse depth, shape (h, w), 1/m; NaN without evidence."""
    inverse_depth_std: Float32Array
    """Its standard deviation, shape (h, w), 1/m; inf where nothing is known."""


def unknown_zero_flow(height: int, width: int) -> ZeroFlow:
    """Return the result of a test that cannot be made: no motion, no flow or no fixated object."""
    return ZeroFlow(
        p_nearer=np.full((height, width), 0.5, np.float32),
        supported=np.zeros((height, width), np.bool_),
        moving=np.zeros((height, width), np.bool_),
        cells=np.full((CELLS, CELLS), UNKNOWN, np.uint8),
        inverse_depth=np.full((height, width), np.nan, np.float32),
        inverse_depth_std=np.full((height, width), np.inf, np.float32),
    )


def zero_flow_test(
    flow: Flow,
    gaze: Gaze,
    settings: ZeroFlowSettings,
    self_mask: MaskArray | None = None,
    support_height_m: float | None = None,
) -> ZeroFlow:
    """Test every pixel of a flow against the fixated object and the support surface.

    Args:
        flow: flow at the centre of three frames.
        gaze: camera motion and fixated object at the same time.
        settings: margins and gates.
        self_mask: pixels of the robot itself, any shape (H, W); they are unknown.
        support_height_m: height of the horizontal support surface in base, m; None if there is none.
    """
    height, width = flow.overlap.shape
    if not flow.valid or not np.linalg.norm(gaze.twist[:3]) > 1e-6:
        return unknown_zero_flow(height, width)
    x, y = _float_grid(flow.intrinsics)
    gx, gy = _displacement_per_inverse_depth(flow, gaze.twist[:3], x, y)
    excess, variance = _along(flow, gx, gy, settings)
    inverse_depth = flow.warp_inverse_depth + excess
    std = np.sqrt(variance)
    target = _resampled(gaze.target, flow.overlap.shape, settings.target_margin_px)
    usable = flow.overlap & ~target
    if self_mask is not None:
        usable &= ~_resampled(self_mask, flow.overlap.shape, 1)
    supported = usable & (std < settings.max_relative_std * gaze.inverse_distance)
    boundary = np.float32(gaze.inverse_distance * (1.0 + settings.depth_margin))
    boundary_variance = np.float32(gaze.inverse_distance_std**2)
    if support_height_m is not None:
        surface = _surface_inverse_depth(gaze.T_base_cam, support_height_m + settings.height_margin_m, x, y)
        boundary_variance = np.where(surface > boundary, np.float32(0.0), boundary_variance)
        boundary = np.maximum(surface, boundary)
    p_nearer = ndtr((inverse_depth - boundary) / np.sqrt(variance + boundary_variance)).astype(np.float32)
    p_nearer[~supported] = 0.5
    moving = usable & _moves_across(flow, gx, gy, settings)
    inverse_depth[~supported] = np.nan
    return ZeroFlow(
        p_nearer=p_nearer,
        supported=supported,
        moving=moving,
        cells=_cells(p_nearer, supported, moving, settings),
        inverse_depth=inverse_depth,
        inverse_depth_std=std,
    )


def obstacle_centre(zero_flow: ZeroFlow, intrinsics: Intrinsics) -> tuple[FloatArray, float]:
    """Centre of mass of the potential (paper, "Avoiding obstacles"): the evidence of nearer things in the map.

    Args:
        zero_flow: result of the test.
        intrinsics: of the camera, at any resolution.

    Returns:
        Centre in normalised image coordinates, shape (2,), zero without front evidence; and the share of the image,
        0..1, that front evidence covers.
    """
    front = np.clip((zero_flow.cells.astype(np.float64) - UNKNOWN) / (255 - UNKNOWN), 0.0, 1.0)
    total = float(front.sum())
    if total <= 0.0:
        return np.zeros(2), 0.0
    x, y = intrinsics.scaled(CELLS, CELLS).grid
    return np.array([(front * x).sum(), (front * y).sum()]) / total, total / front.size


def _float_grid(intrinsics: Intrinsics) -> tuple[Float32Array, Float32Array]:
    """Normalised x of shape (1, w) and y of shape (h, 1)."""
    x, y = intrinsics.grid
    return x[:1].astype(np.float32), y[:, :1].astype(np.float32)


def _displacement_per_inverse_depth(
    flow: Flow, v: FloatArray, x: Float32Array, y: Float32Array
) -> tuple[Float32Array, Float32Array]:
    """Epipolar direction g in px of the grid per frame interval and per 1/m, each of shape (h, w)."""
    gx, gy = epipolar_direction(x.astype(np.float64), y.astype(np.float64), v)
    scale_x, scale_y = flow.intrinsics.fx * flow.period, flow.intrinsics.fy * flow.period
    shape = flow.overlap.shape
    return (
        np.broadcast_to((gx * scale_x).astype(np.float32), shape),
        np.broadcast_to((gy * scale_y).astype(np.float32), shape),
    )


def _pose_noise(flow: Flow, settings: ZeroFlowSettings, inverse_depth: Float32Array | float) -> Float32Array:
    """Variance of the predicted motion from errors of two poses, px^2 per interval^2."""
    scale = 0.5 * flow.intrinsics.fx**2  # two poses, motion over two intervals: 2 / 2^2
    position = np.float32(scale * settings.position_std_m**2) * np.square(inverse_depth)
    return np.float32(scale * settings.rotation_std_rad**2) + position


def _along(
    flow: Flow, gx: Float32Array, gy: Float32Array, settings: ZeroFlowSettings
) -> tuple[Float32Array, Float32Array]:
    """Inverse depth in excess of the warp plane's and its variance, 1/m and 1/m^2, each of shape (h, w)."""
    j, b = flow.information, flow.gradient
    information = gx * gx * j[0] + 2.0 * gx * gy * j[1] + gy * gy * j[2]
    information = np.maximum(information, _LEAST_INFORMATION)
    excess = -(gx * b[0] + gy * b[1]) / information
    length = np.maximum(gx * gx + gy * gy, _LEAST_LENGTH)
    return excess, 1.0 / information + _pose_noise(flow, settings, flow.warp_inverse_depth + excess) / length


def _moves_across(flow: Flow, gx: Float32Array, gy: Float32Array, settings: ZeroFlowSettings) -> MaskArray:
    """Pixels whose residual motion has a significant component across g."""
    scale = 1.0 / np.sqrt(np.maximum(gx * gx + gy * gy, _LEAST_LENGTH))
    nx, ny = -gy * scale, gx * scale
    cov = flow.residual_cov
    across = nx * flow.residual[0] + ny * flow.residual[1]
    variance = nx * nx * cov[0] + 2.0 * nx * ny * cov[1] + ny * ny * cov[2]
    variance = variance + _pose_noise(flow, settings, flow.warp_inverse_depth)
    squared = across * across
    return (squared > settings.moving_gate * variance) & (squared > settings.moving_px**2)


def _surface_inverse_depth(T_base_cam: FloatArray, height_m: float, x: Float32Array, y: Float32Array) -> Float32Array:
    """Inverse depth of a horizontal plane along every ray, shape (h, w), 1/m; 0 where the ray misses it."""
    down = height_m - T_base_cam[2, 3]
    if down >= 0.0:  # camera below the plane
        return np.zeros(np.broadcast_shapes(x.shape, y.shape), np.float32)
    slope = (T_base_cam[2, :3] / down).astype(np.float32)
    return np.maximum(slope[0] * x + slope[1] * y + slope[2], np.float32(0.0))


def _resampled(mask: MaskArray, shape: tuple[int, ...], widen_px: int) -> MaskArray:
    """Mask on another grid, widened by some pixels of it; shape (h, w)."""
    grid = mask.view(np.uint8)
    if mask.shape != shape:
        grid = cv2.resize(grid * np.uint8(255), (shape[1], shape[0]), interpolation=cv2.INTER_AREA)
    grid = (grid > 0).astype(np.uint8)
    if widen_px > 0 and grid.any():
        kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * widen_px + 1, 2 * widen_px + 1))
        grid = np.asarray(cv2.dilate(grid, kernel), np.uint8)
    return grid.view(np.bool_)


def _cells(p_nearer: Float32Array, supported: MaskArray, moving: MaskArray, settings: ZeroFlowSettings) -> ImageArray:
    """Pool the evidence of pixels into the map; a pixel weighs by how decided it is."""
    decided = 2.0 * p_nearer - 1.0  # 0 without evidence
    front = np.maximum(decided, moving.astype(np.float32))
    behind = np.where(moving, np.float32(0.0), np.maximum(-decided, 0.0))
    seen = (supported | moving).astype(np.float32)
    planes = (front, front * front, behind, behind * behind, seen)
    front, front_squared, behind, behind_squared, seen = (
        cv2.resize(plane, (CELLS, CELLS), interpolation=cv2.INTER_AREA) for plane in planes
    )
    around = cv2.boxFilter(front, cv2.CV_32F, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
    bias = np.where(around >= settings.cell_min_front, settings.front_weight, 0.0)
    evidence = bias * front + behind
    mean_decided = (bias * front_squared - behind_squared) / np.maximum(evidence, 1e-6)
    probability = 0.5 + 0.5 * mean_decided
    known = (seen >= settings.cell_min_share) & (evidence > 0.5 * settings.cell_min_share)
    return np.where(known, np.rint(255.0 * probability), UNKNOWN).astype(np.uint8)


_LEAST_INFORMATION = np.float32(1e-12)
_LEAST_LENGTH = np.float32(1e-12)
