"""Rigid transforms. ``T_a_b`` maps coordinates in b to a, so adjacent names cancel: T_a_c = T_a_b @ T_b_c."""

from __future__ import annotations

import math

import numpy as np

from fixation_gym.types import FloatArray


def pose_to_matrix(pose: FloatArray) -> FloatArray:
    """Pose (7,), position in m and quaternion (w, x, y, z) of any length, to a homogeneous matrix of shape (4, 4).

    Raises:
        ValueError: if the quaternion is zero.
    """
    # Scalars: for a single pose they are several times as fast as arrays and SciPy's Rotation.
    px, py, pz, w, x, y, z = np.asarray(pose, dtype=np.float64).tolist()
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    if norm == 0.0:
        raise ValueError("the quaternion of a pose must not be zero")
    w, x, y, z = w / norm, x / norm, y / norm, z / norm
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y), px],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x), py],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z, pz],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def matrix_to_pose(matrix: FloatArray) -> FloatArray:
    """Homogeneous matrix (4, 4) to a pose (7,), position and quaternion (w, x, y, z) with w >= 0."""
    w, x, y, z = _quaternion(matrix[:3, :3])
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    px, py, pz = matrix[:3, 3].tolist()
    return np.array([px, py, pz, w / norm, x / norm, y / norm, z / norm])


def _quaternion(rotation: FloatArray) -> tuple[float, float, float, float]:
    """Quaternion (w, x, y, z) of any length, w >= 0, of a rotation matrix of shape (3, 3).

    The largest of the four entries is taken from the diagonal and divides the others (Shepperd 1978), so that no angle
    loses digits.
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation.tolist()
    trace = xx + yy + zz
    largest = max(trace, xx, yy, zz)
    if largest == trace:
        w, x, y, z = 1.0 + trace, zy - yz, xz - zx, yx - xy
    elif largest == xx:
        w, x, y, z = zy - yz, 1.0 + xx - yy - zz, xy + yx, xz + zx
    elif largest == yy:
        w, x, y, z = xz - zx, xy + yx, 1.0 - xx + yy - zz, yz + zy
    else:
        w, x, y, z = yx - xy, xz + zx, yz + zy, 1.0 - xx - yy + zz
    return (-w, -x, -y, -z) if w < 0.0 else (w, x, y, z)


def inverse(matrix: FloatArray) -> FloatArray:
    """Inverse of a rigid transform, shape (4, 4)."""
    result = np.zeros((4, 4))
    rotation = matrix[:3, :3].T
    result[:3, :3] = rotation
    result[:3, 3] = -(rotation @ matrix[:3, 3])
    result[3, 3] = 1.0
    return result


def rotation_vector(rotation: FloatArray) -> tuple[float, float, float]:
    """Axis times angle, rad in 0..pi, of a rotation matrix of shape (3, 3)."""
    w, x, y, z = _quaternion(rotation)
    sine = math.sqrt(x * x + y * y + z * z)
    # Both have the same unknown factor, so w > 0 stands for the cosine; for tiny angles angle / sine -> 2 / w.
    scale = 2.0 * math.atan2(sine, w) / sine if sine > 1e-12 * w else 2.0 / w
    return x * scale, y * scale, z * scale


def transform(matrix: FloatArray, points: FloatArray) -> FloatArray:
    """Apply T_a_b, shape (4, 4), to points in b, shape (..., 3), in m."""
    return np.asarray(points) @ matrix[:3, :3].T + matrix[:3, 3]


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product of two vectors, shape (3,): the bits of ``np.cross`` in a tenth of its time."""
    ax, ay, az = a.tolist()
    bx, by, bz = b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def look_at(position: FloatArray, target: FloatArray, up: FloatArray) -> FloatArray:
    """T_a_cam, shape (4, 4), of a camera at ``position`` whose optical axis meets ``target``.

    Image "up" is the projection of ``up``. All in frame a, m.

    Raises:
        ValueError: if the viewing direction is parallel to ``up`` or the two points coincide.
    """
    forward = np.asarray(target, dtype=np.float64) - position
    right = cross(forward, up)
    distance, width = np.linalg.norm(forward), np.linalg.norm(right)
    if width < 1e-9 * max(1.0, float(distance)):
        raise ValueError("look_at needs target and position apart and the line between them not parallel to up")
    forward, right = forward / distance, right / width
    matrix = np.zeros((4, 4))
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = right, cross(forward, right), forward, position
    matrix[3, 3] = 1.0
    return matrix
