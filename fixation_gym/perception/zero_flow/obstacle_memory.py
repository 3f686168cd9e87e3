"""Short-term memory of things in front: zero-flow evidence of the last seconds, kept where it was seen.

One frame shows only edges that happen to lie across the motion, and what leaves the image is still there. So every
pixel that is surely in front leaves its 3-D point; points fade within seconds, sooner in view than out of it, and
vanish within a few frames where the camera sees through them. Value in, value out.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import inverse, transform
from fixation_gym.perception.zero_flow.memory_kernels import standing_depths
from fixation_gym.perception.zero_flow.zero_flow import ZeroFlow
from fixation_gym.types import FloatArray, MaskArray

_NEIGHBOURHOOD = np.ones((5, 5), np.uint8)
"""Window of the flow, px of its grid."""
_CORE = np.ones((3, 3), np.uint8)
"""What of a pixel's surroundings must stand there, too: the window smears every outline by up to two pixels; what is
thin appears as wide as the window, so something is left of it."""
_NO_SURFACE = np.zeros(4)
_GRID_BITS = 20
"""Bits of a voxel's index along one axis: at 15 mm they reach 8 km, beyond any table."""
_HALF_GRID = 1 << (_GRID_BITS - 1)


@dataclass(frozen=True, slots=True)
class MemorySettings:
    """How evidence is kept."""

    voxel_m: float = 0.015
    """Evidence within a cube of this size is one point, m."""
    min_probability: float = 0.97
    """A pixel leaves a point if it is in front with this probability."""
    max_relative_std: float = 0.05
    """... and if its inverse depth is known to this share."""
    decay_s: float = 20.0
    """Time in which evidence fades to 1/e, s."""
    decay_in_view_s: float = 5.0
    """... where something is known near it in the image: what stands there is seen again, what moved on is not, s."""
    contradiction: float = 0.6
    """Factor on the evidence of a point where the camera now sees something behind it."""
    contradiction_share: float = 0.08
    """What is seen is behind a point if its inverse depth is less by this share, and by two standard deviations."""
    saturation: float = 20.0
    """Largest evidence of a point, in frames."""
    forget_below: float = 0.2
    """Points with less evidence are dropped, in frames."""
    height_m: float = 0.02
    """What stands behind the fixated object counts if it rises above the table by this, m, ..."""
    height_sigmas: float = 2.5
    """... by so many standard deviations of its inverse depth, ..."""
    farthest: float = 1.6
    """... and if it is not farther than so many times the fixated distance."""
    min_evidence: float = 5.0
    """Points with less are not believed yet, in frames."""


@dataclass(frozen=True, slots=True, eq=False)
class ObstacleMemory:
    """Points and how often they were seen."""

    keys: NDArray[np.int64]
    """Numbers of the voxels, shape (n,), in rising order."""
    points: FloatArray
    """Mean place of what was seen in each voxel, shape (n, 3), in base, m."""
    evidence: FloatArray
    """Frames in which each voxel was in front, faded, shape (n,)."""
    time: float

    @classmethod
    def empty(cls, time: float = 0.0) -> ObstacleMemory:
        """Nothing seen yet."""
        return cls(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0), time)


def remember(
    memory: ObstacleMemory,
    zero_flow: ZeroFlow,
    intrinsics: Intrinsics,
    T_base_cam: FloatArray,
    time: float,
    settings: MemorySettings,
    support_height_m: float | None = None,
) -> ObstacleMemory:
    """Add the evidence of one zero-flow test.

    With a support height, what stands behind the fixated object is remembered as well: the test says how much nearer
    or farther every pixel is, and from another side it is in front.

    Args:
        memory: what is remembered.
        zero_flow: the test.
        intrinsics: of its pixel grid.
        T_base_cam: camera pose at the time of the test, shape (4, 4).
        time: of the test, s.
        settings: how evidence is kept.
        support_height_m: height of the table in base, m; None: unknown, then only what is in front is remembered.
    """
    tested, contradicted = _looked_at(memory, zero_flow, intrinsics, T_base_cam, settings)
    decay_s = np.where(tested, settings.decay_in_view_s, settings.decay_s)
    faded = memory.evidence * np.exp(-max(0.0, time - memory.time) / decay_s)
    faded = faded * np.where(contradicted, settings.contradiction, 1.0)
    seen = _standing_points(zero_flow, intrinsics, T_base_cam, settings, support_height_m)
    new_keys, new_points = _by_voxel(seen, settings.voxel_m)
    keys, index = np.unique(np.concatenate([memory.keys, new_keys]), return_inverse=True)
    weights = np.concatenate([faded, np.ones(len(new_keys))])
    evidence, points = _sums(index, weights, np.concatenate([memory.points, new_points]), len(keys))
    keep = evidence > settings.forget_below
    evidence = np.minimum(evidence[keep], settings.saturation)
    return ObstacleMemory(keys[keep], points[keep], evidence, time)


def _by_voxel(points: FloatArray, voxel_m: float) -> tuple[NDArray[np.int64], FloatArray]:
    """Numbers of the voxels that hold points, unique, shape (n,), and the mean of the points in each, shape (n, 3)."""
    x, y, z = (np.clip(np.floor(points / voxel_m), -_HALF_GRID, _HALF_GRID - 1).astype(np.int64) + _HALF_GRID).T
    # One number for each: rows of three are sorted five times as slowly.
    keys, index = np.unique((x << 2 * _GRID_BITS) | (y << _GRID_BITS) | z, return_inverse=True)
    return keys, _sums(index, np.ones(len(points)), points, len(keys))[1]


