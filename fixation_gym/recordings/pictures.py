"""Read picture files; what is wrong with one is said in a sentence that names it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Generic, TypeVar

import cv2
import numpy as np

from fixation_gym.errors import UsageError
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.scratch import Float32Array
from fixation_gym.types import ImageArray, MaskArray

Item = TypeVar("Item")
_LEAST_PIXELS = 20
"""So many pixels of a target must have depth for their median to be its distance."""


def read_image(path: Path, camera: Intrinsics) -> ImageArray:
    """A colour or grey picture, shape (H, W, 3) RGB or (H, W).

    Raises:
        UsageError: if it cannot be read, has not 8 bits, or not the camera's size.
    """
    image = _read(path)
    if image.dtype != np.uint8:
        raise UsageError(f"{path} has {image.dtype} pixels; pictures must have 8 bits")
    check_size(image, camera, str(path))
    if image.ndim == 2:
        return image
    return np.asarray(cv2.cvtColor(image[..., :3], cv2.COLOR_BGR2RGB), np.uint8)


def read_mask(path: Path, camera: Intrinsics) -> MaskArray:
    """Pixels that are not black, shape (H, W).

    Raises:
        UsageError: if the file cannot be read, or has not the camera's size.
    """
    image = _read(path)
    check_size(image, camera, str(path))
    return np.asarray(image > 0 if image.ndim == 2 else image[..., :3].any(axis=2), np.bool_)


def read_depth(path: Path, camera: Intrinsics, unit_m: float, none: tuple[int, ...] = (0,)) -> Float32Array:
    """Depths of a picture with 16 bits, shape (H, W), m; NaN where there is none.

    Args:
        path: of the file.
        camera: whose size it has.
        unit_m: one step, m.
        none: values that stand for no depth.

    Raises:
        UsageError: if the file cannot be read, is of another kind, or has not the camera's size.
    """
    image = _read(path)
    if image.dtype != np.uint16 or image.ndim != 2:
        raise UsageError(
            f"{path} has {image.dtype} pixels of shape {image.shape}; depths must have one channel of 16 bits"
        )
    check_size(image, camera, str(path))
    depth = image.astype(np.float32) * np.float32(unit_m)
    depth[np.isin(image, none)] = np.nan
    return depth


def depth_over(mask: MaskArray, depth: Float32Array) -> float | None:
    """Median depth of the pixels of a mask, both of shape (H, W), m; None where too few have one."""
    values = depth[mask]
    values = values[np.isfinite(values)]
    return float(np.median(values)) if len(values) >= _LEAST_PIXELS else None


def check_size(image: np.ndarray, camera: Intrinsics, name: str) -> None:
    """Check that a picture, shape (H, W, ...), has the size that the camera's K is for.

    Raises:
        UsageError: naming the picture and both sizes.
    """
    height, width = image.shape[:2]
    if (height, width) != (camera.height, camera.width):
        raise UsageError(f"{name} is {width} x {height}, but the camera's K is for {camera.width} x {camera.height}")


def _read(path: Path) -> np.ndarray:
    if not path.is_file():
        raise UsageError(f"{path} is missing")
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise UsageError(f"{path} cannot be read as a picture")
    return image


class Forward(Generic[Item]):
    """Items by their index from a source that can only be read forward; going back reads it again from its start."""

    def __init__(self, start: Callable[[], Iterator[Item]]) -> None:
        """Keep in mind how to start; nothing is read yet."""
        self._start = start
        self._items: Iterator[Item] = iter(())
        self._next = -1

    def at(self, index: int) -> Item:
        """The item with an index from 0 on.

        Raises:
            IndexError: if there are fewer.
        """
        if not 0 <= self._next <= index:
            self._items, self._next = self._start(), 0
        for item in self._items:
            self._next += 1
            if self._next > index:
                return item
        raise IndexError(f"there are only {self._next} items")
