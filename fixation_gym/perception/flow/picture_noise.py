"""How noisy the pictures are: what the motion of every window leaves unexplained, against what is assumed."""

from __future__ import annotations

import cv2
import numpy as np

from fixation_gym.perception.flow import kernels
from fixation_gym.perception.flow.gradients import FlowSettings
from fixation_gym.perception.scratch import Float32Array
from fixation_gym.types import MaskArray

_LEAST_WINDOWS = 500
"""Fewer windows say nothing about the noise of a picture."""
_MUCH_NOISE = 1.6
"""Variance of the noise, relative to the assumed one, from which on it counts: small pictures of the usual noise, moved
fast, have up to 1.5."""
_PLAIN = 0.25
"""Windows with the least unexplained, as a share of all: in them it is noise alone, and no error of the motion."""
_SKIPPED = 3
"""Every third window along each side is enough for that."""
_NOISE_PX = 7
"""Side of the square over which the noise of windows is averaged, px of the grid."""


def take_own_noise(
    sums: Float32Array,
    cov: Float32Array,
    motion: Float32Array,
    overlap: MaskArray,
    settings: FlowSettings,
    suspect: bool,
) -> tuple[bool, float]:
    """Measure the noise of these pictures, as what the motion leaves unexplained.

    Pictures that are as good as assumed keep their covariance. In others every window has its own where that is
    larger: compression is not the same everywhere, and clipped pixels do not change as the others do.

    Args:
        sums: of the gradients, shape (6, h, w); changed in place.
        cov: of the motion, shape (3, h, w); changed in place.
        motion: shape (2, h, w).
        overlap: windows inside all frames, shape (h, w).
        settings: what is assumed.
        suspect: whether they are dark or a gain was taken out.

    Returns:
        Whether there is more noise than assumed, and its variance as a share of the assumed one, at most 1.
    """
    ratio = noise_ratio(sums, motion, settings)
    windows = int(np.count_nonzero(overlap))
    # More than half of them: the median, for a tenth of its time.
    noisy = int(np.count_nonzero((ratio > np.float32(_MUCH_NOISE)) & overlap))
    imperfect = suspect or (windows >= _LEAST_WINDOWS and 2 * noisy > windows)
    if imperfect:
        factor = np.maximum(cv2.blur(ratio, (_NOISE_PX, _NOISE_PX)), np.float32(1.0))
        cov *= factor
        sums /= factor
    return imperfect, _noise_share(ratio) if windows >= _LEAST_WINDOWS else 1.0


def _noise_share(ratio: Float32Array) -> float:
    """Variance of the noise of plain windows, relative to what is assumed, at most 1; ``ratio`` as ``noise_ratio``."""
    some = ratio[::_SKIPPED, ::_SKIPPED].ravel()
    place = int(_PLAIN * some.size)
    return min(float(np.partition(some, place)[place]), 1.0)


def noise_ratio(sums: Float32Array, motion: Float32Array, settings: FlowSettings) -> Float32Array:
    """Variance of what the motion leaves unexplained, relative to what is assumed of noise and model, shape (h, w).

    Args:
        sums: J_xx, J_xy, J_yy, b_x, b_y, e, shape (6, h, w).
        motion: -J^-1 b, shape (2, h, w).
        settings: of the noise.
    """
    # A window has 4 WINDOW^2 pixels; two numbers of motion and one of brightness were fitted to them.
    freedom = (4 * kernels.WINDOW**2 - 3) / settings.noise_correlation
    left = sums[5] + sums[3] * motion[0] + sums[4] * motion[1]
    return np.maximum(left, np.float32(0.0)) / np.float32(freedom)
