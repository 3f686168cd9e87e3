"""What a stereo depth camera would have said: two infrared pictures from 50 mm apart, and block matching between them.

Modelled on Intel's D435, as its data sheet has it: two imagers 50 mm apart, whose field of view is about 87 degrees
wide where the colour picture's is 55, matched along rows over 128 px. So there is a nearest distance, f * 50 mm / 128,
and there are holes where nothing matches. The left imager is where the wrist camera is: depth is in its pixels without
any alignment, which a real one would need. Matching is OpenCV's, by Hirschmueller's semi-global method; the camera's
own is not public. What glass and mirrors do to the result is not modelled: it comes out of the pictures.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.scratch import Float32Array
from fixation_gym.types import ImageArray

BASELINE_M = 0.05
"""Distance of the right imager from the left one, m."""
PROJECTOR_M = 0.029
"""Distance of the projector of dots from the left imager, m."""
FARTHEST_M = 10.0
"""Beyond this it says nothing, m."""
_SEARCHED = 0.4
"""Range of disparities as a share of the picture's width, and how far imagers see beyond each of its sides."""
_STEP = 16
"""OpenCV wants a multiple of this, and gives disparities in as many parts of a pixel."""
_BLOCK = 5
"""Side of the compared blocks, px."""
_UNIQUE_PERCENT, _AGREE_PX = 15, 1
"""By how much the best match must be better than the next, and how far matches from left and right may be apart."""
_SPECK_AREA, _SPECK_RANGE = 1.0 / 384.0, 2
"""Islands of depth smaller than this share of the picture, and apart from what is around by these px, are removed."""


def disparity_range(camera: Intrinsics) -> int:
    """Number of disparities that are searched for a picture of the wrist camera, px."""
    return max(_STEP, int(_SEARCHED * camera.width) // _STEP * _STEP)


def nearest_m(camera: Intrinsics) -> float:
    """Nearest distance that is measured, m."""
    return camera.fx * BASELINE_M / disparity_range(camera)


def imager(camera: Intrinsics) -> Intrinsics:
    """Either infrared imager: a pinhole of the same focal length and height that sees more on both sides."""
    side = disparity_range(camera)
    return Intrinsics(camera.width + 2 * side, camera.height, camera.fx, camera.fy, camera.cx + side, camera.cy)


def stereo_depth(left: ImageArray, right: ImageArray, camera: Intrinsics) -> Float32Array:
    """Depth along the optical axis, shape (H, W), m; 0 where the camera does not know.

    Args:
        left: grey picture of the left ``imager``, shape (H, W'), uint8.
        right: of the one ``BASELINE_M`` to its right.
        camera: the wrist camera's pinhole, of H x W px.

    Raises:
        ValueError: if a picture has not the imager's size.
    """
    side, wide = disparity_range(camera), imager(camera)
    for name, picture in (("left", left), ("right", right)):
        if picture.shape != (wide.height, wide.width):
            raise ValueError(f"the {name} picture must be of shape {(wide.height, wide.width)}, got {picture.shape}")
    matched = _matcher(side, camera.width * camera.height).compute(left, right)
    disparity = matched[:, side : side + camera.width].astype(np.float32) / np.float32(_STEP)
    known = disparity > camera.fx * BASELINE_M / FARTHEST_M
    return np.where(known, np.float32(camera.fx * BASELINE_M) / np.where(known, disparity, 1.0), 0.0).astype(np.float32)


@lru_cache(maxsize=4)
def _matcher(disparities: int, pixels: int) -> Any:
    area = _BLOCK * _BLOCK
    return cv2.StereoSGBM.create(
        minDisparity=0,
        numDisparities=disparities,
        blockSize=_BLOCK,
        P1=8 * area,  # as OpenCV's documentation recommends
        P2=32 * area,
        disp12MaxDiff=_AGREE_PX,
        uniquenessRatio=_UNIQUE_PERCENT,
        speckleWindowSize=int(_SPECK_AREA * pixels),
        speckleRange=_SPECK_RANGE,
        mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )
