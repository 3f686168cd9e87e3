"""What a box or a pixel in the first image names. Value in, value out."""

from __future__ import annotations

import math
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.types import FloatArray, ImageArray, MaskArray

_LEAST_FILLED = 0.25
"""A cut-out that fills less of its box than this is not believed."""
_BEYOND = 0.25
"""A thing may reach beyond its box by this share of it."""
_OPEN_RIM = 0.08
"""What crosses more of the rim at which it must have ended does not end there."""
_MAIN_PART = 0.7
"""Share of all that was found in the box that is in one piece."""
_WORKING_PX = 160
"""The box and its surroundings are made as small as this for GrabCut, px."""
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
    """The thing in a box that may be too large, too small or beside it, shape (H, W), by GrabCut (Rother et al. 2004).

    The thing may reach beyond the box by a quarter. If it does not end there, the box is taken at its word: the thing
    is what stands out in it, or else all of it.

    Args:
        rgb: image.
        box: around the thing, whole pixels.
        surroundings: what lies within this share of the box around it is compared with what it holds.
    """
    left, top, width, height = box
    margin = max(6, round(surroundings * max(width, height)))
    rows = slice(max(0, top - margin), min(rgb.shape[0], top + height + margin))
    columns = slice(max(0, left - margin), min(rgb.shape[1], left + width + margin))
    part = np.ascontiguousarray(rgb[rows, columns])
    size = part.shape[1], part.shape[0]
    scale = min(1.0, _WORKING_PX / max(size))
    small = part
    if scale < 1.0:
        small = np.asarray(cv2.resize(part, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), np.uint8)
    corner = left - columns.start, top - rows.start
    inner, outer = (_filled(small.shape[:2], scale, corner, (width, height), share) for share in (0.0, _BEYOND))
    found = _one_thing(
        _grab_cut(small, np.where(inner, cv2.GC_PR_FGD, np.where(outer, cv2.GC_PR_BGD, 0))), inner, outer
    )
    if found is None:
        found = _grab_cut(small, np.where(inner, cv2.GC_PR_FGD, cv2.GC_BGD))
        if np.count_nonzero(found) < _LEAST_FILLED * np.count_nonzero(inner):
            found = inner
    mask = np.zeros(rgb.shape[:2], np.bool_)
    mask[rows, columns] = cv2.resize(found.view(np.uint8) * 255, size, interpolation=cv2.INTER_LINEAR) > 127
    return mask


def box_filled(shape: tuple[int, int], box: tuple[int, int, int, int]) -> MaskArray:
    """Pixels of a box in an image of a shape (H, W)."""
    return _filled(shape, 1.0, box[:2], box[2:], 0.0)


def _filled(
    shape: tuple[int, int], scale: float, corner: tuple[int, int], size: tuple[int, int], beyond: float
) -> MaskArray:
    """Pixels of a box that reaches beyond itself by a share of its size, in an image that was scaled, shape (h, w)."""
    mask = np.zeros(shape, np.bool_)
    x, y = (
        slice(
            max(0, round(scale * (start - beyond * length))), max(0, round(scale * (start + (1.0 + beyond) * length)))
        )
        for start, length in zip(corner, size, strict=True)
    )
    mask[y, x] = True
    return mask


def _grab_cut(rgb: ImageArray, labels: NDArray[np.int64]) -> MaskArray:
    """What GrabCut makes of its own labels, shape (h, w); of the box alone if nothing is surely around it."""
    cut = labels.astype(np.uint8)
    if not (cut == cv2.GC_BGD).any():
        return cut == cv2.GC_PR_FGD
    cv2.setRNGSeed(0)  # GrabCut begins with k-means
    cv2.grabCut(rgb, cut, (0, 0, 1, 1), np.zeros((1, 65)), np.zeros((1, 65)), 4, cv2.GC_INIT_WITH_MASK)
    return (cut == cv2.GC_FGD) | (cut == cv2.GC_PR_FGD)


def _one_thing(found: MaskArray, inner: MaskArray, outer: MaskArray) -> MaskArray | None:
    """The one of the parts found that fills most of a box; None if it is not one thing that ends near the box."""
    count, labels = cv2.connectedComponents(found.view(np.uint8))
    within = np.bincount(labels[inner], minlength=count)
    within[0] = 0
    best = int(np.argmax(within))
    thing = labels == best
    rim = outer & (cv2.erode(outer.view(np.uint8), np.ones((3, 3), np.uint8)) == 0)
    ends = np.count_nonzero(thing & rim) < _OPEN_RIM * np.count_nonzero(rim)
    filled = within[best] > max(_LEAST_FILLED * np.count_nonzero(inner), _MAIN_PART * within.sum())
    return thing if ends and filled else None
