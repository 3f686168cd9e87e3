"""Which pixels answer for themselves: the strict question, for who asks about single pixels.

A pixel's motion is that of a window around it, so beside an outline it may be another thing's. A map of coarse cells
and the vote of a whole thing do not mind, but a single pixel does not know its side there. A pixel with evidence
answers only if

- its depth is off the fixated one by more than its standard deviation,
- it is not called behind within a window's reach of something surely in front: the texture behind may be stronger than
  the outline of what is plain and in front (the other way round is ``ZeroFlow.outline``),
- no pixel within the reach of the gradient filters is overexposed: what is white all over has no motion, and a window
  there has that of the frame around it.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from fixation_gym.perception.zero_flow.zero_flow import ZeroFlow
from fixation_gym.types import ImageArray, MaskArray


@dataclass(frozen=True, slots=True)
class AnswerSettings:
    """When a pixel answers."""

    decided_stds: float = 1.0
    """A side is decided if the depth is off the fixated one by so many standard deviations."""
    surely_stds: float = 2.0
    """Something is surely in front if it is nearer than the fixated object by so many."""
    reach_px: int = 6
    """Reach of a window beyond its centre at the second finest resolution, px of the flow grid; it is 3 at the finest
    and 12 at the coarsest, where hardly any pixel takes its motion from."""
    white: float = 250.0
    """From this mean grey level on a pixel of the flow grid is overexposed."""
    filter_px: int = 1
    """Reach of the gradient filters, px of the flow grid."""


def answering_pixels(zero_flow: ZeroFlow, picture: ImageArray, settings: AnswerSettings | None = None) -> MaskArray:
    """Pixels that answer, shape (h, w): some of those that are ``supported``.

    Args:
        zero_flow: the test.
        picture: of the frame that the test is about, shape (H, W, 3) or (H, W), RGB or grey; any size.
        settings: when a pixel answers; None for the defaults.
    """
    settings = settings or AnswerSettings()
    nearness = zero_flow.inverse_depth - np.float32(zero_flow.fixated_inverse_depth)  # NaN without evidence
    std = zero_flow.inverse_depth_std
    with np.errstate(invalid="ignore"):
        decided = np.abs(nearness) > np.float32(settings.decided_stds) * std
        behind = nearness <= 0.0
        surely_front = nearness > np.float32(settings.surely_stds) * std  # outlines, too
    mixed = behind & _widened(surely_front, settings.reach_px)
    white = _widened(_grey_on_grid(picture, std.shape) >= settings.white, settings.filter_px)
    return zero_flow.supported & decided & ~mixed & ~white


def _grey_on_grid(picture: ImageArray, shape: tuple[int, ...]) -> ImageArray:
    """Mean grey levels on the flow's grid, shape (h, w)."""
    grey = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    return np.asarray(cv2.resize(grey, shape[::-1], interpolation=cv2.INTER_AREA), np.uint8)


def _widened(mask: MaskArray, reach: int) -> MaskArray:
    square = np.ones((2 * reach + 1,) * 2, np.uint8)
    return np.asarray(cv2.dilate(mask.view(np.uint8), square), np.uint8).view(np.bool_)
