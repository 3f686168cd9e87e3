"""The arithmetic of the zero-flow test at every pixel: inverse depth along the epipolar line, side, own motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fixation_gym.perception.flow.optic_flow import Flow
from fixation_gym.perception.scratch import Float32Array
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
    answers, masks = np.empty((3, *usable.shape), np.float32), np.empty((2, *usable.shape), np.bool_)
    data = flow.information, flow.gradient, flow.residual_cov, flow.residual
    pixel_kernels.test_pixels(*data, usable, question, answers, masks[0], masks[1])
    return PixelAnswers(answers[0], answers[1], answers[2], masks[0], masks[1])
