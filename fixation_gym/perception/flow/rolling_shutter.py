"""A rolling shutter exposes every row at its own time: where a row of the middle frame is seen in another frame.

With the twist that the camera has in each frame, and how that changes from row to row. Where a point is seen changes
slowly over a picture, so it is computed at nodes and interpolated between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import inverse
from fixation_gym.geometry.twist import mean_twist
from fixation_gym.perception.scratch import Float32Array
from fixation_gym.types import FloatArray

PixelMap = tuple[Float32Array, Float32Array]
"""Columns and rows in another frame for every pixel of the middle one, each of shape (H, W), px."""
_BLOCK = 8
"""Pixels from node to node: the motion between two frames is smooth, so this is good to a hundredth of a pixel."""
_LEAST_DEPTH = 1e-3
"""What is behind another frame's camera is beyond its border, too: ``Flow.overlap`` leaves it out."""


@dataclass(frozen=True, slots=True, eq=False)
class RowMotion:
    """How the camera moved while a picture was read out: its mean twist from the middle row to one t later."""

    twist: FloatArray
    """In the middle row, [v, w] in ``cam``, shape (6,), m/s and rad/s."""
    change: FloatArray
    """What the mean twist has more for each second of t: half of the acceleration, shape (6,)."""


def row_motion(poses: Sequence[FloatArray], half_s: float) -> RowMotion:
    """Motion by the poses of the first, the middle and the last row, ``half_s`` apart, each of shape (4, 4)."""
    first, middle, last = poses
    twists = mean_twist(first, middle, half_s), mean_twist(middle, last, half_s)
    return RowMotion(0.5 * (twists[0] + twists[1]), (twists[1] - twists[0]) / (2.0 * half_s))


def row_motions(poses: Sequence[FloatArray], times: Sequence[float]) -> tuple[RowMotion, RowMotion, RowMotion]:
    """Motion in each of three pictures by their poses alone: one acceleration for all; arguments as ``row_maps``."""
    first, middle, last = poses
    before, after = times[1] - times[0], times[2] - times[1]
    twists = mean_twist(first, middle, before), mean_twist(middle, last, after)
    change = (twists[1] - twists[0]) / (before + after)
    at_each = twists[0] - change * before, twists[0] + change * before, twists[1] + change * after
    first, middle, last = (RowMotion(twist, change) for twist in at_each)
    return first, middle, last


def row_maps(
    poses: Sequence[FloatArray],
    motions: Sequence[RowMotion],
    inverse_depth: float,
    intrinsics: Intrinsics,
) -> tuple[PixelMap, PixelMap]:
    """Maps from pixels of the middle one of three frames to the first and to the last, for points of one depth.

    Args:
        poses: camera poses in base when the middle rows were exposed, each of shape (4, 4).
        motions: of the camera during each of the frames.
        inverse_depth: d of the points as the camera of their row in the middle frame sees them, 1/m.
        intrinsics: of the frames, with ``readout_s``.
    """
    first, middle, last = poses
    columns, rows = _nodes(intrinsics.width), _nodes(intrinsics.height)
    x, y = np.meshgrid((columns - intrinsics.cx) / intrinsics.fx, (rows - intrinsics.cy) / intrinsics.fy)
    seen = np.stack([x, y, np.ones_like(x)])
    own_s = _time_of_row(rows, intrinsics)[:, None]
    seen = seen + own_s * _rate(seen, motions[1].twist, inverse_depth)
    seen = seen + own_s**2 * _rate(seen, motions[1].change, inverse_depth)
    to_first = _in_other(seen, inverse(first) @ middle, motions[0], inverse_depth, intrinsics)
    to_last = _in_other(seen, inverse(last) @ middle, motions[2], inverse_depth, intrinsics)
    return to_first, to_last


def _in_other(
    seen: FloatArray, T_other_middle: FloatArray, motion: RowMotion, inverse_depth: float, intrinsics: Intrinsics
) -> PixelMap:
    """Pixels of another frame for points in the middle camera, shape (3, h, w), times their inverse depth."""
    points = np.tensordot(T_other_middle[:3, :3], seen, 1) + inverse_depth * T_other_middle[:3, 3, None, None]
    # The row, and with it the time, from where the point is in the middle row's camera; then once more.
    rate, bend = _rate(points, motion.twist, inverse_depth), _rate(points, motion.change, inverse_depth)
    moved = points
    for _ in range(2):
        row = intrinsics.fy * moved[1] / np.maximum(moved[2], _LEAST_DEPTH) + intrinsics.cy
        late_s = _time_of_row(row, intrinsics)
        moved = points - late_s * (rate + late_s * bend)
    in_front = np.maximum(moved[2], _LEAST_DEPTH)
    columns = intrinsics.fx * moved[0] / in_front + intrinsics.cx
    rows = intrinsics.fy * moved[1] / in_front + intrinsics.cy
    return _between_nodes(columns, intrinsics), _between_nodes(rows, intrinsics)


def _nodes(pixels: int) -> FloatArray:
    """Places of the nodes along a side: in the middle of every block of pixels, and of one more at each end."""
    return (np.arange(-1.0, -(-pixels // _BLOCK) + 1.0) + 0.5) * _BLOCK - 0.5


def _between_nodes(values: FloatArray, intrinsics: Intrinsics) -> Float32Array:
    """Values of all pixels, shape (H, W), from those at the nodes, shape (h, w)."""
    size = values.shape[1] * _BLOCK, values.shape[0] * _BLOCK
    fine = np.asarray(cv2.resize(values, size, interpolation=cv2.INTER_LINEAR), np.float32)
    return fine[_BLOCK : _BLOCK + intrinsics.height, _BLOCK : _BLOCK + intrinsics.width]


def _rate(points: FloatArray, twist: FloatArray, inverse_depth: float) -> FloatArray:
    """How points, shape (3, h, w), times their inverse depth, move into the camera's frame of a moment before, 1/s.

    That is w x p + d v: what a camera with this twist sees a moment later is at p + dt (w x p + d v) now.
    """
    (vx, vy, vz, wx, wy, wz), (x, y, z) = twist, points
    return np.stack(
        [
            wy * z - wz * y + inverse_depth * vx,
            wz * x - wx * z + inverse_depth * vy,
            wx * y - wy * x + inverse_depth * vz,
        ]
    )


def _time_of_row(row: FloatArray, intrinsics: Intrinsics) -> FloatArray:
    """When rows are exposed, s from the middle row."""
    return (row - 0.5 * (intrinsics.height - 1)) * (intrinsics.readout_s / max(intrinsics.height - 1, 1))
