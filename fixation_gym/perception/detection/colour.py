"""Find the target by its colour."""

from __future__ import annotations

import math
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.detection.colour_shift import RED, Colour, colour_in_box
from fixation_gym.perception.detection.segmentation import Segmentation, segmentation_of
from fixation_gym.perception.detection.tracking import FIRST_LOOK, Expectation
from fixation_gym.perception.zero_flow import pixel_kernels
from fixation_gym.types import FloatArray, ImageArray, MaskArray, Observation


class ColourDetector:
    """Takes for the target what has its colour, and of several such things the one where it is expected."""

    def __init__(self, intrinsics: Intrinsics, colour: Colour = RED, follow: bool = True) -> None:
        """Prepare for a camera.

        Args:
            intrinsics: of the images to come.
            colour: of the target.
            follow: False takes the target to be anywhere, like in the first image; for comparison.
        """
        self._intrinsics, self._colour, self._follow = intrinsics, colour, follow
        self.reset()

    def reset(self) -> None:
        """Forget how the camera showed the colour."""
        self._shown: Colour | None = None

    def detect(self, observation: Observation, expected: Expectation) -> MaskArray:
        """Pixels of the target, shape (H, W).

        The box in the first image, if there is one, tells how this camera shows its colour.
        """
        if self._shown is None:
            box = observation.target_box
            self._shown = self._colour if box is None else colour_in_box(observation.rgb, box, self._colour)
        return colour_mask(observation.rgb, self._intrinsics, self._shown, expected if self._follow else FIRST_LOOK)


def colour_mask(rgb: ImageArray, intrinsics: Intrinsics, colour: Colour, expected: Expectation | None) -> MaskArray:
    """Pixels of the one group of parts of a colour that is largest and closest to where it is expected.

    Args:
        rgb: image of shape (H, W, 3), uint8.
        intrinsics: of this image.
        colour: what counts as target.
        expected: where the target should be: another thing of the same colour then wins only if it is much larger, and
            within reach. None: the largest group wins.

    Returns:
        Mask of shape (H, W).
    """
    mask = np.zeros(rgb.shape[:2], np.uint8)
    window = _search_window(rgb, colour)
    if window is not None:
        inside = _colour_mask(rgb, window, colour)
        mask[window] = _best_group(inside, colour.merge_gap_fraction, intrinsics, window, expected)
    return mask.view(np.bool_)


def segment(
    rgb: ImageArray, intrinsics: Intrinsics, colour: Colour = RED, expected: Expectation | None = None
) -> Segmentation:
    """Measure what ``colour_mask`` finds."""
    return segmentation_of(colour_mask(rgb, intrinsics, colour, expected), intrinsics)


def coloured_pixels(rgb: ImageArray, colour: Colour = RED) -> ImageArray:
    """All pixels of the colour, shape (H, W), 0 or 1, without isolated ones."""
    height, width = rgb.shape[:2]
    return _colour_mask(rgb, (slice(0, height), slice(0, width)), colour)


