"""The compiled loops of perception once more, in plain NumPy and OpenCV: what they must compute, for any size."""

import cv2
import numpy as np
from scipy.special import ndtr

from fixation_gym.perception.detection import colour as colours
from fixation_gym.perception.flow import kernels
from fixation_gym.perception.zero_flow import pixel_kernels, zero_flow
from fixation_gym.perception.zero_flow.evidence_map import CELLS, UNKNOWN


def put_in_place(monkeypatch):
    """Let perception run on the twins."""
    for twin in (pooled_products, window_sums, centred_sums, solve_windows, take_coarse_where_fast):
        monkeypatch.setattr(kernels, twin.__name__, twin)
    monkeypatch.setattr(pixel_kernels, "test_pixels", test_pixels)
    monkeypatch.setattr(zero_flow, "evidence_map", evidence_map)
    monkeypatch.setattr(colours, "_in_colour_range", in_colour_range)


def pooled_products(smooth, change, prefilter, derivative, noise, pooled):
    def filtered(image, along, down):
        return cv2.sepFilter2D(image, cv2.CV_32F, along, down, borderType=cv2.BORDER_REPLICATE)

    x, y = filtered(smooth, derivative, prefilter), filtered(smooth, prefilter, derivative)
    t = np.float32(0.5) * filtered(change, prefilter, prefilter)
    motion, temporal, own = noise
    weight = 1 / (motion / 16 * (x * x + y * y) + temporal / 16)
    products = (x * x - own, x * y, y * y - own, x * t, y * t, x, y, t, np.float32(1), t * t)
    for plane, product in zip(pooled, products, strict=True):
        plane[:] = cv2.resize(weight * product, plane.shape[::-1], interpolation=cv2.INTER_AREA)


def window_sums(planes, sums):
    side = (kernels.WINDOW, kernels.WINDOW)
    for plane, out in zip(planes, sums, strict=True):
        out[:] = cv2.boxFilter(plane, cv2.CV_32F, side, normalize=False, borderType=cv2.BORDER_REPLICATE)


def centred_sums(windows, least, sums):
    x, y, t, weight, squares = windows[5:]
    for plane, (one, other) in enumerate(((x, x), (x, y), (y, y), (x, t), (y, t))):
        sums[plane] = windows[plane] - one * other / weight
    sums[5] = squares - t * t / weight
    xx, xy, yy = sums[0], sums[1], sums[2]
    np.maximum(xx, least, out=xx)
    np.maximum(yy, least, out=yy)
    lacking = np.maximum(least - 0.5 * (xx + yy - np.hypot(xx - yy, 2 * xy)), 0)
    xx += lacking
    yy += lacking


def solve_windows(sums, weak, cov, residual):
    xx, xy, yy, x, y = sums[:5]
    prior = weak + np.float32(1e-5) * (xx + yy)
    # det(J + prior I), where the part of J that rounding may have made negative is 0.
    determinant = np.maximum(xx * yy - xy * xy, 0) + prior * (xx + yy + prior)
    cov[:] = np.stack([yy + prior, -xy, xx + prior]) / determinant
    residual[:] = -(cov[0] * x + cov[1] * y), -(cov[1] * x + cov[2] * y)


def take_coarse_where_fast(coarse, motion, fastest, scales, sums):
    size = sums.shape[:0:-1]
    fast = (np.square(motion).sum(0) > fastest).view(np.uint8)
    fast = cv2.resize(fast, size, interpolation=cv2.INTER_NEAREST).view(bool)
    for plane, out, scale in zip(coarse, sums, scales, strict=True):
        out[fast] = cv2.resize(scale * plane, size, interpolation=cv2.INTER_LINEAR)[fast]


def test_pixels(information, gradient, cov, residual, usable, question, answers, supported, moving):
    q, least = question, np.float32(1e-12)
    gx, gy = q.gx, q.gy[:, None]
    length = np.maximum(gx * gx + gy * gy, least)
    along = np.maximum(gx * gx * information[0] + 2 * gx * gy * information[1] + gy * gy * information[2], least)
    depth = q.warp_inverse_depth - (gx * gradient[0] + gy * gradient[1]) / along
    variance = 1 / along + (q.rotation_noise + q.position_noise * depth * depth) / length
    std, surface = np.sqrt(variance), q.surface_rows[:, None] + q.surface_columns
    extra = (surface <= q.boundary) * q.boundary_variance
    nearer = ndtr((depth - np.maximum(surface, q.boundary)) / np.sqrt(variance + extra))
    supported[:] = usable & (std < q.max_std)
    answers[:] = np.where(supported, depth, np.nan), std, np.where(supported, nearer, 0.5)
    across = gx * residual[1] - gy * residual[0]
    spread = gy * gy * cov[0] - 2 * gx * gy * cov[1] + gx * gx * cov[2]
    spread += length * (q.rotation_noise + q.position_noise * q.warp_inverse_depth**2)
    moving[:] = usable & (across * across > np.maximum(q.moving_gate * spread, q.least_moving * length))


def evidence_map(p_nearer, supported, moving, settings):
    decided = np.where(moving, 1, 2 * p_nearer - 1).astype(np.float32)
    front, behind = np.maximum(decided, 0), np.maximum(-decided, 0)
    seen = (supported | moving).astype(np.float32)
    planes = front, front * front, behind, behind * behind, seen
    front, front_squared, behind, behind_squared, seen = (_on_cells(plane) for plane in planes)
    around = cv2.boxFilter(front, cv2.CV_32F, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
    weight = (around >= np.float32(settings.cell_min_front)) * np.float32(settings.front_weight)
    evidence = weight * front + behind
    mean_decided = (weight * front_squared - behind_squared) / np.maximum(evidence, np.float32(1e-6))
    least = np.float32(settings.cell_min_share)
    known = (seen >= least) & (evidence > np.float32(0.5) * least)
    return np.where(known, np.rint(127.5 + 127.5 * mean_decided), UNKNOWN).astype(np.uint8)


def _on_cells(plane):
    """Means over the cells, one axis after the other: OpenCV has none where one shrinks while the other grows."""
    plane = cv2.resize(plane, (CELLS, plane.shape[0]), interpolation=cv2.INTER_AREA)
    return cv2.resize(plane, (CELLS, CELLS), interpolation=cv2.INTER_AREA)


def in_colour_range(rgb, window, colour, step=1):
    hsv = cv2.cvtColor(rgb[window][::step, ::step], cv2.COLOR_RGB2HSV)
    mask = np.zeros(hsv.shape[:2], np.uint8)
    for low, high in colours._hue_ranges(colour):
        mask |= cv2.inRange(hsv, (low, *colours._least_values(colour), 0), (high, 255, 255, 0))
    return mask & 1
