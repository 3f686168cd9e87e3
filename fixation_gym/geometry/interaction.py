"""How image points move when the camera moves (Battaje & Brock 2022, Eqs. 1-5, with corrected rotation signs).

Conventions: twist [v, w] of the camera in its own optical frame, m/s and rad/s; x, y normalised image coordinates;
d = 1/Z inverse depth in 1/m; flow in normalised coordinates per second.

The paper prints the fixation coupling (Eqs. 2, 3) for the rotation of the scene. With the camera twist of Eq. 1 it is
w_X = +v_Y d_f, w_Y = -v_X d_f; only this makes the flow at the fixation point vanish.
"""

from __future__ import annotations

import numpy as np

from fixation_gym.types import FloatArray


def translation_part(x: FloatArray | float, y: FloatArray | float) -> FloatArray:
    """Matrix A of Eq. 1, shape (..., 2, 3): flow = d A v + B w."""
    x, y = np.broadcast_arrays(np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64))
    one, zero = np.ones_like(x), np.zeros_like(x)
    return np.stack([np.stack([-one, zero, x], -1), np.stack([zero, -one, y], -1)], -2)


def rotation_part(x: FloatArray | float, y: FloatArray | float) -> FloatArray:
    """Matrix B of Eq. 1, shape (..., 2, 3): flow = d A v + B w."""
    x, y = np.broadcast_arrays(np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64))
    return np.stack([np.stack([x * y, -(1 + x**2), y], -1), np.stack([1 + y**2, -x * y, -x], -1)], -2)


def interaction_matrix(x: FloatArray | float, y: FloatArray | float, inverse_depth: FloatArray | float) -> FloatArray:
    """Interaction matrix of Eq. 1, shape (..., 2, 6), for the twist [v, w]."""
    d = np.asarray(inverse_depth, dtype=np.float64)[..., None, None]
    return np.concatenate([d * translation_part(x, y), rotation_part(x, y)], axis=-1)


def image_flow(
    x: FloatArray, y: FloatArray, inverse_depth: FloatArray | float, twist: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Flow (x_dot, y_dot) of Eq. 1 at every point, each of the shape of ``x``, 1/s."""
    v, w = twist[:3], twist[3:]
    gx, gy = epipolar_direction(x, y, v)
    flow_x = inverse_depth * gx + x * y * w[0] - (1 + x**2) * w[1] + y * w[2]
    flow_y = inverse_depth * gy + (1 + y**2) * w[0] - x * y * w[1] - x * w[2]
    return flow_x, flow_y


def epipolar_direction(x: FloatArray, y: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Vector g = A v = (x v_Z - v_X, y v_Z - v_Y), m/s: the flow per unit of inverse depth."""
    return x * v[2] - v[0], y * v[2] - v[1]


def fixation_coupling(v: FloatArray, inverse_distance: float) -> FloatArray:
    """Rotation (w_X, w_Y), rad/s, that holds the point (0, 0, 1/d_f) still in the image (Eqs. 2, 3, corrected)."""
    return np.array([v[1] * inverse_distance, -v[0] * inverse_distance])


def inverse_depth_rate(x: float, y: float, inverse_depth: float, twist: FloatArray) -> float:
    """Rate of d = 1/Z of a static point at (x, y), 1/(m s): d^2 v_Z + d (w_X y - w_Y x)."""
    return inverse_depth**2 * twist[2] + inverse_depth * (twist[3] * y - twist[4] * x)
