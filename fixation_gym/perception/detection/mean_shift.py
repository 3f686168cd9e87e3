"""Which of several things of one colour is the target: the one that OpenCV's mean-shift tracker follows in the image.

For comparison with ``tracking``, which knows how the camera moves; this one knows images only. The window of mean shift
climbs to where the most pixels of the colour are; its size is that of the target in the last image, since the approach
enlarges it. Value in, value out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.detection.colour import RED, Colour, colour_mask, coloured_pixels
from fixation_gym.perception.detection.segmentation import segmentation_of
from fixation_gym.perception.detection.tracking import FIRST_LOOK, NOWHERE, Expectation, TrackingSettings
from fixation_gym.types import ImageArray, MaskArray, Observation

_STOP = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 20, 1.0)
"""Mean shift ends after 20 steps, or with one below 1 px."""


_GROWTH = 0.25
"""The window is centred on what it holds. The target's centroid may be off its centre by this share of its diagonal,
because more of the target came into sight; that of two things which touch is farther off."""


@dataclass(frozen=True, slots=True)
class Window:
    """Where in the image the tracker has the target."""

    box: tuple[int, int, int, int]
    """Left column, top row, width and height, px."""
    time: float
    """When it was last seen, s."""


class MeanShiftDetector:
    """Finds the target by its colour where OpenCV's mean shift follows it in the image."""

    def __init__(self, intrinsics: Intrinsics, colour: Colour = RED) -> None:
        """Prepare for images of a camera and a target of a colour."""
        self._intrinsics, self._colour, self._settings = intrinsics, colour, TrackingSettings()
        self.reset()

    def reset(self) -> None:
        """Forget where the target was."""
        self._window: Window | None = None

    def detect(self, observation: Observation, expected: Expectation) -> MaskArray:
        """Pixels of the target, shape (H, W); where the camera's motion expects it is not asked."""
        coloured = coloured_pixels(observation.rgb, self._colour)
        self._window = None if self._window is None else shifted(self._window, coloured)
        place = expected_in(self._window, coloured, self._intrinsics, observation.time, self._settings)
        mask = colour_mask(observation.rgb, self._intrinsics, self._colour, place)
        if segmentation_of(mask, self._intrinsics).visible:
            self._window = window_around(mask, observation.time)
        return mask


def window_around(mask: MaskArray, time: float) -> Window:
    """Note where the visible target is at a time, s; ``mask`` has shape (H, W)."""
    left, top, width, height = cv2.boundingRect(mask.view(np.uint8))
    return Window((left, top, width, height), time)


def shifted(window: Window, coloured: ImageArray) -> Window:
    """The window at the peak of the colour near its place in the last image; the same if no such pixel is in it.

    Args:
        window: at its place in the last image.
        coloured: pixels of the target's colour, 0 or 1, shape (H, W).
    """
    _, (left, top, width, height) = cv2.meanShift(coloured, window.box, _STOP)
    return Window((left, top, width, height), window.time)


def expected_in(
    window: Window | None, coloured: ImageArray, intrinsics: Intrinsics, time: float, settings: TrackingSettings
) -> Expectation:
    """Where an image should show the target.

    Args:
        window: shifted to its place in the image; None before the first sight.
        coloured: pixels of the target's colour, 0 or 1, shape (H, W).
        intrinsics: of the image.
        time: of the image, s.
        settings: how far off it may be, and how long it may be hidden.
    """
    if window is None or time - window.time > settings.forget_s:
        return FIRST_LOOK
    left, top, width, height = window.box
    if not coloured[top : top + height, left : left + width].any():
        # Mean shift is lost. A thing of that colour elsewhere is rather another one than the target so far off.
        return NOWHERE
    x = (left + 0.5 * (width - 1) - intrinsics.cx) / intrinsics.fx
    y = (top + 0.5 * (height - 1) - intrinsics.cy) / intrinsics.fy
    diagonal = math.hypot(width / intrinsics.fx, height / intrinsics.fy)
    return Expectation(np.array([x, y]), settings.slack + _GROWTH * diagonal)
