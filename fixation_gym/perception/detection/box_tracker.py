"""Follow whatever a box in the first image shows, of any colour and texture, by the colours that tell it from the rest.

The first image is cut into target and background (GrabCut, Rother et al. 2004). From then on two histograms say how
much likelier each colour is on the target than around it; the likely pixels near where the target must be are it. Both
histograms follow slowly, since light and background change as the camera goes around.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.detection.first_look import checked_box, cut_out
from fixation_gym.perception.detection.tracking import Expectation
from fixation_gym.types import FloatArray, ImageArray, MaskArray, Observation

_BINS = (8, 32, 32)
"""Bins of L, a and b: a target is told by its hue more than by its brightness, which light changes."""
_SMOOTHING = (1.2, 1.0, 1.0)
"""Standard deviation over which a colour counts for its neighbours, bins."""
_LEAST = 1e-4
"""Share of an unseen colour."""


@dataclass(frozen=True, slots=True)
class BoxTrackerSettings:
    """What counts as the target, and how fast its look may change."""

    surroundings: float = 0.6
    """The background is learnt within this share of the box around it."""
    learning: float = 0.04
    """Share of a new image in the histograms ..."""
    first_look: float = 0.5
    """... and share that the first look keeps for ever: what follows slowly drifts far."""
    extent: float = 2.4
    """The target reaches about so many standard deviations of its pixels from where it is expected."""
    prior: float = 8.0
    """How much likelier a pixel is on the target in its middle than at its end, in natural logarithms."""
    growth: float = 0.005
    """Largest share by which its size changes from one image to the next, beyond what the distance explains."""
    blur_px: int = 3
    """Window over which pixels say together what they are, px at 320 columns."""
    merge_gap_fraction: float = 0.015
    """Parts closer than this share of the image width belong together."""
    least_share: float = 0.5
    """What is smaller than this share of its size is not learnt from: something covers the target."""


class BoxTracker:
    """Follows the thing that ``target_box`` of the first observation names. State: the look of it and of the rest."""

    def __init__(self, intrinsics: Intrinsics, settings: BoxTrackerSettings | None = None) -> None:
        """Prepare for the images of a camera."""
        self._intrinsics, self._settings = intrinsics, settings or BoxTrackerSettings()
        self.reset()

    def reset(self) -> None:
        """Forget what the target looks like."""
        self._target: FloatArray | None = None
        self._background = np.zeros(_BINS)
        self._sizes = (0.0, 0.0)  # when last seen: of the target, as far as it may have grown, and of its mask

    def detect(self, observation: Observation, expected: Expectation) -> MaskArray:
        """Pixels of the target, shape (H, W).

        Raises:
            ValueError: if the first observation has no box, or one that lies outside the image or around nothing.
        """
        if self._target is None:
            box = checked_box(observation.target_box, self._intrinsics)
            mask = cut_out(observation.rgb, box, self._settings.surroundings)
            self._learn(observation.rgb, mask, 1.0)
            self._around = 0.5 * (self._background + _histogram(_bins(observation.rgb), ~mask))
            self._background = self._around
            self._sizes = (_size(mask, self._intrinsics),) * 2
            return mask
        size = self._expected_size(expected)
        window = self._window(expected, size)
        mask = np.zeros(observation.rgb.shape[:2], np.bool_)
        if window is None:
            return mask
        likely = self._likely(observation.rgb[window], window, expected, size)
        mask[window] = self._one_thing(likely, window, expected, size)
        seen = _size(mask, self._intrinsics)
        if seen > self._settings.least_share * size:
            self._learn(observation.rgb, mask, self._settings.learning)
            bound = self._settings.growth
            self._sizes = (size * min(max(seen / size, 1.0 - bound), 1.0 + bound), seen)
        return mask

    def _expected_size(self, expected: Expectation) -> float:
        """Standard deviation of the target's pixels, normalised coordinates: as before, but for the distance."""
        size, seen = self._sizes
        return size * (expected.size / seen if expected.size > 0.0 else 1.0)

    def _window(self, expected: Expectation, size: float) -> tuple[slice, slice] | None:
        """Rows and columns that can hold the target; None if it cannot be in the image."""
        camera = self._intrinsics
        if not math.isfinite(expected.reach):
            return slice(0, camera.height), slice(0, camera.width)
        reach = expected.reach + 1.5 * self._settings.extent * size
        step = max(1, camera.width // 160)
        spans = []
        for place, focal, centre, length in (
            (expected.centroid[1], camera.fy, camera.cy, camera.height),
            (expected.centroid[0], camera.fx, camera.cx, camera.width),
        ):
            low, high = focal * (place - reach) + centre, focal * (place + reach) + centre
            start, stop = max(0, step * math.floor(low / step)), min(length, step * math.ceil(high / step) + 1)
            if stop - start < 2 * step:
                return None
            spans.append(slice(start, stop))
        return spans[0], spans[1]

    def _likely(self, part: ImageArray, window: tuple[slice, slice], expected: Expectation, size: float) -> ImageArray:
        """Pixels that are likelier on the target than around it by their look and place; 0 or 1."""
        assert self._target is not None
        ratio = np.log((self._target + _LEAST) / (self._background + _LEAST)).astype(np.float32)
        scores = np.clip(ratio, -3.0, 3.0)[_bins(part)]
        side = max(1, round(self._settings.blur_px * self._intrinsics.width / 320)) | 1
        scores = cv2.blur(scores, (side, side))
        if math.isfinite(expected.reach):
            extent = self._settings.extent * size + expected.moved
            away = self._off_middle(window, expected) / extent**2
            scores = scores + np.float32(self._settings.prior) * np.minimum(1.0 - away, 0.0).astype(np.float32)
        return (scores > 0.0).view(np.uint8)

    def _one_thing(
        self, likely: ImageArray, window: tuple[slice, slice], expected: Expectation, size: float
    ) -> MaskArray:
        """Of parts that lie close together, those with most pixels near where the middle of the target should be."""
        side = max(3, round(self._settings.merge_gap_fraction * self._intrinsics.width)) | 1
        count, labels = cv2.connectedComponents(cv2.dilate(likely, np.ones((side, side), np.uint8)))
        weight = likely.astype(np.float64)
        if math.isfinite(expected.reach):
            weight *= np.exp(-0.5 * self._off_middle(window, expected) / max(size, 1e-6) ** 2)
        share = np.bincount(labels.ravel(), weight.ravel(), count)
        share[0] = 0.0
        return (labels == int(np.argmax(share))) & (likely > 0) if share.any() else np.zeros(likely.shape, np.bool_)

    def _off_middle(self, window: tuple[slice, slice], expected: Expectation) -> FloatArray:
        """Squared offset of pixels from where the target is expected, normalised coordinates."""
        x, y = (axis[window] for axis in self._intrinsics.grid)
        return (x - expected.centroid[0]) ** 2 + (y - expected.centroid[1]) ** 2

    def _learn(self, rgb: ImageArray, mask: MaskArray, share: float) -> None:
        """Let the histograms follow an image; ``share`` 1 replaces them."""
        left, top, width, height = cv2.boundingRect(mask.view(np.uint8))
        margin = round(self._settings.surroundings * max(width, height)) + 4
        rows = slice(max(0, top - margin), top + height + margin)
        columns = slice(max(0, left - margin), left + width + margin)
        inside = mask[rows, columns].view(np.uint8)
        bins = _bins(rgb[rows, columns])
        outside = cv2.dilate(inside, np.ones((5, 5), np.uint8)) == 0
        around = _histogram(bins, outside)
        if self._target is None:
            self._first = self._target = _histogram(bins, inside > 0)
            self._background = around
            return
        keep = self._settings.first_look * share
        lately = (1.0 - share) * self._background + share * around
        self._background = (1.0 - keep) * lately + keep * self._around
        sure = cv2.erode(inside, np.ones((3, 3), np.uint8)) > 0
        lately = (1.0 - share) * self._target + share * _histogram(bins, sure)
        self._target = (1.0 - keep) * lately + keep * self._first


def _size(mask: MaskArray, camera: Intrinsics) -> float:
    """Standard deviation of the pixels of a mask, normalised coordinates; 0 if there are none."""
    moments = cv2.moments(mask.view(np.uint8), binaryImage=True)
    if moments["m00"] < 4.0:
        return 0.0
    return math.sqrt(0.5 * (moments["mu20"] + moments["mu02"]) / moments["m00"]) / camera.fx


def _bins(part: ImageArray) -> np.ndarray:
    """Index arrays (L, a, b) of each pixel's bin."""
    lab = cv2.cvtColor(np.ascontiguousarray(part), cv2.COLOR_RGB2LAB)
    return tuple((lab[..., k] // (256 // count)) for k, count in enumerate(_BINS))  # pyright: ignore[reportReturnType]


def _histogram(bins: np.ndarray, mask: MaskArray) -> FloatArray:
    """Share of the masked pixels in each bin, smoothed, shape ``_BINS``."""
    from scipy.ndimage import gaussian_filter

    flat = np.ravel_multi_index(tuple(axis[mask] for axis in bins), _BINS)
    counts = np.bincount(flat, minlength=int(np.prod(_BINS))).reshape(_BINS).astype(np.float64)
    return gaussian_filter(counts, _SMOOTHING, mode="nearest") / max(1.0, counts.sum())