def _search_window(rgb: ImageArray, colour: Colour) -> tuple[slice, slice] | None:
    """Rows and columns of the image that can hold the target; None if there is no pixel of its colour.

    Only a grid of pixels is looked at. Its step is so small that a compact target of the least area covers some of
    them; parts of the target in between lie within the merge gap, which is added all around.
    """
    height, width = rgb.shape[:2]
    step = max(2, _group_step(width))
    size = (max(1, width // step), max(1, height // step))
    found = _in_colour_range(rgb, (slice(0, size[1] * step), slice(0, size[0] * step)), colour, step)
    left, top, columns, rows = cv2.boundingRect(found)
    if not columns:
        return None
    margin = step * (2 + round(colour.merge_gap_fraction * size[0]))

    def span(first: int, count: int, samples: int, length: int) -> slice:
        # Steps stay whole, so that grouping halves or quarters the part as it would the image.
        start, stop = step * first - margin, step * (first + count) + margin
        return slice(max(0, start), length if first + count == samples else min(length, stop))

    return span(top, rows, size[1], height), span(left, columns, size[0], width)


def _group_step(width: int) -> int:
    """Grouping needs no more than 160 columns."""
    return max(1, width // 160)


def _colour_mask(rgb: ImageArray, window: tuple[slice, slice], colour: Colour) -> ImageArray:
    """Pixels of a part of the image within the colour range, without isolated ones; shape of the part, 0 or 1."""
    # The median of 3 x 3 zeros and ones; OpenCV's medianBlur takes ten times as long on small images.
    inside = _in_colour_range(rgb, window, colour)
    count = cv2.boxFilter(inside, -1, (3, 3), normalize=False, borderType=cv2.BORDER_REPLICATE)
    return np.greater(count, 4).view(np.uint8)


def _in_colour_range(rgb: ImageArray, window: tuple[slice, slice], colour: Colour, step: int = 1) -> ImageArray:
    """Every ``step``-th pixel of a part of the image: 1 within the colour range, else 0."""
    rows, columns = window
    shape = ((rows.stop - rows.start) // step, (columns.stop - columns.start) // step)
    result = np.empty(shape, np.uint8)
    pixel_kernels.in_colour_range(rgb, (rows.start, columns.start), step, *_colour_tables(colour), result)
    return result


def _hue_ranges(colour: Colour) -> list[tuple[int, int]]:
    """One or, where the range wraps around, two ranges of hue in units of 2 degrees, ends included."""
    low, high = colour.hue_deg - colour.hue_tolerance_deg, colour.hue_deg + colour.hue_tolerance_deg
    ranges = [(max(low, 0.0), min(high, 360.0))]
    if low < 0.0:
        ranges.append((low + 360.0, 360.0))
    if high > 360.0:
        ranges.append((0.0, high - 360.0))
    return [(int(a / 2), int(b / 2)) for a, b in ranges]


def _least_values(colour: Colour) -> tuple[int, int]:
    """Least saturation and brightness, 0..255."""
    return int(255 * colour.min_saturation), int(255 * colour.min_value)


@lru_cache(maxsize=8)
def _colour_tables(colour: Colour) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """Tables of ``in_colour_range``: least spread by brightness, scale of hue by spread, hues in range."""
    saturation, brightness = _least_values(colour)
    values = np.maximum(np.arange(256), 1)
    # OpenCV: saturation = (spread * round(255 * 4096 / value) + 2048) >> 12.
    scale = np.rint(255 * 4096 / values).astype(np.int64)
    saturations = (np.arange(256)[None, :] * scale[:, None] + 2048) >> 12
    least = np.where(saturations[:, -1] >= saturation, (saturations >= saturation).argmax(axis=1), 256)
    least[:brightness] = 256
    hue_scale = np.rint(180 * 4096 / (6.0 * values))
    hue_scale[0] = 0
    hues = np.arange(181)
    in_range = np.any([(hues >= low) & (hues <= high) for low, high in _hue_ranges(colour)], axis=0)
    return least.astype(np.int32), hue_scale.astype(np.int32), in_range.astype(np.int32)


def _best_group(
    mask: ImageArray,
    merge_gap_fraction: float,
    intrinsics: Intrinsics,
    window: tuple[slice, slice],
    expected: Expectation | None,
) -> ImageArray:
    """Keep the best group of parts that lie closer together than the merge gap.

    Args:
        mask: pixels of a part of the image, 0 or 1.
        merge_gap_fraction: as in ``Colour``.
        intrinsics: of the image.
        window: rows and columns of the part; both begin at a multiple of the step of grouping.
        expected: where the target should be; None: the largest group is the best.

    Returns:
        Mask of the shape of the part, 0 or 1.
    """
    step = _group_step(intrinsics.width)
    # Rounded up here and for the part: a part starts at a whole step, so its places are some of the image's.
    columns, rows = math.ceil(intrinsics.width / step), math.ceil(intrinsics.height / step)
    small, present = mask, mask
    if step > 1:
        size = (math.ceil(mask.shape[1] / step), math.ceil(mask.shape[0] / step))
        small = cv2.resize(mask * np.uint8(255), size, interpolation=cv2.INTER_AREA)
        present = (small > 0).view(np.uint8)
    side = max(3, 2 * round(merge_gap_fraction * columns / 2) + 1)
    count, labels = cv2.connectedComponents(cv2.dilate(present, _square(side)))
    if count <= 2:
        if expected is None or expected.reach == math.inf:
            return mask
        near = _within_reach(small, intrinsics.scaled(rows, columns), window, step, expected)
        return mask if near else np.zeros_like(mask)
    weight = small.ravel().astype(np.float64) / (255 if step > 1 else 1)
    score = np.bincount(labels.ravel(), weight, minlength=count)
    score[0] = 0.0
    if expected is not None:
        x, y = intrinsics.scaled(rows, columns).grid
        top, left = window[0].start // step, window[1].start // step
        x, y = (axis[top : top + labels.shape[0], left : left + labels.shape[1]] for axis in (x, y))
        offset = _offsets(labels, weight, (x, y), expected.centroid)
        # The closeness falls over a tenth of the image width.
        score *= (offset <= expected.reach) / (1.0 + (offset * 10.0 * intrinsics.fx / intrinsics.width) ** 4)
    if not score.any():
        return np.zeros_like(mask)
    best = (labels == int(np.argmax(score))).astype(np.uint8)
    height, width = mask.shape
    return mask & cv2.resize(best, (width, height), interpolation=cv2.INTER_NEAREST)


def _within_reach(
    weight: np.ndarray, camera: Intrinsics, window: tuple[slice, slice], step: int, expected: Expectation
) -> bool:
    """Whether the centroid of all that is there, weights of shape (h, w), lies within reach of the expected place."""
    moments = cv2.moments(weight)
    if moments["m00"] == 0.0:
        return False
    column = moments["m10"] / moments["m00"] + window[1].start // step
    row = moments["m01"] / moments["m00"] + window[0].start // step
    x, y = (column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy
    return math.hypot(x - expected.centroid[0], y - expected.centroid[1]) <= expected.reach


@lru_cache(maxsize=8)
def _square(side: int) -> ImageArray:
    return np.ones((side, side), np.uint8)


def _offsets(
    labels: np.ndarray, weight: FloatArray, grid: tuple[FloatArray, FloatArray], expected: FloatArray
) -> FloatArray:
    """Distance of each group's centroid from the expected place, shape (N,), normalised coordinates."""
    x, y = grid
    flat = labels.ravel()
    total = np.maximum(np.bincount(flat, weight), 1e-9)
    dx = np.bincount(flat, weight * x.ravel()) / total - expected[0]
    dy = np.bincount(flat, weight * y.ravel()) / total - expected[1]
    return np.hypot(dx, dy)
