"""The target of the distance experiment: a red duck on white card, drawn with OpenCV, in five sizes."""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.types import ImageArray, MaskArray

TEXTURE_SIZE = 1024
"""Side of the square texture, px."""
CARD_PER_WIDTH = 1.4
"""Side of the card, in widths of the duck."""
WIDTHS = (0.010, 0.0316, 0.100, 0.316, 1.000)
"""Widths of the duck on the five prints, m."""
SPAN = (0.05, 0.75)
"""Shares of the image width that the duck may span."""
_SUPERSAMPLE = 4
_RED, _CARD = (200, 16, 14), (225, 225, 222)


def duck_mask(size: int) -> MaskArray:
    """Duck that spans the whole width of a square, its bounding box in the middle, shape (size, size)."""
    canvas = np.zeros((size, size), np.uint8)

    def point(x: float, y: float) -> tuple[int, int]:
        return round(x * size), round(y * size)

    cv2.ellipse(canvas, point(0.46, 0.62), point(0.38, 0.23), 0.0, 0.0, 360.0, 1, -1)  # body
    cv2.circle(canvas, point(0.68, 0.30), round(0.17 * size), 1, -1)  # head
    beak = np.array([point(0.82, 0.24), point(0.99, 0.33), point(0.82, 0.38)])
    tail = np.array([point(0.02, 0.40), point(0.24, 0.50), point(0.14, 0.66)])
    for corners in (beak, tail):
        cv2.fillConvexPoly(canvas, corners.astype(np.int32), 1)
    columns, rows = np.flatnonzero(canvas.any(axis=0)), np.flatnonzero(canvas.any(axis=1))
    body = canvas[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    height = round(size * body.shape[0] / body.shape[1])
    body = cv2.resize(body, (size, height), interpolation=cv2.INTER_NEAREST)
    mask = np.zeros((size, size), np.bool_)
    top = (size - height) // 2
    mask[top : top + height] = body[: size - top] > 0
    return mask


def card_image() -> ImageArray:
    """Texture of the print, square, RGB, top-left origin; the duck's centroid is in its middle."""
    fine = TEXTURE_SIZE * _SUPERSAMPLE
    duck = duck_mask(round(fine / CARD_PER_WIDTH))
    rows, columns = np.nonzero(duck)
    card = np.zeros((fine, fine), np.float32)
    top, left = round(fine / 2 - rows.mean() - 0.5), round(fine / 2 - columns.mean() - 0.5)
    card[top : top + duck.shape[0], left : left + duck.shape[1]] = duck
    share = cv2.resize(card, (TEXTURE_SIZE, TEXTURE_SIZE), interpolation=cv2.INTER_AREA)[..., None]
    return np.rint(share * np.array(_RED) + (1.0 - share) * np.array(_CARD)).astype(np.uint8)


@cache
def duck_extent() -> tuple[float, float]:
    """Largest distance of the duck's outline from its centroid along x and y, in widths."""
    rows, columns = np.nonzero(duck_mask(256))
    along_x = max(columns.max() - columns.mean(), columns.mean() - columns.min())
    along_y = max(rows.max() - rows.mean(), rows.mean() - rows.min())
    return float(along_x) / 256.0, float(along_y) / 256.0


def valid_widths(distance_m: float, intrinsics: Intrinsics, shift_m: float = 0.0) -> tuple[float, ...]:
    """Widths of the prints that span the wanted share of the image and stay inside it, m.

    Args:
        distance_m: along the optical axis.
        intrinsics: of the camera.
        shift_m: how far the camera moves sideways without turning after the print.
    """
    image_width = intrinsics.width * distance_m / intrinsics.fx
    half_image = np.array([image_width, intrinsics.height * distance_m / intrinsics.fy]) / 2
    extent = np.array(duck_extent())
    return tuple(
        width
        for width in WIDTHS
        if SPAN[0] <= width / image_width <= SPAN[1] and bool(np.all(shift_m + width * extent <= 0.97 * half_image))
    )
