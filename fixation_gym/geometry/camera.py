"""Pinhole camera: pixels, normalised image coordinates, rays; and what its lens adds."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from numbers import Integral, Real
from typing import Literal, get_args

import numpy as np

from fixation_gym.types import FloatArray

_LARGEST = 32_767
"""Longest side of an image that OpenCV remaps, px."""
LensModel = Literal["brown_conrady", "fisheye"]
LENS_MODELS: tuple[LensModel, ...] = get_args(LensModel)
_COEFFICIENT_COUNTS = {"brown_conrady": (4, 5, 8, 12, 14), "fisheye": (4,)}


@dataclass(frozen=True)
class Lens:
    """How a lens bends what a pinhole would show, with OpenCV's models and order of coefficients."""

    coefficients: tuple[float, ...]
    """brown_conrady: k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tx ty]]]]; fisheye: k1 k2 k3 k4 of Kannala and Brandt."""
    model: LensModel = "brown_conrady"

    def __post_init__(self) -> None:
        if self.model not in LENS_MODELS:
            raise ValueError(f"unknown lens model '{self.model}'; choose one of {', '.join(LENS_MODELS)}")
        counts = _COEFFICIENT_COUNTS[self.model]
        if len(self.coefficients) not in counts or not all(map(math.isfinite, self.coefficients)):
            wanted = " or ".join(map(str, counts))
            raise ValueError(f"a {self.model} lens has {wanted} finite coefficients, got {self.coefficients}")


@dataclass(frozen=True)
class Intrinsics:
    """Camera intrinsics in pixels; pixel (0, 0) is the centre of the top-left pixel.

    All methods are those of the pinhole: pictures of a camera with a lens are undistorted first, see
    ``perception.rectification``.

    Raises:
        ValueError: for sizes that are not whole numbers, and for values that are not finite.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    lens: Lens | None = None
    """None: pictures are those of a pinhole."""
    readout_s: float = 0.0
    """Time from the exposure of the first row to that of the last, s: a rolling shutter. 0: all rows at once."""

    def __post_init__(self) -> None:
        sizes = (self.height, self.width)
        if not all(isinstance(size, Integral) and 0 < size <= _LARGEST for size in sizes):
            raise ValueError(f"height and width must be positive whole numbers up to {_LARGEST} px, got {sizes}")
        if not all(isinstance(focal, Real) and 0 < focal < math.inf for focal in (self.fx, self.fy)):
            raise ValueError(f"focal lengths must be positive and finite, got {self.fx} and {self.fy}")
        if not all(isinstance(centre, Real) and math.isfinite(centre) for centre in (self.cx, self.cy)):
            raise ValueError(f"the principal point must be finite, got {self.cx} and {self.cy}")
        if not (isinstance(self.readout_s, Real) and 0.0 <= self.readout_s < math.inf):
            raise ValueError(f"readout_s must be 0 or above, and finite, got {self.readout_s}")

    @classmethod
    def from_fovy(cls, height: int, width: int, fovy_rad: float) -> Intrinsics:
        """Square pixels, principal point in the image centre, vertical field of view in rad.

        Raises:
            ValueError: for a field of view that is not between 0 and pi, or a bad size.
        """
        if not (isinstance(fovy_rad, Real) and 0.0 < fovy_rad < math.pi):
            raise ValueError(f"the field of view must be between 0 and pi, got {fovy_rad} rad")
        if not (isinstance(height, Integral) and isinstance(width, Integral)):
            raise ValueError(f"height and width must be whole numbers, got {(height, width)}")
        focal = height / (2.0 * math.tan(fovy_rad / 2.0))
        return cls(width, height, focal, focal, (width - 1) / 2.0, (height - 1) / 2.0)

    @property
    def pinhole(self) -> Intrinsics:
        """The camera of undistorted pictures."""
        return replace(self, lens=None)

    @property
    def fovy(self) -> float:
        """Vertical field of view, rad, of a pinhole with the principal point in the image centre."""
        return 2.0 * math.atan(0.5 * self.height / self.fy)

    @cached_property
    def matrix(self) -> FloatArray:
        """Camera matrix K, shape (3, 3), px."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @cached_property
    def inverse_matrix(self) -> FloatArray:
        """Inverse of K, shape (3, 3): pixels (u, v, 1) to normalised (x, y, 1)."""
        return np.linalg.inv(self.matrix)

    @cached_property
    def grid(self) -> tuple[FloatArray, FloatArray]:
        """Normalised coordinates x and y of every pixel centre, each of shape (H, W); read-only."""
        columns = (np.arange(self.width) - self.cx) / self.fx
        rows = (np.arange(self.height) - self.cy) / self.fy
        x, y = np.meshgrid(columns, rows)
        x.setflags(write=False)
        y.setflags(write=False)
        return x, y

    def scaled(self, height: int, width: int) -> Intrinsics:
        """Intrinsics of the same view resampled to another size."""
        return _scaled(self, height, width)

    def halved(self, width: int) -> Intrinsics:
        """Intrinsics of the same view halved until it is no wider than ``width`` px."""
        halvings = math.ceil(math.log2(max(1.0, self.width / width)))
        return self.scaled(self.height >> halvings, self.width >> halvings)

    def project(self, points_cam: FloatArray) -> FloatArray:
        """Project points, shape (..., 3) in ``cam`` in m, to pixels, shape (..., 2); NaN behind the camera."""
        points = np.asarray(points_cam, dtype=np.float64)
        depth = np.where(points[..., 2] > 0.0, points[..., 2], np.nan)
        u = self.fx * points[..., 0] / depth + self.cx
        v = self.fy * points[..., 1] / depth + self.cy
        return np.stack([u, v], axis=-1)

    def normalise(self, pixels: FloatArray) -> FloatArray:
        """Pixels, shape (..., 2), to normalised image coordinates, shape (..., 2)."""
        pixels = np.asarray(pixels, dtype=np.float64)
        return (pixels - [self.cx, self.cy]) / [self.fx, self.fy]


@lru_cache(maxsize=32)
def _scaled(camera: Intrinsics, height: int, width: int) -> Intrinsics:
    """Cached because the grid of the result is: perception asks for the same few sizes in every frame."""
    sx, sy = width / camera.width, height / camera.height
    cx = (camera.cx + 0.5) * sx - 0.5
    cy = (camera.cy + 0.5) * sy - 0.5
    return Intrinsics(width, height, camera.fx * sx, camera.fy * sy, cx, cy, camera.lens, camera.readout_s)
