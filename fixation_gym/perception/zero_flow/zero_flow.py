"""Exact zero-flow test: which pixels show something nearer than the fixated object.

The flow is d A v + B w (Eq. 1). After the flow of the fixated plane is taken out, the rest is (d - d_f) g with
g = A v, a vector along the epipolar line. Its length along g gives the inverse depth d = d_f + s with a standard
deviation per pixel, straight from the windowed gradients, so an edge not parallel to g suffices. This holds for any
twist, also during approach, where the dot-product rule of the paper ("Avoiding obstacles") bends away. For comparison
that rule can be asked to decide in its place (``ZeroFlowSettings.rule``).

A thing is an obstacle if it is nearer than both the fixated object and the support surface, whose depth follows from
its height and the camera pose.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.interaction import epipolar_direction
from fixation_gym.perception.flow.optic_flow import Flow
from fixation_gym.perception.scratch import Float32Array, fill
from fixation_gym.perception.zero_flow.evidence_map import CELLS, UNKNOWN, ZeroFlowSettings, evidence_map
from fixation_gym.perception.zero_flow.front_rule import FrontQuestion, answered
from fixation_gym.perception.zero_flow.pictures import Pictures
from fixation_gym.perception.zero_flow.pixel_answers import PixelAnswers, PixelQuestion
from fixation_gym.types import FloatArray, ImageArray, MaskArray

_DECIDED = 0.95
"""Probability of a side from which on a pixel is decided."""


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
    outline: MaskArray
    """Pixels that seem nearer, but lie within a window's reach of something surely behind, shape (h, w). An outline
    belongs to the nearer thing and its motion spreads to both sides, so these may show either: no evidence. Things too
    thin to have an inside keep theirs."""
    cells: ImageArray
    """The map for policies, shape (32, 32): P(nearer) * 255 where known, 128 elsewhere; moving pixels count as near."""
    inverse_depth: Float32Array
    """Estimated inverse depth, shape (h, w), 1/m; NaN without evidence, but kept at outlines."""
    inverse_depth_std: Float32Array
    """Its standard deviation, shape (h, w), 1/m; inf where nothing is known."""
    fixated_inverse_depth: float
    """Inverse depth of the fixated object that the pixels were compared with, 1/m; 0 if nothing could be tested."""
    usable: MaskArray
    """Pixels that were asked: they show neither the target nor the robot, shape (h, w)."""


def unknown_zero_flow(height: int, width: int) -> ZeroFlow:
    """Return the result of a test that cannot be made: no motion, no flow or no fixated object."""
    return ZeroFlow(
        p_nearer=np.full((height, width), 0.5, np.float32),
        supported=np.zeros((height, width), np.bool_),
        moving=np.zeros((height, width), np.bool_),
        outline=np.zeros((height, width), np.bool_),
        cells=np.full((CELLS, CELLS), UNKNOWN, np.uint8),
        inverse_depth=np.full((height, width), np.nan, np.float32),
        inverse_depth_std=np.full((height, width), np.inf, np.float32),
        fixated_inverse_depth=0.0,
        usable=np.zeros((height, width), np.bool_),
    )


def zero_flow_test(
    flow: Flow,
    gaze: Gaze,
    settings: ZeroFlowSettings,
    self_mask: MaskArray | None = None,
    support_height_m: float | None = None,
    pictures: Pictures | None = None,
) -> ZeroFlow:
    """Test every pixel of a flow against the fixated object and the support surface.

    Args:
        flow: flow at the centre of three frames.
        gaze: camera motion and fixated object at the same time.
        settings: margins and gates.
        self_mask: pixels of the robot itself, any shape (H, W); they are unknown.
        support_height_m: height of the horizontal support surface in base, m; None if there is none.
        pictures: that the flow was made of, for rules that look at them.
    """
    shape = flow.overlap.shape
    if not flow.valid or not float(gaze.twist[:3] @ gaze.twist[:3]) > 1e-12:
        return unknown_zero_flow(*shape)
    usable = _usable(flow, gaze.target, self_mask, settings)
    exact = _question(flow, gaze, settings, support_height_m)
    fixated, margin = gaze.inverse_distance, settings.depth_margin
    asked = FrontQuestion(flow, usable, exact, gaze.twist, fixated, margin, pictures)
    answers = answered(settings.rule, asked)
    if gaze.inverse_distance_std > settings.max_fixation_std * gaze.inverse_distance or flow.imperfect:
        _leave_the_decided(answers)
    outline = _outline(answers, gaze.inverse_distance, settings)
    moving = answers.moving & ~_mixed(answers.moving, outline, settings)
    # With outlines: for who moves by the map it is better that a thing seems a cell larger than smaller.
    cells = evidence_map(answers.p_nearer, answers.supported, moving, settings)
    fill(answers.p_nearer, 0.5, outline)
    return ZeroFlow(
        p_nearer=answers.p_nearer,
        supported=answers.supported & ~outline,
        moving=moving,
        outline=outline,
        cells=cells,
        inverse_depth=answers.inverse_depth,
        inverse_depth_std=answers.inverse_depth_std,
        fixated_inverse_depth=gaze.inverse_distance,
        usable=usable,
    )


def _usable(flow: Flow, target: MaskArray, self_mask: MaskArray | None, settings: ZeroFlowSettings) -> MaskArray:
    """Pixels of the flow's grid, shape (h, w), that show neither the target nor the robot; masks are of any shape."""
    usable = flow.overlap & ~widened_on_grid(target, flow.overlap.shape, settings.target_margin_px)
    if self_mask is not None:
        usable &= ~widened_on_grid(self_mask, flow.overlap.shape, 1)
    return usable


