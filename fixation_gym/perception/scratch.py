"""Memory of the pixel-wise stages.

Fresh memory costs more there than arithmetic: an array of an image's size comes from the system page by page. So
intermediate images live in a ``Scratch``, which a caller with a stream of frames keeps.
"""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from fixation_gym.types import MaskArray

Float32Array = NDArray[np.float32]


class Scratch:
    """Work arrays by name and shape, kept from call to call. Results never live in them. Not for several threads."""

    def __init__(self) -> None:
        """Start empty; arrays are made when first asked for."""
        self._arrays: dict[tuple[str, tuple[int, ...]], Float32Array] = {}

    def __reduce__(self) -> tuple[type[Scratch], tuple[()]]:
        return Scratch, ()  # nothing in it is worth a copy

    def get(self, name: str, *shape: int) -> Float32Array:
        """Return a float32 array with undefined content."""
        array = self._arrays.get((name, shape))
        if array is None:
            array = self._arrays[name, shape] = np.empty(shape, np.float32)
        return array


def fill(array: Float32Array, value: float, where: MaskArray) -> None:
    """Set some pixels in place: NumPy's assignment by mask takes ten times as long where the mask is ragged."""
    cv2.copyTo(_constant(array.shape, value), where.view(np.uint8), array)


@lru_cache(maxsize=16)
def _constant(shape: tuple[int, ...], value: float) -> Float32Array:
    array = np.full(shape, value, np.float32)
    array.setflags(write=False)
    return array
