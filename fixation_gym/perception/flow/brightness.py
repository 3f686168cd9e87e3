"""How much brighter one picture is than another of the same view: flicker, automatic exposure and white balance.

A change that a whole window shares is no motion (``gradients``), but a gain also scales contrast, and that is taken for
motion where contrast is uneven. Gains are those of the whole picture; what else is there is left to the windows.
"""

from __future__ import annotations

import numpy as np

from fixation_gym.perception.scratch import Float32Array
from fixation_gym.types import MaskArray

_STEP = 6
"""Every such pixel is looked at, along rows and columns, px."""
_DARKEST, _BRIGHTEST = 12.0, 243.0
"""Grey levels of pixels that are neither black nor clipped."""
_LEAST_PIXELS = 50
_DARK = 64.0
"""Mean grey level of a dark picture."""
_LEAST_GAIN = 0.03
"""Gains that differ from 1 by less are none: what moves gives as much ..."""
_SPREADS = 0.5
"""... and by less than so many quartile ranges of the ratios of pixels."""


def is_dark(image: Float32Array) -> bool:
    """Whether a picture, shape (H, W), has little light."""
    return float(image[_STEP // 2 :: _STEP, _STEP // 2 :: _STEP].mean()) < _DARK


def relative_gain(middle: Float32Array, other: Float32Array) -> float:
    """Median ratio of the grey levels of ``other`` to those of ``middle``, each of shape (H, W); 1 if none is sure."""
    part = slice(_STEP // 2, None, _STEP)
    a, b = middle[part, part], other[part, part]
    usable = (np.minimum(a, b) > _DARKEST) & (np.maximum(a, b) < _BRIGHTEST)
    pixels = int(np.count_nonzero(usable))
    if pixels < _LEAST_PIXELS or _surely_near_one(a, b, usable, pixels):
        return 1.0
    low, gain, high = np.percentile(b[usable] / a[usable], [25.0, 50.0, 75.0]).tolist()
    sure = abs(gain - 1.0) > max(_LEAST_GAIN, _SPREADS * (high - low))
    return gain if sure else 1.0


def _surely_near_one(middle: Float32Array, other: Float32Array, usable: MaskArray, pixels: int) -> bool:
    """Whether the median ratio of usable pixels differs by less than the least gain from 1: counting is faster."""
    least = np.float32(0.99 * _LEAST_GAIN)
    above = np.count_nonzero((other > (1 + least) * middle) & usable)
    below = np.count_nonzero((other < (1 - least) * middle) & usable)
    return bool(max(above, below) < pixels // 2 - 1)


def without_gain(image: Float32Array, gain: float) -> Float32Array:
    """A picture, shape (H, W), divided by its gain; itself if that is 1."""
    return image if gain == 1.0 else image / np.float32(gain)
