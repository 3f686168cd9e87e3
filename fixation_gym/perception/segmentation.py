"""Find the target by its colour: mask, centroid and second moments, also when it is hollow or partly hidden."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.types import FloatArray, ImageArray, MaskArray


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
    min_area_fraction: float = 2e-4
    """Least share of the image a target covers; 15 px at 320x240."""
    merge_gap_fraction: float = 0.04
    """Parts closer than this share of the image width belong to one target: a bar in front may cut it in pieces."""


RED = Colour(hue_deg=0.0, hue_tolerance_deg=16.0, min_saturation=0.45, min_value=0.16)
"""The colour of the target in every scenario."""


@dataclass(frozen=True, slots=True, eq=False)
class Segmentation:
    """Where the target is in one image."""

    mask: MaskArray
    """Pixels of the target, shape (H, W); all False when it is not visible."""
    visible: bool
    """Whether enough pixels of the colour were found."""
    centroid: FloatArray
    """Mean normalised image coordinates of the mask, shape (2,); NaN when not visible."""
    second_moments: FloatArray
    """Covariance of the normalised coordinates over the mask, shape (2, 2); NaN when not visible."""
    area_fraction: float
    """Share of the image that the mask covers."""
    touches_border: bool
    """Whether the mask reaches the image border, so that its centroid is not the one of the whole target."""

    def __post_init__(self) -> None:
        for array in (self.mask, self.centroid, self.second_moments):
            array.setflags(write=False)


def segment(
    rgb: ImageArray, intrinsics: Intrinsics, colour: Colour = RED, expected: FloatArray | None = None
) -> Segmentation:
    """Segment the target by colour and keep the one group of parts that is largest (and closest to ``expected``).

    Args:
        rgb: image of shape (H, W, 3), uint8.
        intrinsics: of this image.
        colour: what counts as target.
        expected: normalised image coordinates, shape (2,), where the target should be; a second object of the same
            colour then wins only if it is much larger. None: the largest group wins.
    """
    mask = _largest_group(_colour_mask(rgb, colour), colour, intrinsics, expected)
    moments = cv2.moments(mask, binaryImage=True)
    height, width = mask.shape
    area = moments["m00"]
    if area < max(4.0, colour.min_area_fraction * height * width):
        return _not_visible(height, width)
    pixel = np.array([moments["m10"], moments["m01"]]) / area
    scale = np.array([intrinsics.fx, intrinsics.fy])
    # A pixel is a unit square, so even a single one has a variance of 1/12 px^2.
    spread = np.array([[moments["mu20"], moments["mu11"]], [moments["mu11"], moments["mu02"]]]) / area + np.eye(2) / 12
    borders = (mask[0], mask[-1], mask[:, 0], mask[:, -1])
    return Segmentation(
        mask=mask.view(np.bool_),
        visible=True,
        centroid=intrinsics.normalise(pixel),
        second_moments=spread / np.outer(scale, scale),
        area_fraction=area / (height * width),
        touches_border=any(bool(border.any()) for border in borders),
    )


def _not_visible(height: int, width: int) -> Segmentation:
    return Segmentation(
        mask=np.zeros((height, width), dtype=np.bool_),
        visible=False,
        centroid=np.full(2, np.nan),
        second_moments=np.full((2, 2), np.nan),
        area_fraction=0.0,
        touches_border=False,
    )


def _colour_mask(rgb: ImageArray, colour: Colour) -> ImageArray:
    """Pixels within the colour range, without isolated ones; shape (H, W), 0 or 1."""
    hsv = np.asarray(cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV), np.uint8)  # OpenCV keeps hue in units of 2 degrees
    low, high = colour.hue_deg - colour.hue_tolerance_deg, colour.hue_deg + colour.hue_tolerance_deg
    mask = _in_hue_range(hsv, max(low, 0.0), min(high, 360.0), colour)
    if low < 0.0:
        mask |= _in_hue_range(hsv, low + 360.0, 360.0, colour)
    if high > 360.0:
        mask |= _in_hue_range(hsv, 0.0, high - 360.0, colour)
    return np.asarray(cv2.medianBlur(mask, 3), np.uint8) & np.uint8(1)


def _in_hue_range(hsv: ImageArray, low_deg: float, high_deg: float, colour: Colour) -> ImageArray:
    lower = np.array([low_deg / 2, 255 * colour.min_saturation, 255 * colour.min_value]).astype(np.uint8)
    upper = np.array([high_deg / 2, 255, 255]).astype(np.uint8)
    return np.asarray(cv2.inRange(hsv, lower, upper), dtype=np.uint8)


def _largest_group(mask: ImageArray, colour: Colour, intrinsics: Intrinsics, expected: FloatArray | None) -> ImageArray:
    """Keep the best group of parts that lie closer together than the merge gap; shape (H, W), 0 or 1."""
    step = max(1, mask.shape[1] // 160)  # grouping needs no more than 160 columns
    small = cv2.resize(mask * np.uint8(255), None, fx=1 / step, fy=1 / step, interpolation=cv2.INTER_AREA)
    reach = max(3, 2 * round(colour.merge_gap_fraction * small.shape[1] / 2) + 1)
    joined = cv2.dilate((small > 0).astype(np.uint8), np.ones((reach, reach), np.uint8))
    count, labels = cv2.connectedComponents(joined)
    if count <= 2:
        return mask
    weight = small.ravel().astype(np.float64) / 255
    area = np.bincount(labels.ravel(), weight, minlength=count)
    area[0] = 0.0
    if expected is not None:
        area *= _closeness(labels, weight, intrinsics, expected)
    best = (labels == int(np.argmax(area))).astype(np.uint8)
    height, width = mask.shape
    return mask & cv2.resize(best, (width, height), interpolation=cv2.INTER_NEAREST)


def _closeness(labels: np.ndarray, weight: FloatArray, intrinsics: Intrinsics, expected: FloatArray) -> FloatArray:
    """Factor in 0..1 per group, shape (N,): 1 at the expected place, falling over a tenth of the image width."""
    height, width = labels.shape
    x, y = intrinsics.scaled(height, width).grid
    flat = labels.ravel()
    total = np.maximum(np.bincount(flat, weight), 1e-9)
    dx = np.bincount(flat, weight * x.ravel()) / total - expected[0]
    dy = np.bincount(flat, weight * y.ravel()) / total - expected[1]
    reach = 0.1 * intrinsics.width / intrinsics.fx
    return 1.0 / (1.0 + ((dx**2 + dy**2) / reach**2) ** 2)
