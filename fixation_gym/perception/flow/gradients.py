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
    """Resolution and noise of the flow."""

    max_width: int = 320
    """Images wider than this are halved until they are not, px; the flow grid is half of that."""
    levels: int = 3
    """Resolutions in steps of two; a coarse one replaces a finer one where the motion is too large for it."""
    max_displacement: float = 1.8
    """Largest residual motion trusted at a level, px of its frames per frame interval."""
    image_noise_std: float = 2.0
    """Temporal noise of the frames, grey levels (0..255) ..."""
    dark_noise_std: float = 1.0
    """... and of dark ones, which have less of it, but less contrast, too."""
    motion_noise_std: float = 0.05
    """Departure of single pixels from the window's common motion (interpolation, aliasing), px per interval."""
    noise_correlation: float = 5.0
    """Neighbouring pixels per independent sample: the prefilters correlate the noise of neighbours."""


def gradient_sums(
    smooth: Float32Array,
    change: Float32Array,
    noise_std: float,
    settings: FlowSettings,
    levels: int,
    scratch: Scratch,
    noise_share: float = 1.0,
) -> Float32Array:
    """Windowed sums J_xx, J_xy, J_yy, b_x, b_y, e on the half-size grid, shape (6, h, w), in its px.

    Where the next coarser level sees a motion too large for this level, its sums are taken instead.

    Args:
        smooth: frames averaged over time, shape (H, W), grey levels.
        change: their derivative by time, shape (H, W), grey levels per interval.
        noise_std: of one frame, grey levels.
        settings: noise and largest motion.
        levels: resolutions to use, this one included.
        scratch: work arrays.
        noise_share: variance of the noise that these frames have, as a share of ``noise_std`` squared.
    """
    sums = _level_sums(smooth, change, noise_std, settings, scratch, noise_share)
    height, width = smooth.shape
    half = (width // 2, height // 2)
    if levels == 1 or min(half) < 8 * kernels.WINDOW:
        return sums
    # Averaging 2x2 pixels halves white noise; the model noise, in px of the level, stays.
    small = scratch.get("halved", 2, half[1], half[0])
    cv2.resize(smooth, half, dst=small[0], interpolation=cv2.INTER_AREA)
    cv2.resize(change, half, dst=small[1], interpolation=cv2.INTER_AREA)
    coarse = gradient_sums(small[0], small[1], 0.5 * noise_std, settings, levels - 1, scratch, noise_share)
    _, motion = solve(coarse)
    # A motion of m px of these frames is m / 4 px of the coarser level's grid.
    fastest = (0.25 * settings.max_displacement) ** 2
    kernels.take_coarse_where_fast(coarse, motion, np.float32(fastest), _TO_FINER_PX, sums)
    return sums


def _level_sums(
    smooth: Float32Array,
    change: Float32Array,
    noise_std: float,
    settings: FlowSettings,
    scratch: Scratch,
    noise_share: float,
) -> Float32Array:
    """Windowed gradient products of one level, shape (6, h, w), weighted so that J is the information."""
    temporal = settings.noise_correlation * _TEMPORAL_NOISE_GAIN * noise_std**2
    # Noise alone gives gradients; their mean energy is taken out, else plain surfaces would seem to stand still. With
    # more than there is, weak texture would seem to move too much: a table before the target rises above itself.
    own = _SPATIAL_NOISE_GAIN * noise_share * noise_std**2
    shape = smooth.shape[0] // 2, smooth.shape[1] // 2
    pooled, windows = scratch.get("pooled", 10, *shape), scratch.get("windows", 10, *shape)
    sums = np.empty((6, *shape), np.float32)
    # What is left on a plain surface scatters by about a third of the energy taken out; no less is ever stated.
    least = np.float32(0.3 * own / temporal * 16 * kernels.WINDOW**2)
    noise = np.float32(settings.noise_correlation * settings.motion_noise_std**2), np.float32(temporal), np.float32(own)
    kernels.pooled_products(smooth, change, SPACE_PREFILTER, SPACE_DERIVATIVE, noise, pooled)
    kernels.window_sums(pooled, windows)
    kernels.centred_sums(windows, least, sums)
    return sums


def solve(sums: Float32Array) -> tuple[Float32Array, Float32Array]:
    """Motion of every window and its covariance.

    Args:
        sums: J_xx, J_xy, J_yy, b_x, b_y, shape (5 or more, h, w).

    Returns:
        Entries xx, xy, yy of J^-1, shape (3, h, w), and -J^-1 b, shape (2, h, w). A very weak prior keeps them finite:
        along an edge the information may be 0, and float32 needs the prior to be 1e-5 of the trace there.
    """
    cov, motion = np.empty((3, *sums.shape[1:]), np.float32), np.empty((2, *sums.shape[1:]), np.float32)
    kernels.solve_windows(sums, _WEAK, cov, motion)
    return cov, motion


_TEMPORAL_NOISE_GAIN = float((SPACE_PREFILTER**2).sum() ** 2 * (TIME_DERIVATIVE**2).sum())
"""Variance of the temporal derivative of white noise of variance 1."""
_SPATIAL_NOISE_GAIN = float((SPACE_DERIVATIVE**2).sum() * (SPACE_PREFILTER**2).sum() * (TIME_PREFILTER**2).sum())
"""Variance of a spatial derivative of white noise of variance 1."""
_TO_FINER_PX = np.array([0.25, 0.25, 0.25, 0.5, 0.5, 1.0], np.float32)
"""Sums of a coarser level in px of the next finer grid: J falls with the square, b with the length of a pixel; e has no
unit."""
_WEAK = np.float32(1e-4)
"""Prior information about the residual, (px/interval)^-2: a standard deviation of 100 px."""
