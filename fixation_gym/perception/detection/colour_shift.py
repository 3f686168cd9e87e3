"""What a colour is, and how this camera shows it: wrong white balance turns hues, little light darkens them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from fixation_gym.types import FloatArray, ImageArray


@dataclass(frozen=True, slots=True)
class Colour:
    """A range of hue, saturation and brightness, and how large and how scattered a target of that colour may be."""

    hue_deg: float
    """Centre of the hue range, degrees in 0..360 (0 = red)."""
    hue_tolerance_deg: float
    """Half width of the hue range, degrees."""
    min_saturation: float
    """Least saturation, 0..1. A pure red seen through a half-transparent grey object keeps about 0.55."""
    min_value: float
    """Least brightness, 0..1; below it hue is noise."""
    merge_gap_fraction: float = 0.04
    """Parts closer than this share of the image width belong to one target: a bar in front may cut it in pieces."""


RED = Colour(hue_deg=0.0, hue_tolerance_deg=16.0, min_saturation=0.45, min_value=0.16)
"""The colour of the target in every scenario."""
_FARTHEST_TURN_DEG = 35.0
"""A hue farther off than this is that of another thing, deg."""
_LEAST_VALUE = 0.04
"""Below this brightness hue is noise, 0..1."""
_BIN_DEG = 5
_NEAR_ENOUGH = 0.5
"""Of the hue tolerance: a target so near to the colour is found as it is."""
_SHADE = 0.4
"""Shaded sides of a thing keep this share of its brightness."""
_DIM = 1.3
"""Of the least brightness: what is commonly less than that much above it is dark for want of light."""
_LEAST_PIXELS = 6


def colour_in_box(rgb: ImageArray, box: FloatArray, colour: Colour) -> Colour:
    """The colour of what a box holds, if it is the expected one but for a shift of hue or little light.

    Args:
        rgb: picture, shape (H, W, 3), uint8.
        box: x, y, width, height around the target, shape (4,), px; all 0: not in the picture.
        colour: that it has by right.

    Returns:
        The same colour if what the box holds is near enough to it, or too unlike to be it.
    """
    x, y, width, height = np.rint(box).astype(int).tolist()
    held = rgb[max(y, 0) : max(y + height, 0), max(x, 0) : max(x + width, 0)]
    if not held.size:
        return colour
    hsv = cv2.cvtColor(np.ascontiguousarray(held, np.float32) / np.float32(255.0), cv2.COLOR_RGB2HSV).reshape(-1, 3)
    off = (hsv[:, 0] - colour.hue_deg + 180.0) % 360.0 - 180.0
    like = (np.abs(off) < _FARTHEST_TURN_DEG) & (hsv[:, 1] >= colour.min_saturation) & (hsv[:, 2] >= _LEAST_VALUE)
    if np.count_nonzero(like) < _LEAST_PIXELS:
        return colour
    bins = np.round(off[like] / _BIN_DEG).astype(int)
    common = np.bincount(bins - bins.min(), weights=hsv[like, 1]).argmax() + bins.min()
    own = np.abs(bins - common) <= 1
    turn, value = float(np.median(off[like][own])), float(np.median(hsv[like, 2][own]))
    shifted = colour
    if abs(turn) > _NEAR_ENOUGH * colour.hue_tolerance_deg:
        shifted = replace(shifted, hue_deg=(colour.hue_deg + turn) % 360.0)
    if value < _DIM * colour.min_value:
        shifted = replace(shifted, min_value=max(_SHADE * value, _LEAST_VALUE))
    return shifted
