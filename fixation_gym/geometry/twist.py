"""Twists [v, w] in m/s and rad/s: rates, finite motions and changes of frame."""

from __future__ import annotations

import math

import numpy as np

from fixation_gym.geometry.rigid import inverse, rotation_vector
from fixation_gym.types import FloatArray


def skew(vector: FloatArray) -> FloatArray:
    """Matrix S, shape (3, 3), with S @ p = cross(vector, p)."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def skews(vectors: FloatArray) -> FloatArray:
    """``skew`` of every vector, shape (n, 3, 3), of vectors of shape (n, 3)."""
    x, y, z = vectors.T
    result = np.zeros((len(vectors), 3, 3))
    result[:, 2, 1], result[:, 0, 2], result[:, 1, 0] = x, y, z
    result[:, 1, 2], result[:, 2, 0], result[:, 0, 1] = -x, -y, -z
    return result


def crosses(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross products, shape (n, 3), of vectors of shape (n, 3); for few of them ``np.cross`` takes far longer."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


def adjoint(T_a_b: FloatArray) -> FloatArray:
    """Matrix, shape (6, 6), that turns the twist [v, w] of a body expressed in b into the one expressed in a."""
    rotation, position = T_a_b[:3, :3], T_a_b[:3, 3]
    result = np.zeros((6, 6))
    result[:3, :3] = result[3:, 3:] = rotation
    result[:3, 3:] = skew(position) @ rotation
    return result


def exp_twist(twist: FloatArray, duration: float) -> FloatArray:
    """Motion T, shape (4, 4), of a frame that keeps its own-frame twist for ``duration`` s.

    T_a_cam @ T is the new pose.
    """
    turn = skew(np.asarray(twist[3:]) * duration)
    angle = math.sqrt(float(0.5 * (turn * turn).sum()))
    # I + a W + b W^2 is the rotation and I + b W + c W^2 times v the translation (Rodrigues); 1 - a loses digits for
    # small angles, but its product with W^2 does not, so the series is only needed where angle^2 vanishes beside 1.
    a, b, c = 1.0, 1.0 / 2.0, 1.0 / 6.0
    if angle > 1e-6:
        a, b = math.sin(angle) / angle, 2.0 * (math.sin(0.5 * angle) / angle) ** 2
        c = (1.0 - a) / angle**2
    square = turn @ turn
    motion = np.eye(4)
    motion[:3, :3] += a * turn + b * square
    motion[:3, 3] = (np.eye(3) + b * turn + c * square) @ (np.asarray(twist[:3]) * duration)
    return motion


def mean_twist(T_a_start: FloatArray, T_a_end: FloatArray, duration: float) -> FloatArray:
    """Constant own-frame twist, shape (6,), that carries the first pose to the second in ``duration`` s.

    Raises:
        ValueError: if ``duration`` is not positive.
    """
    if duration <= 0.0:
        raise ValueError(f"duration must be positive, got {duration}")
    motion = inverse(T_a_start) @ T_a_end
    x, y, z = rotation_vector(motion[:3, :3])
    tx, ty, tz = motion[:3, 3].tolist()
    angle = math.sqrt(x * x + y * y + z * z)
    # Below 1e-4 rad the closed form divides rounding errors by angle^2; the Taylor value 1/12 is exact to 1e-9.
    factor = 1.0 / 12.0 if angle < 1e-4 else (1.0 - 0.5 * angle / math.tan(0.5 * angle)) / angle**2
    # v = t - r x t / 2 + factor r x (r x t): the inverse of the left Jacobian of SE(3), in scalars for speed.
    cx, cy, cz = y * tz - z * ty, z * tx - x * tz, x * ty - y * tx
    vx = tx - 0.5 * cx + factor * (y * cz - z * cy)
    vy = ty - 0.5 * cy + factor * (z * cx - x * cz)
    vz = tz - 0.5 * cz + factor * (x * cy - y * cx)
    return np.array([vx, vy, vz, x, y, z]) / duration