def _sums(
    index: NDArray[np.intp], weights: FloatArray, points: FloatArray, count: int
) -> tuple[FloatArray, FloatArray]:
    """Sum of the weights with each index, shape (count,), and weighted mean of the points, shape (count, 3)."""
    total = np.bincount(index, weights, count).astype(np.float64)
    sums = [np.bincount(index, weights * column, count) for column in points.T]
    return total, np.stack(sums, axis=-1) / np.maximum(total, 1e-12)[:, None]


def believed_points(memory: ObstacleMemory, settings: MemorySettings) -> tuple[FloatArray, FloatArray]:
    """Points with enough evidence, shape (n, 3) in base in m, and their evidence, shape (n,)."""
    believed = memory.evidence >= settings.min_evidence
    return memory.points[believed], memory.evidence[believed]


def _standing_points(
    zero_flow: ZeroFlow,
    intrinsics: Intrinsics,
    T_base_cam: FloatArray,
    settings: MemorySettings,
    support_height_m: float | None,
) -> FloatArray:
    """Points of the pixels that surely show something that stands in the work space, shape (n, 3), in base, m."""
    x, y = intrinsics.grid
    surface = _NO_SURFACE
    if support_height_m is not None:
        rise = min(support_height_m + settings.height_m - float(T_base_cam[2, 3]), -1e-3)
        surface = np.array([*T_base_cam[2, :3].tolist(), rise])
    depths = np.empty(zero_flow.inverse_depth.shape, np.float32)
    bounds = np.array(
        [
            settings.max_relative_std,
            settings.min_probability,
            settings.height_sigmas,
            zero_flow.fixated_inverse_depth / settings.farthest,
        ],
        np.float32,
    )
    tested = zero_flow.inverse_depth, zero_flow.inverse_depth_std, zero_flow.p_nearer, zero_flow.supported
    standing_depths(*tested, x[0], y[:, 0], surface, bounds, depths)
    # At an outline the flow's window mixes the thing with what is behind it; the thing is the nearest in sight there.
    nearest = cv2.dilate(depths, _NEIGHBOURHOOD)
    rows, columns = np.nonzero(cv2.erode((depths > 0.0).view(np.uint8), _CORE))
    depth = 1.0 / nearest[rows, columns].astype(np.float64)
    rays = np.stack([x[0, columns], y[rows, 0], np.ones(len(rows))], axis=-1)
    return transform(T_base_cam, rays * depth[:, None])


def seen_places(
    places: FloatArray, zero_flow: ZeroFlow, intrinsics: Intrinsics, T_base_cam: FloatArray, slack: float
) -> MaskArray:
    """Which places, shape (n, 3), in base, m, are in view and not behind something, shape (n,).

    Args:
        places: to ask about.
        zero_flow: the test of the present frame.
        intrinsics: of its pixel grid.
        T_base_cam: camera pose at its time, shape (4, 4).
        slack: a thing hides a place if it is nearer by this share.
    """
    points = transform(inverse(T_base_cam), places)
    pixels, in_view = _pixels(points, intrinsics)
    seen = np.zeros(len(places), dtype=np.bool_)
    columns, rows = pixels[in_view].astype(np.int64).T
    with np.errstate(invalid="ignore"):
        hidden = zero_flow.supported & (zero_flow.inverse_depth > 0.0)
        hidden_by = np.where(hidden, zero_flow.inverse_depth, np.float32(0.0))[rows, columns]
    seen[in_view] = hidden_by * points[in_view, 2] < 1.0 + slack
    return seen


def _pixels(points: FloatArray, intrinsics: Intrinsics) -> tuple[FloatArray, MaskArray]:
    """Nearest pixels of points, (n, 3) in ``cam`` in m, as whole numbers, shape (n, 2), and which are in view, (n,)."""
    with np.errstate(invalid="ignore"):
        pixels = np.rint(intrinsics.project(points))
        u, v = pixels[:, 0], pixels[:, 1]
        return pixels, (u >= 0) & (u < intrinsics.width) & (v >= 0) & (v < intrinsics.height)


def _looked_at(
    memory: ObstacleMemory,
    zero_flow: ZeroFlow,
    intrinsics: Intrinsics,
    T_base_cam: FloatArray,
    settings: MemorySettings,
) -> tuple[MaskArray, MaskArray]:
    """Points near whose pixel something is known, and those where it is clearly behind them; each of shape (n,)."""
    points = transform(inverse(T_base_cam), memory.points)
    pixels, in_view = _pixels(points, intrinsics)
    tested, contradicted = np.zeros((2, len(points)), dtype=np.bool_)
    columns, rows = pixels[in_view].astype(np.int64).T
    known = zero_flow.supported
    nearest_possible = zero_flow.inverse_depth + np.float32(2.0) * zero_flow.inverse_depth_std
    # A point is known to its voxel only, and the background starts at the outline of what it belongs to.
    nearest_around = cv2.dilate(np.where(known | zero_flow.outline, nearest_possible, np.float32(0.0)), _NEIGHBOURHOOD)
    behind = nearest_around[rows, columns] * points[in_view, 2] < 1.0 - settings.contradiction_share
    tested[in_view] = nearest_around[rows, columns] > 0.0
    contradicted[in_view] = known[rows, columns] & behind
    return tested, contradicted
