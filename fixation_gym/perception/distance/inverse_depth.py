"""Algebra of the inverse-depth filter: how a camera sees (alpha, beta, rho), and one Gauss-Newton step.

(alpha, beta, rho) are image coordinates in an anchor camera and the inverse depth there, 1/m. All is written in
scalars: a NumPy call on three numbers costs as much as twenty of them.
"""

from __future__ import annotations

import numpy as np

from fixation_gym.types import FloatArray

Vector = tuple[float, float, float]
Rows = list[list[float]]

MIN_INVERSE_DEPTH = 1e-3
"""Objects farther than 1 km are put there, 1/m."""
MIN_DEPTH_M = 0.01
"""Objects nearer than this, or behind the camera, are reported at this depth, m."""


def view_rows(T_base_anchor: FloatArray, T_base_cam: FloatArray) -> Rows:
    """Rows (r_x, r_y, r_z, b) of the anchor's rotation and of the baseline to it, as the camera sees them.

    The image of the state is the direction with components r_x alpha + r_y beta + r_z + b rho.
    """
    to_cam = T_base_cam[:3, :3].T
    rows = np.empty((3, 4))
    rows[:, :3] = to_cam @ T_base_anchor[:3, :3]
    rows[:, 3] = to_cam @ (T_base_anchor[:3, 3] - T_base_cam[:3, 3])
    return rows.tolist()


def projection(view: Rows, mean: Vector) -> tuple[tuple[float, float], tuple[Vector, Vector]]:
    """Image (x, y) of the point and the derivatives of x and of y by (alpha, beta, rho)."""
    alpha, beta, rho = mean
    (xa, xb, xc, xr), (ya, yb, yc, yr), (za, zb, zc, zr) = view
    depth = max(za * alpha + zb * beta + zc + zr * rho, 1e-3)
    x = (xa * alpha + xb * beta + xc + xr * rho) / depth
    y = (ya * alpha + yb * beta + yc + yr * rho) / depth
    by_x = ((xa - x * za) / depth, (xb - x * zb) / depth, (xr - x * zr) / depth)
    by_y = ((ya - y * za) / depth, (yb - y * zb) / depth, (yr - y * zr) / depth)
    return (x, y), (by_x, by_y)


def correction(
    view: Rows, prior: Vector, mean: Vector, cov: Rows, seen: tuple[float, float], noise: float
) -> tuple[Vector, float, list[tuple[float, float]], tuple[Vector, Vector]]:
    """Linearise at ``mean`` and correct ``prior``.

    Returns:
        The corrected mean, the normalised innovation squared, the gain (3 rows of 2) and the jacobian (2 rows of 3).
    """
    (x, y), jacobian = projection(view, mean)
    jx, jy = jacobian
    px, py = product(cov, jx), product(cov, jy)
    change = (prior[0] - mean[0], prior[1] - mean[1], prior[2] - mean[2])
    ex = seen[0] - x - (jx[0] * change[0] + jx[1] * change[1] + jx[2] * change[2])
    ey = seen[1] - y - (jy[0] * change[0] + jy[1] * change[1] + jy[2] * change[2])
    sxx = jx[0] * px[0] + jx[1] * px[1] + jx[2] * px[2] + noise
    sxy = jx[0] * py[0] + jx[1] * py[1] + jx[2] * py[2]
    syy = jy[0] * py[0] + jy[1] * py[1] + jy[2] * py[2] + noise
    determinant = sxx * syy - sxy * sxy
    gain = [((a * syy - b * sxy) / determinant, (b * sxx - a * sxy) / determinant) for a, b in zip(px, py, strict=True)]
    (ax, ay), (bx, by), (rx, ry) = gain
    alpha, beta = prior[0] + ax * ex + ay * ey, prior[1] + bx * ex + by * ey
    rho = max(prior[2] + rx * ex + ry * ey, MIN_INVERSE_DEPTH)
    nis = (syy * ex * ex - 2.0 * sxy * ex * ey + sxx * ey * ey) / determinant
    return (alpha, beta, rho), nis, gain, jacobian


def product(matrix: Rows, vector: Vector) -> Vector:
    """Product of a (3, 3) matrix and a vector."""
    a, b, c = vector
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = matrix
    return xx * a + xy * b + xz * c, yx * a + yy * b + yz * c, zx * a + zy * b + zz * c
