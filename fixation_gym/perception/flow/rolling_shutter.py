"""A rolling shutter exposes every row at its own time: where a row of the middle frame is seen in another frame.

To first order in the time between rows, with the twist that the camera has in each frame. Where that is changes slowly
over a picture, so it is computed at nodes and interpolated between them.
"""

from __future__ import annotations

from collections.abc import Sequence

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


def row_maps(
    poses: Sequence[FloatArray], times: Sequence[float], inverse_depth: float, intrinsics: Intrinsics
) -> tuple[PixelMap, PixelMap]:
    """Maps from pixels of the middle one of three frames to the first and to the last, for points of one depth.

    Args:
        poses: camera poses in base at ``times``, when the middle rows were exposed, each of shape (4, 4).
        times: increasing, s.
        inverse_depth: d of the points as the camera of their row in the middle frame sees them, 1/m.
        intrinsics: of the frames, with ``readout_s``.
    """
    first, middle, last = poses
    before, after = times[1] - times[0], times[2] - times[1]
    twists = mean_twist(first, middle, before), mean_twist(middle, last, after)
    change = (twists[1] - twists[0]) / (before + after)  # half of the acceleration
    columns, rows = _nodes(intrinsics.width), _nodes(intrinsics.height)
    x, y = np.meshgrid((columns - intrinsics.cx) / intrinsics.fx, (rows - intrinsics.cy) / intrinsics.fy)
    seen = np.stack([x, y, np.ones_like(x)])
    own_s = _time_of_row(rows, intrinsics)[:, None]
    seen = seen + own_s * _rate(seen, twists[0] + change * before, inverse_depth)
    to_first = _in_other(seen, inverse(first) @ middle, twists[0] - change * before, inverse_depth, intrinsics)
    to_last = _in_other(seen, inverse(last) @ middle, twists[1] + change * after, inverse_depth, intrinsics)
    return to_first, to_last


def _in_other(
    seen: FloatArray, T_other_middle: FloatArray, twist: FloatArray, inverse_depth: float, intrinsics: Intrinsics
) -> PixelMap:
    """Pixels of another frame for points in the middle camera, shape (3, h, w), times their inverse depth."""
    points = np.tensordot(T_other_middle[:3, :3], seen, 1) + inverse_depth * T_other_middle[:3, 3, None, None]
    # The row, and with it the time, from where the point is in the middle row's camera; then once more.
    rate, moved = _rate(points, twist, inverse_depth), points
    for _ in range(2):
        row = intrinsics.fy * moved[1] / np.maximum(moved[2], _LEAST_DEPTH) + intrinsics.cy
        moved = points - _time_of_row(row, intrinsics) * rate
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
