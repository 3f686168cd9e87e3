"""Optic flow with covariance from spatio-temporal gradients of three frames.

Matched derivative filters (Simoncelli & Farid 1997: 5 taps in space, 3 in time), made "unit": a ramp of slope 1 has
derivative 1 in x, y and t alike, so that unequal lengths do not shorten the flow. Windows are solved as in Simoncelli,
Adelson & Heeger 1991, u = -J^-1 b with Cov = J^-1, without their prior, which would shorten the flow by 8-10 %.

The outer two frames are first warped onto the middle one as if everything lay in the fixated plane. This takes out
rotation and the motion of the fixated point exactly; only the residual of other depths is left to differentiate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.types import FloatArray, MaskArray

Float32Array = NDArray[np.float32]


def _unit_filters(prefilter: Sequence[float], derivative: Sequence[float]) -> tuple[Float32Array, Float32Array]:
    """Complete the left halves (prefilter with its centre) and scale: sum of p = 1, slope of d = 1."""
    p = np.array([*prefilter, *prefilter[-2::-1]])
    d = np.array([*derivative, 0.0, *[-tap for tap in reversed(derivative)]])
    offsets = np.arange(d.size) - d.size // 2
    return (p / p.sum()).astype(np.float32), (d / (d @ offsets)).astype(np.float32)


SPACE_PREFILTER, SPACE_DERIVATIVE = _unit_filters((0.036420, 0.248972, 0.429217), (-0.108415, -0.280353))
TIME_PREFILTER, TIME_DERIVATIVE = _unit_filters((0.223755, 0.552490), (-0.453014,))


@dataclass(frozen=True, slots=True)
class FlowSettings:
    """Resolution, windows and noise of the flow."""

    max_width: int = 320
    """Images wider than this are halved until they are not, px; the flow grid is half of that."""
    illumination_window: int = 15
    """Brightness that varies more slowly than over this length is ignored, px of the frames."""
    window: int = 5
    """Side of the square over which gradients are pooled, px of the flow grid."""
    levels: int = 3
    """Resolutions in steps of two; a coarse one replaces a finer one where the motion is too large for it."""
    max_displacement: float = 1.2
    """Largest residual motion trusted at a level, px of its frames per frame interval."""
    image_noise_std: float = 2.0
    """Temporal noise of the frames, grey levels (0..255)."""
    motion_noise_std: float = 0.05
    """Departure of single pixels from the window's common motion (interpolation, aliasing), px per interval."""
    noise_correlation: float = 5.0
    """Neighbouring pixels per independent sample: the prefilters correlate the noise of neighbours."""


@dataclass(frozen=True, slots=True, eq=False)
class Flow:
    """Flow at the centre of three frames, on a grid of half their size: shape (h, w), camera ``intrinsics``.

    All lengths in px are px of this grid; an interval is ``period``.
    """

    time: float
    """Time of the filter centre, which is the middle frame, s."""
    valid: bool
    """False until three consecutive frames have arrived; then all arrays are NaN."""
    intrinsics: Intrinsics
    """Camera of the grid; its width and height are w and h."""
    flow: Float32Array
    """Image motion (x, y), shape (h, w, 2), px/s; NaN where the frames do not overlap."""
    cov: Float32Array
    """Entries xx, xy, yy of the covariance of ``flow``, shape (h, w, 3), (px/s)^2; huge where nothing is known."""
    period: float
    """Mean frame interval, s."""
    residual: Float32Array
    """Motion beyond the warp, shape (2, h, w), px per interval."""
    residual_cov: Float32Array
    """Entries xx, xy, yy of its covariance J^-1, shape (3, h, w), px^2 per interval^2."""
    information: Float32Array
    """Entries xx, xy, yy of the windowed information J, shape (3, h, w)."""
    gradient: Float32Array
    """Windowed products b of image and temporal gradient, shape (2, h, w): residual = -J^-1 b."""
    warp_inverse_depth: float
    """Inverse depth 1/m of the plane whose motion the warp took out; 0 for rotation only."""
    overlap: MaskArray
    """Pixels whose windows lie inside all three frames, shape (h, w)."""


def invalid_flow(time: float, frame_intrinsics: Intrinsics) -> Flow:
    """Return the flow of a frame that lacks neighbours: all NaN."""
    grid = flow_grid(frame_intrinsics)
    shape = (grid.height, grid.width)
    nan = np.full((3, *shape), np.nan, np.float32)
    overlap = np.zeros(shape, np.bool_)
    public = np.moveaxis(nan, 0, -1)
    return Flow(time, False, grid, public[..., :2], public, np.nan, nan[:2], nan, nan, nan[:2], 0.0, overlap)


