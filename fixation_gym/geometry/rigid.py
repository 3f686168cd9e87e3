"""Rigid transforms. ``T_a_b`` maps coordinates in b to a, so adjacent names cancel: T_a_c = T_a_b @ T_b_c."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from fixation_gym.types import FloatArray


def pose_to_matrix(pose: FloatArray) -> FloatArray:
    """Pose (7,), position in m and quaternion (w, x, y, z), to a homogeneous matrix of shape (4, 4)."""
    pose = np.asarray(pose, dtype=np.float64)
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat(pose[[4, 5, 6, 3]]).as_matrix()
    matrix[:3, 3] = pose[:3]
    return matrix


def matrix_to_pose(matrix: FloatArray) -> FloatArray:
    """Homogeneous matrix (4, 4) to a pose (7,), position and quaternion (w, x, y, z) with w >= 0."""
    x, y, z, w = Rotation.from_matrix(matrix[:3, :3]).as_quat(canonical=True)
    return np.array([*matrix[:3, 3], w, x, y, z])


def inverse(matrix: FloatArray) -> FloatArray:
    """Inverse of a rigid transform, shape (4, 4)."""
    result = np.eye(4)
    result[:3, :3] = matrix[:3, :3].T
    result[:3, 3] = -matrix[:3, :3].T @ matrix[:3, 3]
    return result


def transform(matrix: FloatArray, points: FloatArray) -> FloatArray:
    """Apply T_a_b, shape (4, 4), to points in b, shape (..., 3), in m."""
    return np.asarray(points) @ matrix[:3, :3].T + matrix[:3, 3]


def look_at(position: FloatArray, target: FloatArray, up: FloatArray) -> FloatArray:
    """T_a_cam, shape (4, 4), of a camera at ``position`` whose optical axis meets ``target``.

    Image "up" is the projection of ``up``. All in frame a, m.

    Raises:
        ValueError: if the viewing direction is parallel to ``up`` or the two points coincide.
    """
    forward = np.asarray(target, dtype=np.float64) - position
    right = np.cross(forward, up)
    if np.linalg.norm(right) < 1e-9 * max(1.0, float(np.linalg.norm(forward))):
        raise ValueError("look_at needs target and position apart and the line between them not parallel to up")
    forward = forward / np.linalg.norm(forward)
    right = right / np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    matrix[:3, 3] = position
    return matrix