def _leave_the_decided(answers: PixelAnswers) -> None:
    """Take the evidence from pixels that may be on either side, in place."""
    undecided = np.abs(answers.p_nearer - np.float32(0.5)) < np.float32(_DECIDED - 0.5)
    fill(answers.p_nearer, 0.5, undecided)
    fill(answers.inverse_depth, np.nan, undecided)
    np.logical_and(answers.supported, ~undecided, out=answers.supported)


def _outline(answers: PixelAnswers, fixated: float, settings: ZeroFlowSettings) -> MaskArray:
    """Pixels that seem nearer than the fixated object, next to some that are surely farther, shape (h, w)."""
    depth = answers.inverse_depth
    with np.errstate(invalid="ignore"):
        farther = depth + np.float32(2.0) * answers.inverse_depth_std < np.float32(fixated)
        nearer = depth > np.float32(fixated)
    nearer &= answers.supported
    near_farther = cv2.dilate((farther & answers.supported).view(np.uint8), _square(settings.outline_px))
    outline = nearer & near_farther.view(np.bool_)
    # A bar or a rim is nothing but outline: without a core within reach, outlines are all that is known of a thing.
    core = cv2.dilate((nearer & ~outline).view(np.uint8), _square(2 * settings.outline_px))
    return outline & core.view(np.bool_)


def _mixed(moving: MaskArray, outline: MaskArray, settings: ZeroFlowSettings) -> MaskArray:
    """Pixels near outlines that seem to move by themselves, but are too few side by side to be a thing, shape (h, w).

    A window that holds two motions along one epipolar line solves for one that is off it.
    """
    near_outline = cv2.dilate(outline.view(np.uint8), _square(settings.outline_px))
    things = cv2.morphologyEx(moving.view(np.uint8), cv2.MORPH_OPEN, _square(settings.outline_px))
    return near_outline.view(np.bool_) & (things == 0)


