"""Optic flow with covariance from spatio-temporal gradients of three frames.

Windows of gradient products (``gradients``) are solved as in Simoncelli, Adelson & Heeger 1991, u = -J^-1 b with
Cov = J^-1, without their prior, which would shorten the flow by 8-10 %.

The outer two frames are first warped onto the middle one as if everything lay in the fixated plane. This takes out
rotation and the motion of the fixated point exactly; only the residual of other depths is left to differentiate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.flow.brightness import is_dark, relative_gain, without_gain
from fixation_gym.perception.flow.gradients import (
    SPACE_PREFILTER,
    TIME_DERIVATIVE,
    TIME_PREFILTER,
    FlowSettings,
    gradient_sums,
    solve,
)
from fixation_gym.perception.flow.kernels import WINDOW
from fixation_gym.perception.flow.picture_noise import take_own_noise
from fixation_gym.perception.flow.rolling_shutter import PixelMap
from fixation_gym.perception.scratch import Float32Array, Scratch, fill
from fixation_gym.types import FloatArray, ImageArray, MaskArray


@dataclass(frozen=True, eq=False)
class Flow:
    """Flow at the centre of three frames, on a grid of half their size: shape (h, w), camera ``intrinsics``.

    All lengths in px are px of this grid; an interval is ``period``. The zero-flow test needs only the residual, so
    ``flow`` and ``cov`` are computed when first read.
    """

    time: float
    """Time of the filter centre, which is the middle frame, s."""
    valid: bool
    """False until three consecutive frames have arrived; then all arrays are NaN."""
    intrinsics: Intrinsics
    """Camera of the grid; its width and height are w and h."""
    period: float
    """Mean frame interval, s."""
    residual: Float32Array
    """Motion beyond the warp, shape (2, h, w), px per interval."""
    residual_cov: Float32Array
    """Entries xx, xy, yy of its covariance J^-1, shape (3, h, w), px^2 per interval^2; huge where nothing is known."""
    information: Float32Array
    """Entries xx, xy, yy of the windowed information J, shape (3, h, w)."""
    gradient: Float32Array
    """Windowed products b of image and temporal gradient, shape (2, h, w): residual = -J^-1 b."""
    warp_inverse_depth: float
    """Inverse depth 1/m of the plane whose motion the warp took out; 0 for rotation only."""
    overlap: MaskArray
    """Pixels whose windows lie inside all three frames, shape (h, w)."""
    warp: tuple[FloatArray, FloatArray]
    """Maps from pixels of the middle frame to the first and to the last one, each of shape (3, 3)."""
    frame_intrinsics: Intrinsics
    """Camera of the frames."""
    imperfect: bool = False
    """Whether these pictures have more noise than assumed, change in brightness or are dark: then information and
    covariances are those of the noise that was measured in them, and weak evidence is none."""
    noise_share: float = 1.0
    """Variance of the noise that was measured in these pictures, as a share of the assumed one, at most 1."""

    @cached_property
    def flow(self) -> Float32Array:
        """Image motion (x, y), shape (h, w, 2), px/s; NaN where the frames do not overlap."""
        motion = _warp_motion(self.warp, self.frame_intrinsics)
        motion += self.residual
        motion /= np.float32(self.period)
        for axis in motion:
            fill(axis, np.nan, ~self.overlap)
        return np.moveaxis(motion, 0, -1)

    @cached_property
    def cov(self) -> Float32Array:
        """Entries xx, xy, yy of the covariance of ``flow``, shape (h, w, 3), (px/s)^2; huge where nothing is known."""
        return np.moveaxis(self.residual_cov / np.float32(self.period**2), 0, -1)


def invalid_flow(time: float, frame_intrinsics: Intrinsics) -> Flow:
    """Return the flow of a frame that lacks neighbours: all NaN."""
    grid = flow_grid(frame_intrinsics)
    shape = (grid.height, grid.width)
    nan = np.full((3, *shape), np.nan, np.float32)
    overlap = np.zeros(shape, np.bool_)
    warp = (np.eye(3), np.eye(3))
    return Flow(time, False, grid, np.nan, nan[:2], nan, nan, nan[:2], 0.0, overlap, warp, frame_intrinsics)


def flow_grid(frame_intrinsics: Intrinsics) -> Intrinsics:
    """Camera of the flow grid: half the resolution of the frames."""
    return frame_intrinsics.scaled(frame_intrinsics.height // 2, frame_intrinsics.width // 2)


def prepare_grey(rgb: ImageArray, height: int, width: int) -> Float32Array:
    """Grey image of the given size, shape (height, width), grey levels.

    Args:
        rgb: image of shape (H, W, 3), uint8.
        height: of the result.
        width: of the result.
    """
    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    if grey.shape != (height, width):
        grey = cv2.resize(grey, (width, height), interpolation=cv2.INTER_AREA)
    return grey.astype(np.float32)


def plane_homography(T_cam_centre: FloatArray, inverse_depth: float, intrinsics: Intrinsics) -> FloatArray:
    """Map pixels of the middle frame to pixels of another one, shape (3, 3), for points on the plane Z = 1/d.

    Args:
        T_cam_centre: pose of the middle camera in the other one, shape (4, 4).
        inverse_depth: d of the plane, 1/m, in the middle camera; 0 is the plane at infinity.
        intrinsics: of both images.
    """
    homography = T_cam_centre[:3, :3].copy()
    homography[:, 2] += inverse_depth * T_cam_centre[:3, 3]
    return intrinsics.matrix @ homography @ intrinsics.inverse_matrix


def estimate_flow(
    frames: Sequence[Float32Array],
    times: Sequence[float],
    intrinsics: Intrinsics,
    homographies: tuple[FloatArray, FloatArray] | None = None,
    warp_inverse_depth: float = 0.0,
    settings: FlowSettings | None = None,
    scratch: Scratch | None = None,
    row_maps: tuple[PixelMap, PixelMap] | None = None,
    noise_share: float = 1.0,
) -> Flow:
    """Estimate the flow at the middle one of three frames.

    Args:
        frames: three grey images of shape (H, W), float32, 0..255; see ``prepare_grey``.
        times: of the frames, increasing, s.
        intrinsics: of the frames.
        homographies: maps from pixels of the middle frame to the first and to the last one, shape (3, 3); see
            ``plane_homography``. None: no warp.
        warp_inverse_depth: d of the plane in ``homographies``, only recorded.
        settings: resolutions and noise; None for the defaults.
        scratch: work arrays to reuse from frame to frame, which is about twice as fast; None for new ones.
        row_maps: of a rolling shutter, in place of ``homographies``, which then say what all rows at once would have
            shown; see ``rolling_shutter``. The residual is of every row's own camera.
        noise_share: ``Flow.noise_share`` of the pictures before.
    """
    settings, scratch = settings or _DEFAULTS, scratch or Scratch()
    smooth, change = scratch.get("filtered in time", 2, *frames[1].shape)
    seen = _warped(frames, row_maps or homographies, scratch)
    gains = relative_gain(seen[1], seen[0]), relative_gain(seen[1], seen[2])
    _filter_in_time((without_gain(seen[0], gains[0]), seen[1], without_gain(seen[2], gains[1])), smooth, change)
    dark = is_dark(seen[1])
    noise = settings.dark_noise_std if dark else settings.image_noise_std
    sums = gradient_sums(smooth, change, noise, settings, settings.levels, scratch, noise_share)
    cov, residual = solve(sums)
    warp = homographies or (np.eye(3), np.eye(3))
    overlap = _overlap(warp, intrinsics)
    imperfect, noise_share = take_own_noise(sums, cov, residual, overlap, settings, dark or gains != (1.0, 1.0))
    return Flow(
        time=times[1],
        valid=True,
        intrinsics=flow_grid(intrinsics),
        period=0.5 * (times[2] - times[0]),
        residual=residual,
        residual_cov=cov,
        information=sums[:3],
        gradient=sums[3:5],
        imperfect=imperfect,
        noise_share=noise_share,
        warp_inverse_depth=warp_inverse_depth,
        overlap=overlap,
        warp=warp,
        frame_intrinsics=intrinsics,
    )


def _warped(
    frames: Sequence[Float32Array],
    maps: tuple[FloatArray, FloatArray] | tuple[PixelMap, PixelMap] | None,
    scratch: Scratch,
) -> tuple[Float32Array, Float32Array, Float32Array]:
    """The frames as seen from the middle one, each of shape (H, W)."""
    first, middle, last = frames
    height, width = middle.shape
    if maps is not None:
        warped = scratch.get("warped", 2, height, width)
        flags, border = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, cv2.BORDER_REPLICATE
        for frame, to_frame, out in zip((first, last), maps, warped, strict=True):
            if isinstance(to_frame, tuple):
                cv2.remap(frame, *to_frame, cv2.INTER_LINEAR, dst=out, borderMode=border)
            else:
                cv2.warpPerspective(frame, to_frame, (width, height), dst=out, flags=flags, borderMode=border)
        first, last = warped
    return first, middle, last


def _filter_in_time(
    frames: tuple[Float32Array, Float32Array, Float32Array], smooth: Float32Array, change: Float32Array
) -> None:
    """Write mean and derivative over time of frames, each of shape (H, W)."""
    first, middle, last = frames
    outer, centre, slope = TIME_PREFILTER[0], TIME_PREFILTER[1], TIME_DERIVATIVE[2]
    cv2.addWeighted(first, float(outer), last, float(outer), 0.0, dst=smooth)
    cv2.scaleAdd(middle, float(centre), smooth, dst=smooth)
    cv2.addWeighted(last, float(slope), first, -float(slope), 0.0, dst=change)


@lru_cache(maxsize=8)
def _grid_in_frame(intrinsics: Intrinsics) -> tuple[Float32Array, Float32Array]:
    """Pixel coordinates of the flow grid in the frames: columns (w,) and rows (h,); read-only."""
    grid = flow_grid(intrinsics)
    columns = (np.arange(grid.width) + 0.5) * (intrinsics.width / grid.width) - 0.5
    rows = (np.arange(grid.height) + 0.5) * (intrinsics.height / grid.height) - 0.5
    axes = columns.astype(np.float32), rows.astype(np.float32)
    for axis in axes:
        axis.setflags(write=False)
    return axes


def _warp_motion(maps: tuple[FloatArray, FloatArray], intrinsics: Intrinsics) -> Float32Array:
    """Motion that the warp took out, shape (2, h, w), px of the grid per interval."""
    columns, rows = _grid_in_frame(intrinsics)
    motion = np.zeros((2, rows.size, columns.size), np.float32)
    scale = 0.5 * columns.size / intrinsics.width, 0.5 * rows.size / intrinsics.height
    for homography, sign in zip(maps, (-1.0, 1.0), strict=True):
        h = homography / homography[2, 2]
        h[:2] *= np.array([[sign * scale[0]], [sign * scale[1]]])
        h = h.astype(np.float32)
        along, down = h[:, :1] * columns, h[:, 1:2] * rows + h[:, 2:]
        depth = np.reciprocal(along[2] + down[2][:, None])
        for axis in range(2):
            position = along[axis] + down[axis][:, None]
            position *= depth
            motion[axis] += position
    return motion


def _overlap(maps: tuple[FloatArray, FloatArray], intrinsics: Intrinsics) -> MaskArray:
    """Pixels of the grid whose windows lie inside all frames, shape (h, w).

    A map takes the inside of a frame to a convex quadrangle. Its sides are lines a column + b row + c = 0; those that
    no corner of the grid lies beyond need no look at the pixels, and most do not.
    """
    columns, rows = _grid_in_frame(intrinsics)
    margin = WINDOW + SPACE_PREFILTER.size // 2 - 1
    inner = margin // 2
    overlap = np.zeros((rows.size, columns.size), np.bool_)
    part = overlap[inner:-inner, inner:-inner]
    columns, rows = columns[inner:-inner], rows[inner:-inner]
    if not part.size:
        return overlap
    part[...] = True
    (left, right), (top, bottom) = columns[[0, -1]].tolist(), rows[[0, -1]].tolist()
    sides = _frame_sides(intrinsics, margin)
    for homography in maps:
        for a, b, c in (sides @ homography).tolist():
            if max(a * left, a * right) + max(b * top, b * bottom) + c >= 0.0:
                part &= np.less(np.float32(a) * columns, (np.float32(-b) * rows - np.float32(c))[:, None])
    return overlap


@lru_cache(maxsize=8)
def _frame_sides(intrinsics: Intrinsics, margin: int) -> FloatArray:
    """Lines s, shape (5, 3): a homogeneous pixel p = (u, v, n) is in front and inside the frame if all s @ p < 0."""
    x, y = 0.5 * intrinsics.width - margin, 0.5 * intrinsics.height - margin
    cx, cy = intrinsics.cx, intrinsics.cy
    return np.array([[0, 0, -1], [1, 0, -cx - x], [-1, 0, cx - x], [0, 1, -cy - y], [0, -1, cy - y]], np.float64)


_DEFAULTS = FlowSettings()
