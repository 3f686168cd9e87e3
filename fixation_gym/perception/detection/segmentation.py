"""Where the target is in one image: its mask, centroid and second moments, also when it is hollow or partly hidden."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.types import FloatArray, MaskArray

LEAST_AREA_FRACTION = 2e-4
"""Least share of the image that a target covers; 15 px at 320x240."""


@dataclass(frozen=True, slots=True, eq=False)
class Segmentation:
    """Where the target is in one image."""

    mask: MaskArray
    """Pixels of the target, shape (H, W); all False when it is not visible."""
    visible: bool
    """Whether enough pixels were found."""
    centroid: FloatArray
    """Mean normalised image coordinates of the mask, shape (2,); NaN when not visible."""
    second_moments: FloatArray
    """Covariance of the normalised coordinates over the mask, shape (2, 2); NaN when not visible."""
    area_fraction: float
    """Share of the image that the mask covers."""
    touches_border: bool
    """Whether the mask reaches the image border, so that its centroid is not the one of the whole target."""
    centroid_std: float | None = None
    """Standard deviation of the centroid if the detector followed one point of the target, whatever of it is seen,
    normalised coordinates; None: it is the mean of the mask."""

    @property
    def whole(self) -> bool:
        """Whether all of the target is in the image."""
        return self.visible and not self.touches_border

    def __post_init__(self) -> None:
        for array in (self.mask, self.centroid, self.second_moments):
            array.setflags(write=False)


def segmentation_of(mask: MaskArray, intrinsics: Intrinsics) -> Segmentation:
    """Measure a mask, shape (H, W), in an image of these intrinsics; too small a one counts as nothing seen."""
    height, width = mask.shape
    pixels = mask.view(np.uint8)
    left, top, columns, rows = cv2.boundingRect(pixels)
    moments = (
        cv2.moments(pixels[top : top + rows, left : left + columns], binaryImage=True) if columns else {"m00": 0.0}
    )
    area = moments["m00"]
    if area < max(4.0, LEAST_AREA_FRACTION * height * width):
        return not_visible(height, width)
    u, v = moments["m10"] / area + left, moments["m01"] / area + top
    # A pixel is a unit square, so even a single one has a variance of 1/12 px^2.
    xx, xy, yy = moments["mu20"] / area + 1 / 12, moments["mu11"] / area, moments["mu02"] / area + 1 / 12
    fx, fy = intrinsics.fx, intrinsics.fy
    return Segmentation(
        mask=mask,
        visible=True,
        centroid=np.array([(u - intrinsics.cx) / fx, (v - intrinsics.cy) / fy]),
        second_moments=np.array([[xx / (fx * fx), xy / (fx * fy)], [xy / (fx * fy), yy / (fy * fy)]]),
        area_fraction=area / (height * width),
        touches_border=left == 0 or top == 0 or left + columns == width or top + rows == height,
    )


def not_visible(height: int, width: int) -> Segmentation:
    """Return what there is to say of a target that is not in the image."""
    return Segmentation(
        mask=np.zeros((height, width), dtype=np.bool_),
        visible=False,
        centroid=np.full(2, np.nan),
        second_moments=np.full((2, 2), np.nan),
        area_fraction=0.0,
        touches_border=False,
    )
