"""Pictures of any camera as perception takes them: with three channels, and as a pinhole with the same K sees them."""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.flow.kernels import WINDOW
from fixation_gym.perception.scratch import Float32Array
from fixation_gym.types import FloatArray, ImageArray, MaskArray, Observation

_LEAST_COLUMNS = 80
_EDGE_POINTS = 16
"""Points along each side of a box: a lens bends its sides."""


def in_colour(image: ImageArray) -> ImageArray:
    """A grey image, shape (H, W), uint8, with three equal channels; any other stays as it is."""
    if image.ndim != 2 or image.dtype != np.uint8:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGB), np.uint8)


def as_grey(image: ImageArray) -> ImageArray:
    """An image in colour, shape (H, W, 3), uint8, as a grey one, shape (H, W)."""
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)


def undistorted(image: ImageArray, camera: Intrinsics) -> ImageArray:
    """A picture of a camera as its pinhole sees it; for many of them, keep a ``Rectification``."""
    return image if camera.lens is None else Rectification(camera).image(image)


class Rectification:
    """Undistorts what one camera sees, by maps that are computed once. Nothing of it changes after."""

    def __init__(self, camera: Intrinsics) -> None:
        """Compute the maps.

        Raises:
            ValueError: if the camera has no lens.
        """
        if camera.lens is None:
            raise ValueError("the camera has no lens: its pictures are those of a pinhole already")
        self._matrix, self._coefficients = camera.matrix, np.array(camera.lens.coefficients)
        self._fisheye = camera.lens.model == "fisheye"
        undistort = cv2.fisheye.initUndistortRectifyMap if self._fisheye else cv2.initUndistortRectifyMap
        size = (camera.width, camera.height)
        maps = undistort(self._matrix, self._coefficients, np.eye(3), self._matrix, size, cv2.CV_32FC1)
        self._maps = maps[0], maps[1]
        columns, rows = self._maps
        outside = (columns < 0) | (rows < 0) | (columns > camera.width - 1) | (rows > camera.height - 1)
        # Windows of the flow reach WINDOW pixels of its grid, which has more than _LEAST_COLUMNS columns.
        reach = 2 * math.ceil(WINDOW * camera.width / _LEAST_COLUMNS) + 1
        widened = cv2.dilate(outside.view(np.uint8), np.ones((reach, reach), np.uint8))
        self._outside = np.asarray(widened, np.uint8).view(np.bool_)

    def image(self, image: ImageArray) -> ImageArray:
        """An image, shape (H, W) or (H, W, 3), as the pinhole sees it; its border goes on where nothing was seen."""
        return np.asarray(cv2.remap(image, *self._maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.uint8)

    def mask(self, mask: MaskArray) -> MaskArray:
        """A mask, shape (H, W), as the pinhole sees it; nothing is set where nothing was seen."""
        return np.asarray(cv2.remap(mask.view(np.uint8), *self._maps, cv2.INTER_NEAREST), np.uint8).view(np.bool_)

    def depth(self, depth: Float32Array) -> Float32Array:
        """Depths along the optical axis, shape (H, W), m; NaN where nothing was seen."""
        nearest, border = cv2.INTER_NEAREST, cv2.BORDER_CONSTANT
        return np.asarray(cv2.remap(depth, *self._maps, nearest, borderMode=border, borderValue=math.nan), np.float32)

    def box(self, box: FloatArray) -> FloatArray:
        """Box (x, y, width, height), shape (4,), px, around what a box in the picture as it came holds."""
        x, y, width, height = np.asarray(box, np.float64)
        along = np.linspace(0.0, 1.0, _EDGE_POINTS)
        across, down = x - 0.5 + width * along, y - 0.5 + height * along  # pixel 0 begins at -0.5
        sides = [[(u, v) for u in across for v in (down[0], down[-1])], [(u, v) for v in down for u in across[[0, -1]]]]
        points = np.array(sides).reshape(-1, 1, 2)
        undistort = cv2.fisheye.undistortPoints if self._fisheye else cv2.undistortPoints
        moved = undistort(points, self._matrix, self._coefficients, R=np.eye(3), P=self._matrix).reshape(-1, 2)
        low, high = moved.min(axis=0), moved.max(axis=0)
        return np.array([*(low + 0.5), *(high - low)])

    def unseen(self, self_mask: MaskArray | None) -> MaskArray:
        """Pixels, shape (H, W), where the pinhole shows the robot itself, or nothing that was seen: never obstacles.

        Args:
            self_mask: where the picture as it came shows the robot itself; None: nowhere.
        """
        return self._outside if self_mask is None else self._outside | self.mask(self_mask)

    def observation(self, observation: Observation) -> Observation:
        """An observation whose image, mask and target box are those of the pinhole."""
        mask, box = observation.mask, observation.target_box
        return replace(
            observation,
            rgb=self.image(observation.rgb),
            mask=None if mask is None else self.mask(mask),
            target_box=None if box is None else self.box(box),
        )
