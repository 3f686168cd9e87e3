"""Compiled loops for the flow, and the switch for all compiled loops; optional.

Every kernel here and in ``pixel_kernels`` does in one pass what the plain code of the same stage does in dozens; the
results agree within float32 rounding. Without numba, or with ``enabled`` set to False, the plain code runs. The machine
code is made at the first call and cached on disk beside the source, or else in numba's cache directory.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

try:
    import numba
except ImportError:
    numba = None

WINDOW = 5
"""Side of the windows of ``window_sums``; others are for the plain code."""
enabled: bool = numba is not None
"""Whether the kernels are used; may be set to False at any time."""


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile at the first call. Sums may be reordered and multiply-adds fused; NaN and inf keep their meaning."""
    if numba is None:
        return function
    options = {"nogil": True, "fastmath": {"contract", "reassoc", "nsz", "arcp"}, "error_model": "numpy"}
    try:
        return numba.njit(cache=True, **options)(function)
    except RuntimeError:  # no place on disk to cache in
        return numba.njit(**options)(function)


@compiled
def _rows_around(image, row):
    """The row, the two above and the two below; the border is repeated."""
    last = image.shape[0] - 1
    return (
        image[max(row - 2, 0)],
        image[max(row - 1, 0)],
        image[row],
        image[min(row + 1, last)],
        image[min(row + 2, last)],
    )


@compiled
def _repeat_border(line):
    """Fill the two border pixels at each end of a line."""
    line[0] = line[1] = line[2]
    line[-1] = line[-2] = line[-3]


@compiled
def pooled_products(smooth, change, prefilter, derivative, noise, pooled):
    """Weighted products xx, xy, yy, xt, yt of gradients, gradients x, y, t and weights, pooled over 2 x 2 pixels.

    See ``gradients``.

    Args:
        smooth: frames averaged over time, shape (H, W), H and W even.
        change: their derivative by time, shape (H, W).
        prefilter: 5 symmetric taps.
        derivative: 5 antisymmetric taps.
        noise: variances of motion and of the temporal derivative, energy of the spatial derivatives of noise.
        pooled: result, shape (9, H // 2, W // 2).
    """
    height, width = smooth.shape
    model, temporal, own = noise[0] / np.float32(16), noise[1] / np.float32(16), noise[2]
    p0, p1, p2, d0, d1 = prefilter[0], prefilter[1], prefilter[2], derivative[3], derivative[4]
    lines = np.empty((3, width + 4), np.float32)
    s, y, t = lines[0], lines[1], lines[2]  # filtered along the column: smoothed, by y, by time
    products = np.zeros((9, width), np.float32)
    xx, xy, yy, xt, yt = products[0], products[1], products[2], products[3], products[4]
    sx, sy, st, sw = products[5], products[6], products[7], products[8]
    for row in range(height):
        a, b, c, d, e = _rows_around(smooth, row)
        for i in range(width):
            s[i + 2] = p2 * c[i] + p1 * (b[i] + d[i]) + p0 * (a[i] + e[i])
            y[i + 2] = d0 * (d[i] - b[i]) + d1 * (e[i] - a[i])
        a, b, c, d, e = _rows_around(change, row)
        for i in range(width):
            t[i + 2] = p2 * c[i] + p1 * (b[i] + d[i]) + p0 * (a[i] + e[i])
        _repeat_border(s)
        _repeat_border(y)
        _repeat_border(t)
        keep = np.float32(row % 2)  # the second row of a pair adds to the first
        for i in range(width):
            gx = d0 * (s[i + 3] - s[i + 1]) + d1 * (s[i + 4] - s[i])
            gy = p2 * y[i + 2] + p1 * (y[i + 1] + y[i + 3]) + p0 * (y[i] + y[i + 4])
            gt = p2 * t[i + 2] + p1 * (t[i + 1] + t[i + 3]) + p0 * (t[i] + t[i + 4])
            gxx, gyy = gx * gx, gy * gy
            weight = np.float32(0.25) / (model * (gxx + gyy) + temporal)
            wx, wy, wt = weight * gx, weight * gy, np.float32(0.5) * weight * gt
            xx[i] = keep * xx[i] + weight * (gxx - own)
            xy[i] = keep * xy[i] + wx * gy
            yy[i] = keep * yy[i] + weight * (gyy - own)
            xt[i] = keep * xt[i] + gx * wt
            yt[i] = keep * yt[i] + gy * wt
            sx[i] = keep * sx[i] + wx
            sy[i] = keep * sy[i] + wy
            st[i] = keep * st[i] + wt
            sw[i] = keep * sw[i] + weight
        if row % 2:
            for k in range(9):
                out, line = pooled[k, row // 2], products[k]
                for i in range(width // 2):
                    out[i] = line[2 * i] + line[2 * i + 1]


@compiled
def window_sums(planes, sums):
    """Sums over 5 x 5 windows, the border repeated; planes and sums of shape (n, h, w)."""
    count, height, width = planes.shape
    line = np.empty(width + 4, np.float32)
    for k in range(count):
        for row in range(height):
            a, b, c, d, e = _rows_around(planes[k], row)
            for i in range(width):
                line[i + 2] = a[i] + b[i] + c[i] + d[i] + e[i]
            _repeat_border(line)
            out = sums[k, row]
            for i in range(width):
                out[i] = line[i] + line[i + 1] + line[i + 2] + line[i + 3] + line[i + 4]


@compiled
def centred_sums(windows, least, sums):
    """Products about the means of each window, with at least ``least`` information in every direction.

    See ``gradients``. ``windows``, shape (9, h, w), holds sums as of ``pooled_products``; the result has shape
    (5, h, w).
    """
    height, width = sums.shape[1:]
    for row in range(height):
        sx, sy, st, sw = windows[5, row], windows[6, row], windows[7, row], windows[8, row]
        xx, xy, yy, x, y = sums[0, row], sums[1, row], sums[2, row], sums[3, row], sums[4, row]
        wxx, wxy, wyy = windows[0, row], windows[1, row], windows[2, row]
        wx, wy = windows[3, row], windows[4, row]
        for i in range(width):
            mx, my = sx[i] / sw[i], sy[i] / sw[i]
            a, b, c = wxx[i] - mx * sx[i], wxy[i] - mx * sy[i], wyy[i] - my * sy[i]
            a, c = max(a, least), max(c, least)
            spread = np.sqrt((a - c) * (a - c) + np.float32(4) * b * b)
            lacking = max(least - np.float32(0.5) * (a + c - spread), np.float32(0))
            xx[i], xy[i], yy[i] = a + lacking, b, c + lacking
            x[i], y[i] = wx[i] - mx * st[i], wy[i] - my * st[i]


@compiled
def solve_windows(sums, weak, cov, residual):
    """Invert J = sums[:3] with a weak prior into cov and solve residual = -cov b, b = sums[3:]; see ``gradients``."""
    height, width = sums.shape[1:]
    for row in range(height):
        xx, xy, yy, x, y = sums[0, row], sums[1, row], sums[2, row], sums[3, row], sums[4, row]
        cxx, cxy, cyy, u, v = cov[0, row], cov[1, row], cov[2, row], residual[0, row], residual[1, row]
        for i in range(width):
            prior = weak + np.float32(1e-5) * (xx[i] + yy[i])
            determinant = max(xx[i] * yy[i] - xy[i] * xy[i], np.float32(0))
            scale = np.float32(1) / (determinant + prior * (xx[i] + yy[i] + prior))
            a, b, c = (yy[i] + prior) * scale, -xy[i] * scale, (xx[i] + prior) * scale
            cxx[i], cxy[i], cyy[i] = a, b, c
            u[i] = -(a * x[i] + b * y[i])
            v[i] = -(b * x[i] + c * y[i])


@compiled
def take_coarse_where_fast(coarse, motion, fastest, scales, sums):
    """Replace the sums of a level by those of the next coarser one, enlarged bilinearly, where that sees fast motion.

    Args:
        coarse: sums of the coarser level, shape (5, h, w).
        motion: its motion, shape (2, h, w).
        fastest: square of the fastest motion that the finer level is trusted with, in px of the coarser.
        scales: of the five sums, from px of the coarser level to px of the finer one.
        sums: of the finer level, shape (5, 2 h, 2 w); changed in place.
    """
    count, height, width = coarse.shape
    near, far = np.float32(0.75), np.float32(0.25)
    for row in range(height):
        u, v = motion[0, row], motion[1, row]
        for column in range(width):
            if u[column] * u[column] + v[column] * v[column] <= fastest:
                continue
            for k in range(count):
                plane, scale = coarse[k], scales[k]
                for down in range(2):
                    here, there = plane[row], plane[min(max(row + 2 * down - 1, 0), height - 1)]
                    out = sums[k, 2 * row + down]
                    centre = near * here[column] + far * there[column]
                    for across in range(2):
                        other = min(max(column + 2 * across - 1, 0), width - 1)
                        side = near * here[other] + far * there[other]
                        out[2 * column + across] = scale * (near * centre + far * side)