def flow_grid(frame_intrinsics: Intrinsics) -> Intrinsics:
    """Camera of the flow grid: half the resolution of the frames."""
    return frame_intrinsics.scaled(frame_intrinsics.height // 2, frame_intrinsics.width // 2)


def plane_homography(T_cam_centre: FloatArray, inverse_depth: float, intrinsics: Intrinsics) -> FloatArray:
    """Map pixels of the middle frame to pixels of another one, shape (3, 3), for points on the plane Z = 1/d.

    Args:
        T_cam_centre: pose of the middle camera in the other one, shape (4, 4).
        inverse_depth: d of the plane, 1/m, in the middle camera; 0 is the plane at infinity.
        intrinsics: of both images.
    """
    homography = T_cam_centre[:3, :3].copy()
    homography[:, 2] += inverse_depth * T_cam_centre[:3, 3]
    return intrinsics.matrix @ homography @ np.linalg.inv(intrinsics.matrix)


def estimate_flow(
    frames: Sequence[Float32Array],
    times: Sequence[float],
    intrinsics: Intrinsics,
    homographies: tuple[FloatArray, FloatArray] | None = None,
    warp_inverse_depth: float = 0.0,
    settings: FlowSettings | None = None,
) -> Flow:
    """Estimate the flow at the middle one of three frames.

    Args:
        frames: three grey images of shape (H, W), float32, 0..255.
        times: of the frames, increasing, s.
        intrinsics: of the frames.
        homographies: maps from pixels of the middle frame to the first and to the last one, shape (3, 3); see
            ``plane_homography``. None: no warp.
        warp_inverse_depth: d of the plane in ``homographies``, only recorded.
        settings: windows and noise; None for the defaults.
    """
    settings = settings or FlowSettings()
    maps = homographies or (np.eye(3), np.eye(3))
    first, middle, last = frames
    if homographies is not None:
        first, last = _warp(first, maps[0]), _warp(last, maps[1])
    smooth = TIME_PREFILTER[0] * (first + last) + TIME_PREFILTER[1] * middle
    change = TIME_DERIVATIVE[2] * (last - first)
    sums = _gradient_sums(smooth, change, settings.image_noise_std, settings, settings.levels)
    cov = _invert(sums[:3])
    residual = _solve(cov, sums[3:])
    motion, overlap = _warp_motion(maps, intrinsics, settings)
    period = 0.5 * (times[2] - times[0])
    flow = np.moveaxis(residual + motion, 0, -1) / np.float32(period)
    flow[~overlap] = np.nan
    return Flow(
        time=times[1],
        valid=True,
        intrinsics=flow_grid(intrinsics),
        flow=flow,
        cov=np.moveaxis(cov, 0, -1) / np.float32(period**2),
        period=period,
        residual=residual,
        residual_cov=cov,
        information=sums[:3],
        gradient=sums[3:],
        warp_inverse_depth=warp_inverse_depth,
        overlap=overlap,
    )


def _warp(image: Float32Array, homography: FloatArray) -> Float32Array:
    """Image seen from the middle frame."""
    height, width = image.shape
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    warped = cv2.warpPerspective(image, homography, (width, height), flags=flags, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(warped, np.float32)


def _warp_motion(
    maps: tuple[FloatArray, FloatArray], intrinsics: Intrinsics, settings: FlowSettings
) -> tuple[Float32Array, MaskArray]:
    """Motion that the warp took out, shape (2, h, w), px of the grid per interval, and where the frames overlap."""
    grid = flow_grid(intrinsics)
    columns = ((np.arange(grid.width) + 0.5) * (intrinsics.width / grid.width) - 0.5).astype(np.float32)
    rows = ((np.arange(grid.height) + 0.5) * (intrinsics.height / grid.height) - 0.5).astype(np.float32)
    margin = settings.window + SPACE_PREFILTER.size // 2 - 1
    overlap = np.zeros((grid.height, grid.width), np.bool_)
    inner = margin // 2
    overlap[inner:-inner, inner:-inner] = True
    positions = []
    for homography in maps:
        h = (homography / homography[2, 2]).astype(np.float32)
        u, v, n = (h[i, 0] * columns + (h[i, 1] * rows + h[i, 2])[:, None] for i in range(3))
        u, v = u / n, v / n
        overlap &= (np.abs(u - intrinsics.cx) < 0.5 * intrinsics.width - margin) & (
            np.abs(v - intrinsics.cy) < 0.5 * intrinsics.height - margin
        )
        positions.append(np.stack([u, v]))
    scale = np.array([grid.width / intrinsics.width, grid.height / intrinsics.height], np.float32)
    return (positions[1] - positions[0]) * (0.5 * scale[:, None, None]), overlap


def _gradient_sums(
    smooth: Float32Array, change: Float32Array, noise_std: float, settings: FlowSettings, levels: int
) -> Float32Array:
    """Windowed sums J_xx, J_xy, J_yy, b_x, b_y on the half-size grid, shape (5, h, w), in its px.

    Where the next coarser level sees a motion too large for this level, its sums are taken instead.
    """
    sums = _level_sums(smooth, change, noise_std, settings)
    height, width = smooth.shape
    half = (width // 2, height // 2)
    if levels == 1 or min(half) < 8 * settings.window:
        return sums
    # Averaging 2x2 pixels halves white noise; the model noise, in px of the level, stays.
    small_smooth, small_change = (
        np.asarray(cv2.resize(image, half, interpolation=cv2.INTER_AREA), np.float32) for image in (smooth, change)
    )
    coarse = _gradient_sums(small_smooth, small_change, 0.5 * noise_std, settings, levels - 1)
    motion_x, motion_y = _solve(_invert(coarse[:3]), coarse[3:])
    # A motion of m px of these frames is m / 4 px of the coarser level's grid.
    fast = motion_x * motion_x + motion_y * motion_y > (0.25 * settings.max_displacement) ** 2
    if not fast.any():
        return sums
    select = cv2.resize(fast.view(np.uint8), half, interpolation=cv2.INTER_NEAREST).view(np.bool_)
    for plane, coarse_plane, scale in zip(sums, coarse, (0.25, 0.25, 0.25, 0.5, 0.5), strict=True):
        enlarged = np.asarray(cv2.resize(coarse_plane, half, interpolation=cv2.INTER_LINEAR), np.float32)
        np.copyto(plane, np.float32(scale) * enlarged, where=select)
    return sums


def _level_sums(smooth: Float32Array, change: Float32Array, noise_std: float, settings: FlowSettings) -> Float32Array:
    """Windowed gradient products of one level, shape (5, h, w), weighted so that J is the information."""
    border = cv2.BORDER_REPLICATE
    ix = cv2.sepFilter2D(smooth, cv2.CV_32F, SPACE_DERIVATIVE, SPACE_PREFILTER, borderType=border)
    iy = cv2.sepFilter2D(smooth, cv2.CV_32F, SPACE_PREFILTER, SPACE_DERIVATIVE, borderType=border)
    it = cv2.sepFilter2D(change, cv2.CV_32F, SPACE_PREFILTER, SPACE_PREFILTER, borderType=border)
    noise_gain = float((SPACE_PREFILTER**2).sum() ** 2 * (TIME_DERIVATIVE**2).sum())
    noise = np.float32(settings.noise_correlation * noise_gain * noise_std**2)
    model = np.float32(settings.noise_correlation * settings.motion_noise_std**2)
    xx, yy = ix * ix, iy * iy
    weight = 1.0 / (model * (xx + yy) + noise)
    wx, wy = weight * ix, weight * iy
    half = (smooth.shape[1] // 2, smooth.shape[0] // 2)
    window = (settings.window, settings.window)
    # Noise alone gives gradients; their mean energy is taken out, else plain surfaces would seem to stand still.
    own = (SPACE_DERIVATIVE**2).sum() * (SPACE_PREFILTER**2).sum() * (TIME_PREFILTER**2).sum() * noise_std**2
    floor = weight * np.float32(own)
    sums = np.empty((5, half[1], half[0]), np.float32)
    # Four pixels per pixel of the grid; a gradient per px of the grid is twice that per px of the frame.
    products = ((wx * ix - floor, 16), (wx * iy, 16), (wy * iy - floor, 16), (wx * it, 8), (wy * it, 8))
    for plane, (product, scale) in enumerate(products):
        pooled = cv2.resize(product, half, interpolation=cv2.INTER_AREA)
        sums[plane] = cv2.boxFilter(pooled, cv2.CV_32F, window, normalize=False, borderType=border)
        sums[plane] *= np.float32(scale)
    # What is left on a plain surface scatters by about a third of the energy taken out; no less is ever stated.
    least = np.float32(0.3 * own / noise * 16 * settings.window**2)
    np.maximum(sums[0], least, out=sums[0])
    np.maximum(sums[2], least, out=sums[2])
    return sums


def _invert(information: Float32Array) -> Float32Array:
    """Inverse of symmetric matrices given by xx, xy, yy, shape (3, ...); a very weak prior keeps it finite.

    Along an edge the information may be 0; float32 needs the prior to be 1e-5 of the trace there.
    """
    xx, xy, yy = information
    prior = _WEAK + np.float32(1e-5) * (xx + yy)
    determinant = np.maximum(xx * yy - xy * xy, np.float32(0.0)) + prior * (xx + yy + prior)
    xx, yy, scale = xx + prior, yy + prior, 1.0 / determinant
    return np.stack([yy * scale, -xy * scale, xx * scale])


def _solve(cov: Float32Array, gradient: Float32Array) -> Float32Array:
    """Motion -J^-1 b, shape (2, ...), from the entries of J^-1 and b."""
    x, y = gradient
    return -np.stack([cov[0] * x + cov[1] * y, cov[1] * x + cov[2] * y])


_WEAK = np.float32(1e-4)
"""Prior information about the residual, (px/interval)^-2: a standard deviation of 100 px."""
