"""What a box or a pixel in the first image names. Value in, value out."""

from __future__ import annotations

import math
from itertools import pairwise

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.types import FloatArray, ImageArray, MaskArray

_LEAST_FILLED = 0.25
"""A cut-out that fills less of its box than this is not believed."""
_TOLERANCES = (8, 10, 13, 16, 20, 25, 32, 40, 50, 64)
"""How far the colour of a thing may be from that of its pixel, levels of Lab; each a quarter more than the last."""
_SMALLEST, _LARGEST = 2e-4, 0.25
"""Least and largest share of the image that a thing at a pixel covers."""
_STANDS_OUT = 0.25
"""A thing ends where this much more tolerance adds less than this share of its area."""


def checked_box(box: FloatArray | None, camera: Intrinsics) -> tuple[int, int, int, int]:
    """A box as whole pixels of the image: left, top, width, height.

    Raises:
        ValueError: if there is none, it lies outside the image, or is around nothing.
    """
    size = f"{camera.width} x {camera.height}"
    if box is None or np.shape(box) != (4,) or not np.all(np.isfinite(box)):
        raise ValueError(f"target_box must be x, y, width, height in px of the first image ({size}), got {box}")
    x, y, width, height = np.asarray(box, np.float64).tolist()
    left, top = max(0, math.floor(x)), max(0, math.floor(y))
    right, bottom = min(camera.width, math.ceil(x + width)), min(camera.height, math.ceil(y + height))
    if right - left < 3 or bottom - top < 3:
        got = [x, y, width, height]
        raise ValueError(f"target_box must hold at least 3 x 3 px of the first image ({size}), got {got}")
    return left, top, right - left, bottom - top


def box_from_pixel(rgb: ImageArray, pixel: tuple[float, float]) -> FloatArray:
    """Box around the thing that a pixel of an image shows: x, y, width, height, px, shape (4,).

    The region of nearly the pixel's colour grows with the tolerance for its colour until it meets the thing's outline,
    where it stops growing for a while (as in MSER, Matas et al. 2004).

    Raises:
        ValueError: if the pixel lies outside the image, or nothing stands out there.
    """
    height, width = rgb.shape[:2]
    x, y = pixel
    if not (0.0 <= x <= width - 1 and 0.0 <= y <= height - 1):
        raise ValueError(f"the target's pixel must lie in the image ({width} x {height}), got {x:g}, {y:g}")
    lab = cv2.cvtColor(cv2.medianBlur(np.ascontiguousarray(rgb), 5), cv2.COLOR_RGB2LAB)
    flags = 4 | cv2.FLOODFILL_FIXED_RANGE | cv2.FLOODFILL_MASK_ONLY | (1 << 8)
    areas, boxes = [], []
    for tolerance in _TOLERANCES:
        filled, range_ = np.zeros((height + 2, width + 2), np.uint8), (tolerance,) * 3
        area, _, _, box = cv2.floodFill(lab, filled, (round(x), round(y)), 0, range_, range_, flags)
        areas.append(area / (height * width))
        boxes.append(box)
    growth = [math.log(after / before) for before, after in pairwise(areas)]
    within = [k for k in range(len(growth)) if areas[k] >= _SMALLEST and areas[k + 1] <= _LARGEST]
    best = min(within, key=growth.__getitem__, default=None)
    if best is None or growth[best] > _STANDS_OUT:
        raise ValueError(f"nothing stands out at pixel {x:g}, {y:g} of the first image; draw a box around the target")
    return np.array(boxes[best + 1], np.float64)


def cut_out(rgb: ImageArray, box: tuple[int, int, int, int], surroundings: float) -> MaskArray:
    """The thing in a box, shape (H, W), by GrabCut (Rother et al. 2004); or the ellipse in the box.

    Args:
        rgb: image.
        box: around the thing, whole pixels.
        surroundings: what lies within this share of the box around it is not the thing.
    """
    left, top, width, height = box
    margin = max(6, round(surroundings * max(width, height)))
    rows = slice(max(0, top - margin), min(rgb.shape[0], top + height + margin))
    columns = slice(max(0, left - margin), min(rgb.shape[1], left + width + margin))
    part = np.ascontiguousarray(rgb[rows, columns])
    inner = (left - columns.start, top - rows.start, width, height)
    labels = np.full(part.shape[:2], cv2.GC_BGD, np.uint8)
    labels[inner[1] : inner[1] + height, inner[0] : inner[0] + width] = cv2.GC_PR_FGD
    ellipse = np.zeros_like(labels)
    centre = (inner[0] + width // 2, inner[1] + height // 2)
    cv2.ellipse(ellipse, centre, (max(1, width // 2), max(1, height // 2)), 0.0, 0.0, 360.0, 1, -1)
    found = ellipse
    if (labels == cv2.GC_BGD).any():  # else the box fills the image, and there is nothing to tell it from
        cv2.setRNGSeed(0)  # GrabCut begins with k-means
        cv2.grabCut(part, labels, inner, np.zeros((1, 65)), np.zeros((1, 65)), 4, cv2.GC_INIT_WITH_MASK)
        cut = ((labels == cv2.GC_FGD) | (labels == cv2.GC_PR_FGD)).view(np.uint8)
        if cv2.countNonZero(cut) > _LEAST_FILLED * width * height:
            found = cut
    mask = np.zeros(rgb.shape[:2], np.bool_)
    mask[rows, columns] = found > 0
    return mask
