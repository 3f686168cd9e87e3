"""Windowed products of image gradients: the data of optic flow, over a pyramid of resolutions.

Matched derivative filters (Simoncelli & Farid 1997: 5 taps in space, 3 in time), made "unit": a ramp of slope 1 has
derivative 1 in x, y and t alike, so that unequal lengths do not shorten the flow.

The products are taken about the means of their window. This is the least-squares fit of a motion and a change of
brightness that the whole window shares: exposure, and highlights and shading that stay in the image while surfaces move
through it, pass for motion otherwise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from fixation_gym.perception.flow import kernels
from fixation_gym.perception.scratch import Float32Array, Scratch


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
    window: int = 5
    """Side of the square over which gradients are pooled, px of the flow grid."""
    levels: int = 3
    """Resolutions in steps of two; a coarse one replaces a finer one where the motion is too large for it."""
    max_displacement: float = 1.8
    """Largest residual motion trusted at a level, px of its frames per frame interval."""
    image_noise_std: float = 2.0
    """Temporal noise of the frames, grey levels (0..255)."""
    motion_noise_std: float = 0.05
    """Departure of single pixels from the window's common motion (interpolation, aliasing), px per interval."""
    noise_correlation: float = 5.0
    """Neighbouring pixels per independent sample: the prefilters correlate the noise of neighbours."""


class _Noise(NamedTuple):
    """What noise does to the derivatives of one level."""

    motion: float
    """Variance of a pixel's own motion, px^2 per interval^2."""
    temporal: float
    """Variance of the temporal derivative."""
    spatial: float
    """Energy of each spatial derivative."""


