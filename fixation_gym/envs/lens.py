"""Pictures as a lens bends them, from pictures of a pinhole that sees a little more."""

from __future__ import annotations

import math
from functools import lru_cache

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.scratch import Float32Array
from fixation_gym.types import FloatArray, ImageArray

_EDGE_POINTS = 16
_WIDEST = 2.0
"""Rays beyond this many half widths of the picture are not sought."""
_SAME_PX = 0.1
"""Rays that were found lead back to their pixels within this, px."""


def pinhole_pixels(camera: Intrinsics) -> FloatArray:
    """Where the pinhole with the same K sees what each pixel of a camera with a lens sees, shape (H, W, 2), px.

    Raises:
        ValueError: if the camera has no lens, or one that bends its border too far.
    """
    if camera.lens is None or camera.lens.model != "brown_conrady":
        raise ValueError("the simulated camera has a lens of the model brown_conrady")
    rows, columns = np.mgrid[: camera.height, : camera.width].astype(np.float64)
    pixels, matrix = np.stack([columns, rows], axis=-1).reshape(-1, 1, 2), camera.matrix
    until = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-9)
    found = cv2.undistortPoints(pixels, matrix, np.array(camera.lens.coefficients), P=matrix, criteria=until)
    found = np.asarray(found, np.float64).reshape(camera.height, camera.width, 2)
    size = np.array([camera.width, camera.height])
    within = np.abs(found - 0.5 * size) < _WIDEST * 0.5 * size
    # Beyond where a lens folds the picture over, no ray leads to a pixel, and what was found leads elsewhere.
    if not np.all(within) or np.abs(_bent(found.reshape(-1, 2), camera) - pixels[:, 0]).max() > _SAME_PX:
        raise ValueError(f"the lens {camera.lens.coefficients} bends the border of the picture too far")
    return found


@lru_cache(maxsize=4)
def wide_pinhole(camera: Intrinsics) -> Intrinsics:
    """Pinhole of the same focal lengths whose picture holds all that the camera with the lens sees."""
    pixels = pinhole_pixels(camera)
    beyond = np.maximum(-pixels.min(axis=(0, 1)), pixels.max(axis=(0, 1)) - [camera.width - 1, camera.height - 1])
    across, down = (math.ceil(max(0.0, float(more))) + 1 for more in beyond)
    width, height = camera.width + 2 * across, camera.height + 2 * down
    return Intrinsics(width, height, camera.fx, camera.fy, camera.cx + across, camera.cy + down)


@lru_cache(maxsize=4)
def _maps(camera: Intrinsics) -> tuple[Float32Array, Float32Array]:
    wide = wide_pinhole(camera)
    pixels = (pinhole_pixels(camera) + np.array([wide.cx - camera.cx, wide.cy - camera.cy])).astype(np.float32)
    return np.ascontiguousarray(pixels[..., 0]), np.ascontiguousarray(pixels[..., 1])


def through_lens(image: ImageArray, camera: Intrinsics) -> ImageArray:
    """Picture of a camera with a lens, shape (H, W, 3), from that of its ``wide_pinhole``."""
    return np.asarray(cv2.remap(image, *_maps(camera), cv2.INTER_LINEAR), np.uint8)


def bent_box(box: FloatArray, camera: Intrinsics) -> FloatArray:
    """Box x, y, width, height, shape (4,), px of whole pixels, around what a box in the pinhole's picture holds."""
    if camera.lens is None:
        return box
    x, y, width, height = box
    along = np.linspace(0.0, 1.0, _EDGE_POINTS)
    across, down = x - 0.5 + width * along, y - 0.5 + height * along  # pixel 0 begins at -0.5
    edge = [(u, v) for u in across for v in down[[0, -1]]] + [(u, v) for v in down for u in across[[0, -1]]]
    bent = _bent(np.array(edge), camera)
    size = np.array([camera.width, camera.height])
    low = np.clip(np.floor(bent.min(axis=0) + 0.5), 0, size)
    high = np.clip(np.ceil(bent.max(axis=0) + 0.5), 0, size)
    return np.concatenate([low, high - low])


def _bent(pixels: FloatArray, camera: Intrinsics) -> FloatArray:
    """Where a camera with a lens sees what the pinhole with the same K sees at some pixels, shape (n, 2), px."""
    assert camera.lens is not None
    rays = np.column_stack([camera.pinhole.normalise(pixels), np.ones(len(pixels))])
    bent, _ = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), camera.matrix, np.array(camera.lens.coefficients))
    return np.asarray(bent, np.float64)[:, 0]