def _question(flow: Flow, gaze: Gaze, settings: ZeroFlowSettings, support_height_m: float | None) -> PixelQuestion:
    """What every pixel is tested against, in px of the grid and frame intervals."""
    x, y = _float_grid(flow.intrinsics)
    gx, gy = epipolar_direction(x, y, gaze.twist[:3])
    height = None if support_height_m is None else support_height_m + settings.height_margin_m
    rows, columns = _surface_inverse_depth(gaze.T_base_cam, height, x, y)
    pose = 0.5 * flow.intrinsics.fx**2  # errors of two poses, motion over two intervals: 2 / 2^2
    return PixelQuestion(
        gx=(gx * (flow.intrinsics.fx * flow.period)).astype(np.float32),
        gy=(gy * (flow.intrinsics.fy * flow.period)).astype(np.float32),
        warp_inverse_depth=np.float32(flow.warp_inverse_depth),
        boundary=np.float32(gaze.inverse_distance * (1.0 + settings.depth_margin)),
        boundary_variance=np.float32(gaze.inverse_distance_std**2),
        surface_rows=rows,
        surface_columns=columns,
        max_std=np.float32(settings.max_relative_std * gaze.inverse_distance),
        moving_gate=np.float32(settings.moving_gate),
        least_moving=np.float32(settings.moving_px**2),
        rotation_noise=np.float32(pose * settings.rotation_std_rad**2),
        position_noise=np.float32(pose * settings.position_std_m**2),
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


@lru_cache(maxsize=8)
def _float_grid(intrinsics: Intrinsics) -> tuple[FloatArray, FloatArray]:
    """Normalised coordinates x, shape (w,), and y, shape (h,), of the pixels."""
    x, y = intrinsics.grid
    return x[0], y[:, 0]


def _surface_inverse_depth(
    T_base_cam: FloatArray, height_m: float | None, x: FloatArray, y: FloatArray
) -> tuple[Float32Array, Float32Array]:
    """Inverse depth of a horizontal plane along every ray, 1/m: the sum of a part per row (h,) and per column (w,).

    It is not positive where the ray misses the plane; -inf without a plane or below it.
    """
    down = -1.0 if height_m is None else height_m - float(T_base_cam[2, 3])
    if height_m is None or down >= 0.0:
        return np.full(y.size, -np.inf, np.float32), np.zeros(x.size, np.float32)
    a, b, c = (T_base_cam[2, :3] / down).tolist()
    return (b * y + c).astype(np.float32), (a * x).astype(np.float32)


def widened_on_grid(mask: MaskArray, shape: tuple[int, ...], widen_px: int) -> MaskArray:
    """Mask on another grid, widened by some pixels of it; shape (h, w)."""
    grid = mask.view(np.uint8)
    if mask.shape != shape:
        grid = _pooled_any(grid, shape)
    grid = (grid > 0).view(np.uint8)
    if widen_px > 0:
        grid = np.asarray(cv2.dilate(grid, _disc(widen_px)), np.uint8)
    return grid.view(np.bool_)


@lru_cache(maxsize=8)
def _square(reach: int) -> ImageArray:
    return np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)


@lru_cache(maxsize=8)
def _disc(radius: int) -> ImageArray:
    side = 2 * radius + 1
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)), np.uint8)


def _pooled_any(mask: ImageArray, shape: tuple[int, ...]) -> ImageArray:
    """Positive where any pixel is set, shape (h, w); only the part of the mask that is set is looked at."""
    step_y, step_x = mask.shape[0] // shape[0], mask.shape[1] // shape[1]
    if mask.shape != (step_y * shape[0], step_x * shape[1]):
        return np.asarray(cv2.resize(mask * np.uint8(255), shape[::-1], interpolation=cv2.INTER_AREA), np.uint8)
    grid = np.zeros(shape, np.uint8)
    left, top, width, height = cv2.boundingRect(mask)
    if width and height:
        rows = slice(top // step_y, (top + height - 1) // step_y + 1)
        columns = slice(left // step_x, (left + width - 1) // step_x + 1)
        part = mask[rows.start * step_y : rows.stop * step_y, columns.start * step_x : columns.stop * step_x]
        size = (columns.stop - columns.start, rows.stop - rows.start)
        grid[rows, columns] = cv2.resize(part * np.uint8(255), size, interpolation=cv2.INTER_AREA)
    return grid
