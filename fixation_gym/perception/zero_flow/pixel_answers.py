"""The arithmetic of the zero-flow test at every pixel: inverse depth along the epipolar line, side, own motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fixation_gym.perception.flow import kernels
from fixation_gym.perception.flow.optic_flow import Flow
from fixation_gym.perception.scratch import Float32Array, fill
from fixation_gym.perception.zero_flow import pixel_kernels
from fixation_gym.types import MaskArray


class PixelQuestion(NamedTuple):
    """What every pixel is tested against; arrays and numbers are float32, lengths px of the grid, times intervals."""

    gx: Float32Array
    """x of the epipolar direction g, shape (w,), px per interval per 1/m."""
    gy: Float32Array
    """y of g, shape (h,)."""
    warp_inverse_depth: np.float32
    """Inverse depth of the plane whose motion was taken out of the flow, 1/m."""
    boundary: np.float32
    """Things with a larger inverse depth are nearer, 1/m ..."""
    boundary_variance: np.float32
    """... known with this variance."""
    surface_rows: Float32Array
    """Inverse depth of the support surface is surface_rows + surface_columns: shape (h,), 1/m ..."""
    surface_columns: Float32Array
    """... and shape (w,). Where it exceeds ``boundary`` it is the boundary, known exactly."""
    max_std: np.float32
    """Largest standard deviation of an inverse depth that counts as evidence, 1/m."""
    moving_gate: np.float32
    """Motion across g is independent above this chi-square ..."""
    least_moving: np.float32
    """... and above this squared motion, px^2."""
    rotation_noise: np.float32
    """Variance of the predicted motion from errors of the camera's rotation, px^2 ..."""
    position_noise: np.float32
    """... and of its position, px^2 for d = 1/m; it grows with d^2."""


class PixelAnswers(NamedTuple):
    """Result of the test; every array has shape (h, w)."""

    inverse_depth: Float32Array
    """1/m; NaN without evidence."""
    inverse_depth_std: Float32Array
    """1/m."""
    p_nearer: Float32Array
    """0.5 without evidence."""
    supported: MaskArray
    """Pixels with evidence."""
    moving: MaskArray
    """Pixels that move off their epipolar line."""


def pixel_answers(flow: Flow, usable: MaskArray, question: PixelQuestion) -> PixelAnswers:
    """Test every pixel.

    Args:
        flow: residual motion and its data, shape (h, w).
        usable: pixels that may have evidence, shape (h, w).
        question: what to test.
    """
    if kernels.enabled:
        answers, masks = np.empty((3, *usable.shape), np.float32), np.empty((2, *usable.shape), np.bool_)
        data = flow.information, flow.gradient, flow.residual_cov, flow.residual
        pixel_kernels.test_pixels(*data, usable, question, answers, masks[0], masks[1])
        return PixelAnswers(answers[0], answers[1], answers[2], masks[0], masks[1])
    length = np.add.outer(question.gy**2, question.gx**2)
    np.maximum(length, _LEAST, out=length)
    inverse_depth, variance = _along(flow, question, length)
    std = np.sqrt(variance)
    supported = std < question.max_std
    supported &= usable
    surface = np.add.outer(question.surface_rows, question.surface_columns)
    variance += (surface <= question.boundary) * question.boundary_variance
    np.sqrt(variance, out=variance)
    np.maximum(surface, question.boundary, out=surface)
    z = inverse_depth - surface
    z /= variance
    p_nearer = normal_distribution(z)
    fill(p_nearer, 0.5, ~supported)
    fill(inverse_depth, np.nan, ~supported)
    moving = _moves_across(flow, question, length) & usable
    return PixelAnswers(inverse_depth, std, p_nearer, supported, moving)


def _along(flow: Flow, question: PixelQuestion, length: Float32Array) -> tuple[Float32Array, Float32Array]:
    """Inverse depth that explains the motion along g and its variance, 1/m and 1/m^2, each of shape (h, w)."""
    j, b = flow.information, flow.gradient
    gx, gy = question.gx, question.gy[:, None]
    information = gx * j[0]
    product = (np.float32(2.0) * gy) * j[1]
    information += product
    information *= gx
    np.multiply(gy * gy, j[2], out=product)
    information += product
    np.maximum(information, _LEAST, out=information)
    inverse_depth = gx * b[0]
    np.multiply(gy, b[1], out=product)
    inverse_depth += product
    inverse_depth /= information
    np.subtract(question.warp_inverse_depth, inverse_depth, out=inverse_depth)
    np.multiply(inverse_depth, inverse_depth, out=product)
    product *= question.position_noise
    product += question.rotation_noise
    product /= length
    variance = np.reciprocal(information, out=information)
    variance += product
    return inverse_depth, variance


def _moves_across(flow: Flow, question: PixelQuestion, length: Float32Array) -> MaskArray:
    """Pixels whose residual motion has a significant component across g; both sides are multiplied by g^2."""
    cov, gx, gy = flow.residual_cov, question.gx, question.gy[:, None]
    across = gx * flow.residual[1]
    product = gy * flow.residual[0]
    across -= product
    across *= across
    variance = gy * cov[0]
    np.multiply(np.float32(2.0) * gx, cov[1], out=product)
    variance -= product
    variance *= gy
    np.multiply(gx * gx, cov[2], out=product)
    variance += product
    np.multiply(length, question.rotation_noise + question.position_noise * question.warp_inverse_depth**2, out=product)
    variance += product
    variance *= question.moving_gate
    np.multiply(length, question.least_moving, out=product)
    return np.greater(across, np.maximum(variance, product, out=variance))


def normal_distribution(z: Float32Array) -> Float32Array:
    """Phi(z) to 2e-7 (Abramowitz & Stegun 1964, 7.1.28) and rounding, float32.

    SciPy's ``ndtr`` would take as long as all the rest of the test.
    """
    x = np.abs(z)
    np.minimum(x, np.float32(8.0), out=x)  # the power below stays finite
    x *= np.float32(np.sqrt(0.5))
    tail = x * _TAIL[-1]
    for coefficient in _TAIL[-2::-1]:
        tail += coefficient
        tail *= x
    tail += np.float32(1.0)
    for _ in range(4):
        tail *= tail
    np.divide(np.float32(0.5), tail, out=tail)  # Phi(-|z|)
    tail -= np.float32(0.5)
    np.copysign(tail, z, out=tail)
    tail += np.float32(0.5)
    return tail


_LEAST = np.float32(1e-12)
"""Keeps information and squared lengths from being 0."""
_TAIL = np.array([0.0705230784, 0.0422820123, 0.0092705272, 0.0001520143, 0.0002765672, 0.0000430638], np.float32)