def gradient_sums(
    smooth: Float32Array,
    change: Float32Array,
    noise_std: float,
    settings: FlowSettings,
    levels: int,
    scratch: Scratch,
) -> Float32Array:
    """Windowed sums J_xx, J_xy, J_yy, b_x, b_y on the half-size grid, shape (5, h, w), in its px.

    Where the next coarser level sees a motion too large for this level, its sums are taken instead.

    Args:
        smooth: frames averaged over time, shape (H, W), grey levels.
        change: their derivative by time, shape (H, W), grey levels per interval.
        noise_std: of one frame, grey levels.
        settings: windows and noise.
        levels: resolutions to use, this one included.
        scratch: work arrays.
    """
    sums = _level_sums(smooth, change, noise_std, settings, scratch)
    height, width = smooth.shape
    half = (width // 2, height // 2)
    if levels == 1 or min(half) < 8 * settings.window:
        return sums
    # Averaging 2x2 pixels halves white noise; the model noise, in px of the level, stays.
    small = scratch.get("halved", 2, half[1], half[0])
    cv2.resize(smooth, half, dst=small[0], interpolation=cv2.INTER_AREA)
    cv2.resize(change, half, dst=small[1], interpolation=cv2.INTER_AREA)
    coarse = gradient_sums(small[0], small[1], 0.5 * noise_std, settings, levels - 1, scratch)
    _, motion = solve(coarse)
    # A motion of m px of these frames is m / 4 px of the coarser level's grid.
    fastest = (0.25 * settings.max_displacement) ** 2
    if kernels.enabled and sums.shape == (5, 2 * coarse.shape[1], 2 * coarse.shape[2]):
        kernels.take_coarse_where_fast(coarse, motion, np.float32(fastest), _TO_FINER_PX, sums)
        return sums
    fast = np.square(motion[0]) + np.square(motion[1]) > fastest
    if not fast.any():
        return sums
    select = cv2.resize(fast.view(np.uint8), half, interpolation=cv2.INTER_NEAREST)
    enlarged = scratch.get("enlarged", half[1], half[0])
    for plane, coarse_plane, scale in zip(sums, coarse, _TO_FINER_PX, strict=True):
        cv2.resize(scale * coarse_plane, half, dst=enlarged, interpolation=cv2.INTER_LINEAR)
        cv2.copyTo(enlarged, select, plane)
    return sums


def _level_sums(
    smooth: Float32Array, change: Float32Array, noise_std: float, settings: FlowSettings, scratch: Scratch
) -> Float32Array:
    """Windowed gradient products of one level, shape (5, h, w), weighted so that J is the information."""
    temporal = settings.noise_correlation * _TEMPORAL_NOISE_GAIN * noise_std**2
    # Noise alone gives gradients; their mean energy is taken out, else plain surfaces would seem to stand still.
    own = _SPATIAL_NOISE_GAIN * noise_std**2
    noise = _Noise(settings.noise_correlation * settings.motion_noise_std**2, temporal, own)
    height, width = smooth.shape
    sums, windows = np.empty((5, height // 2, width // 2), np.float32), scratch.get("w", 9, height // 2, width // 2)
    # What is left on a plain surface scatters by about a third of the energy taken out; no less is ever stated.
    least = np.float32(0.3 * own / temporal * 16 * settings.window**2)
    if kernels.enabled and settings.window == kernels.WINDOW and height % 2 == 0 and width % 2 == 0:
        pooled, taps = scratch.get("pooled", *windows.shape), (SPACE_PREFILTER, SPACE_DERIVATIVE)
        kernels.pooled_products(smooth, change, *taps, tuple(np.float32(part) for part in noise), pooled)
        kernels.window_sums(pooled, windows)
        kernels.centred_sums(windows, least, sums)
        return sums
    _plain_window_sums(smooth, change, noise, settings.window, scratch, windows)
    sx, sy, st, sw = windows[5:]
    for plane, (first, second) in enumerate(((sx, sx), (sx, sy), (sy, sy), (sx, st), (sy, st))):
        np.multiply(first, second, out=sums[plane])
        sums[plane] /= sw
        np.subtract(windows[plane], sums[plane], out=sums[plane])
    _raise_information(sums, least)
    return sums


def _raise_information(sums: Float32Array, least: np.float32) -> None:
    """Add what J, sums[:3], lacks to inform by ``least`` in every direction: its smaller eigenvalue is at least that.

    Along a weak edge the noise taken out may exceed what was there; motion along it would seem huge and well known.
    """
    xx, xy, yy = sums[:3]
    np.maximum(xx, least, out=xx)
    np.maximum(yy, least, out=yy)
    spread = np.hypot(xx - yy, np.float32(2.0) * xy)
    lacking = least - np.float32(0.5) * (xx + yy - spread)
    np.maximum(lacking, np.float32(0.0), out=lacking)
    xx += lacking
    yy += lacking


def _plain_window_sums(
    smooth: Float32Array, change: Float32Array, noise: _Noise, window: int, scratch: Scratch, windows: Float32Array
) -> None:
    """Write the windowed products and means of a level to ``windows``, with NumPy and OpenCV."""
    height, width = smooth.shape
    half_height, pad = height // 2, window // 2
    # All planes in one image, apart by repeated border rows: one filter call instead of nine.
    stack = scratch.get("stack", len(windows), half_height + 2 * pad, width // 2)
    pooled = stack[:, pad : pad + half_height]
    for rows in _strips(height, width):
        part = pooled[:, rows.start // 2 : rows.stop // 2]
        _pooled_products(_gradients(smooth, change, rows, scratch), noise, part, scratch)
    stack[:, :pad] = pooled[:, :1]
    stack[:, pad + half_height :] = pooled[:, -1:]
    image, ones = stack.reshape(-1, width // 2), np.ones(window, np.float32)
    filtered = scratch.get("filtered", *stack.shape)
    cv2.sepFilter2D(image, cv2.CV_32F, ones, ones, dst=filtered.reshape(image.shape), borderType=cv2.BORDER_REPLICATE)
    windows[...] = filtered[:, pad : pad + half_height]


def _strips(height: int, width: int) -> list[slice]:
    """Cut an image into strips of even height whose work arrays fit into a processor's cache together.

    Only even sizes can be cut: else the grid's pixels do not meet those of the image in pairs.
    """
    rows = max(8, _STRIP_PIXELS // width // 2 * 2)
    if height % 2 or height <= rows:
        return [slice(0, height)]
    return [slice(start, min(start + rows, height)) for start in range(0, height, rows)]


def _gradients(
    smooth: Float32Array, change: Float32Array, rows: slice, scratch: Scratch
) -> tuple[Float32Array, Float32Array, Float32Array]:
    """Derivatives by x, y and (halved, see ``_pooled_products``) by time in some rows, in scratch."""
    reach, border = SPACE_PREFILTER.size // 2, cv2.BORDER_REPLICATE
    start, stop = max(rows.start - reach, 0), min(rows.stop + reach, smooth.shape[0])
    result = scratch.get("gradients", 3, stop - start, smooth.shape[1])
    x, y, t = result
    smooth, change = smooth[start:stop], change[start:stop]
    cv2.sepFilter2D(smooth, cv2.CV_32F, SPACE_DERIVATIVE, SPACE_PREFILTER, dst=x, borderType=border)
    cv2.sepFilter2D(smooth, cv2.CV_32F, SPACE_PREFILTER, SPACE_DERIVATIVE, dst=y, borderType=border)
    cv2.sepFilter2D(change, cv2.CV_32F, _HALF_PREFILTER, SPACE_PREFILTER, dst=t, borderType=border)
    inner = slice(rows.start - start, rows.stop - start)
    return x[inner], y[inner], t[inner]


def _pooled_products(
    gradients: tuple[Float32Array, Float32Array, Float32Array],
    noise: _Noise,
    pooled: Float32Array,
    scratch: Scratch,
) -> None:
    """Write means over 2 x 2 pixels: weighted products xx, xy, yy, xt, yt, weighted gradients x, y, t and the weight.

    Four pixels make one of the grid, whose gradient per px is twice that of the frame: a factor 16 for J, put into the
    weight. For b it is 8, so the temporal derivative comes halved.

    Args:
        gradients: derivatives by x, y and t, each of shape (H, W); overwritten.
        noise: of the derivatives.
        pooled: the result, shape (9, H // 2, W // 2).
        scratch: work arrays.
    """
    ix, iy, it = gradients
    xx, yy, weight = scratch.get("products", 3, *ix.shape)
    size = (ix.shape[1] // 2, ix.shape[0] // 2)

    def pool(product: Float32Array, plane: int) -> None:
        cv2.resize(product, size, dst=pooled[plane], interpolation=cv2.INTER_AREA)

    np.multiply(ix, ix, out=xx)
    np.multiply(iy, iy, out=yy)
    np.add(xx, yy, out=weight)
    weight *= np.float32(noise.motion / 16)
    weight += np.float32(noise.temporal / 16)
    np.reciprocal(weight, out=weight)
    pool(weight, 8)
    for energy, plane in ((xx, 0), (yy, 2)):
        energy -= np.float32(noise.spatial)
        energy *= weight
        pool(energy, plane)
    xy = np.multiply(ix, iy, out=xx)
    xy *= weight
    pool(xy, 1)
    it *= weight
    pool(it, 7)
    for gradient, plane in ((ix, 3), (iy, 4)):
        pool(np.multiply(gradient, weight, out=xx), plane + 2)
        gradient *= it
        pool(gradient, plane)


def solve(sums: Float32Array) -> tuple[Float32Array, Float32Array]:
    """Motion of every window and its covariance.

    Args:
        sums: J_xx, J_xy, J_yy, b_x, b_y, shape (5, h, w).

    Returns:
        Entries xx, xy, yy of J^-1, shape (3, h, w), and -J^-1 b, shape (2, h, w). A very weak prior keeps them finite:
        along an edge the information may be 0, and float32 needs the prior to be 1e-5 of the trace there.
    """
    cov, motion = np.empty((3, *sums.shape[1:]), np.float32), np.empty((2, *sums.shape[1:]), np.float32)
    if kernels.enabled:
        kernels.solve_windows(sums, _WEAK, cov, motion)
        return cov, motion
    xx, xy, yy, x, y = sums
    by_yy, by_xy, by_xx = cov[0], cov[1], cov[2]
    prior = xx + yy
    prior *= np.float32(1e-5)
    prior += _WEAK
    determinant = xx * yy
    product = xy * xy
    determinant -= product
    np.maximum(determinant, np.float32(0.0), out=determinant)
    np.add(yy, prior, out=by_yy)
    np.add(xx, prior, out=by_xx)
    # det(J + prior I), where the part of J that rounding may have made negative is 0.
    np.add(by_xx, yy, out=product)
    product *= prior
    determinant += product
    np.negative(xy, out=by_xy)
    cov /= determinant
    for row in range(2):
        np.multiply(cov[row], x, out=motion[row])
        np.multiply(cov[row + 1], y, out=product)
        motion[row] += product
    np.negative(motion, out=motion)
    return cov, motion


_TEMPORAL_NOISE_GAIN = float((SPACE_PREFILTER**2).sum() ** 2 * (TIME_DERIVATIVE**2).sum())
"""Variance of the temporal derivative of white noise of variance 1."""
_SPATIAL_NOISE_GAIN = float((SPACE_DERIVATIVE**2).sum() * (SPACE_PREFILTER**2).sum() * (TIME_PREFILTER**2).sum())
"""Variance of a spatial derivative of white noise of variance 1."""
_STRIP_PIXELS = 20480
"""Six float32 arrays of this size take 0.5 MB, half of a usual second-level cache."""
_HALF_PREFILTER = np.float32(0.5) * SPACE_PREFILTER
_TO_FINER_PX = np.array([0.25, 0.25, 0.25, 0.5, 0.5], np.float32)
"""Sums of a coarser level in px of the next finer grid: J falls with the square, b with the length of a pixel."""
_WEAK = np.float32(1e-4)
"""Prior information about the residual, (px/interval)^-2: a standard deviation of 100 px."""
