"""Where the centre of a flat target is in the image, to a hundredth of a pixel."""

from __future__ import annotations

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.scratch import Float32Array
from fixation_gym.types import FloatArray, ImageArray, MaskArray


def coverage(rgb: ImageArray, mask: MaskArray) -> Float32Array:
    """Share of every pixel that the target covers, shape (H, W), 0..1.

    A mask rounds the outline to whole pixels. While the gaze is held the rounding hardly changes, so that its error in
    the centroid (0.025 px for a target of 200 px) does not average out. At the outline colours are mixed, which tells
    the share: 1 is the mean colour inside, 0 the one just outside.

    Args:
        rgb: image of shape (H, W, 3), uint8.
        mask: pixels of the target, shape (H, W).
    """
    inside = mask.view(np.uint8)
    core, near, around = cv2.erode(inside, _SQUARE), cv2.dilate(inside, _SQUARE), cv2.dilate(inside, _WIDE_SQUARE)
    if not core.any():
        return mask.astype(np.float32)
    target, outside = (np.array(cv2.mean(rgb, part)[:3], np.float32) for part in (core, around - near))
    contrast = target - outside
    weights = contrast / max(float(contrast @ contrast), 1e-6)
    share = np.asarray(rgb.astype(np.float32) @ weights - weights @ outside, np.float32)
    np.clip(share, 0.0, 1.0, out=share)
    share[core > 0] = 1.0
    share[near == 0] = 0.0
    return share


def flat_centroid(share: Float32Array, intrinsics: Intrinsics, normal_cam: FloatArray) -> FloatArray:
    """Image of a flat target's centre of area, normalised, shape (2,).

    The near half of a slanted target covers more pixels than the far one. A pixel with ray p shows the point p / (n.p)
    of the plane and an area of it that goes with (n.p)^-3. So the centre is seen at the mean of p with weights
    (n.p)^-4; the plain centroid is off by 4 M s, M being the second moments and s the slant n_xy / n.p.

    Args:
        share: of every pixel that the target covers, shape (H, W).
        intrinsics: of this image.
        normal_cam: normal n of the target's plane in the camera frame, either sense, shape (3,).
    """
    x = (np.arange(intrinsics.width) - intrinsics.cx) / intrinsics.fx
    y = (np.arange(intrinsics.height) - intrinsics.cy) / intrinsics.fy
    inverse_depth = (normal_cam[0] * x + normal_cam[2]) + (normal_cam[1] * y)[:, None]
    weight = share / np.square(np.square(inverse_depth))
    columns, rows = weight.sum(axis=0), weight.sum(axis=1)
    return np.array([columns @ x, rows @ y]) / columns.sum()


_SQUARE, _WIDE_SQUARE = np.ones((5, 5), np.uint8), np.ones((9, 9), np.uint8)
