"""Where a camera whose calibration is a little wrong sees a target, and the derivatives of that.

Unknowns, shape (11,): the target (alpha, beta, rho), seen from an anchor camera as in ``pose_filter``; and what stays
wrong for a whole run: the hand-eye error (translation t, rotation vector r, in the camera frame), the age tau of the
image when the pose is read, and the relative error f of the focal length.

With q the target in the believed camera, the image shows (1 + f) times the ray q + t + v tau + (r + w tau) x q.
Frames are rows of numbers, so that hundreds of them are one array. Pure functions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fixation_gym.geometry.twist import crosses, skews
from fixation_gym.types import FloatArray

UNKNOWNS = 11
TARGET, TRANSLATION, ROTATION, AGE, FOCAL = slice(0, 3), slice(3, 6), slice(6, 9), 9, 10
"""Where each is among the unknowns."""
ROW, TWIST = 57, slice(48, 54)
"""Numbers that describe a frame, and where its twist is among them."""
_NEAREST = 0.1
"""Rays are taken to reach at least so far along the optical axis, as a share of the first distance."""


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """One frame: where the camera is believed to be, how it moves, and where the target is seen."""

    T_base_cam: FloatArray
    """Believed pose, shape (4, 4)."""
    pose_cov: FloatArray
    """Covariance of its noise [translation, rotation vector] in the camera frame, shape (6, 6)."""
    twist: FloatArray
    """Measured twist [v, w] in the camera frame, shape (6,)."""
    centroid: FloatArray | None
    """Normalised image coordinates of the target, shape (2,); None when it is not seen."""
    image_std: float = 0.0
    """Standard deviation of the target's pixels about the centroid, normalised."""
    centroid_std: float | None = None
    """Standard deviation of the centroid, normalised, if it is not the usual one of a target of that size."""


@dataclass(frozen=True, slots=True)
class Misfit:
    """How well frames fit: a sum of normalised innovations squared that is about ``dof`` if noise is as stated."""

    nis: float = 0.0
    dof: float = 0.0

    def __add__(self, other: Misfit) -> Misfit:
        return Misfit(self.nis + other.nis, self.dof + other.dof)


def frame_row(T_base_anchor: FloatArray, sighting: Sighting, centroid_std: float) -> FloatArray:
    """A frame as a row: rotation and baseline of the anchor in the camera, pose noise, twist, centroid, its noise."""
    assert sighting.centroid is not None
    rotation = sighting.T_base_cam[:3, :3].T
    return np.concatenate(
        [
            (rotation @ T_base_anchor[:3, :3]).ravel(),
            rotation @ (T_base_anchor[:3, 3] - sighting.T_base_cam[:3, 3]),
            sighting.pose_cov.ravel(),
            sighting.twist,
            sighting.centroid,
            [centroid_std],
        ]
    )


def innovations(mean: FloatArray, rows: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Innovation (n, 2), derivative of the expected centroid by the unknowns (n, 2, 11) and by pose noise (n, 2, 6).

    With z the centroid and s the ray to the target, the measurement is taken as z s_z - (1 + f) s_xy = 0: the noise of
    the pose, far larger than the one of z, then does not enter the derivatives. Linearised about the expected centroid,
    innovation and derivative share that noise, and the hand-eye translation drifts by many standard deviations.

    Args:
        mean: the unknowns, shape (11,).
        rows: frames, shape (n, 57).
    """
    rotation, baseline = rows[:, :9].reshape(-1, 3, 3), rows[:, 9:12]
    v, w, centroid = rows[:, 48:51], rows[:, 51:54], rows[:, 54:56]
    rho, t, tau, f = mean[2], mean[TRANSLATION], mean[AGE], mean[FOCAL]
    scaled = rotation @ np.array([mean[0], mean[1], 1.0]) + rho * baseline  # q times rho: finite at infinity
    turn = skews(mean[ROTATION] + tau * w)
    shift = t + tau * v
    ray = scaled + rho * shift + (turn @ scaled[..., None])[..., 0]
    by_target = np.concatenate([rotation[:, :, :2], baseline[..., None]], axis=2)
    by_unknowns = np.zeros((len(rows), 3, UNKNOWNS))
    by_unknowns[:, :, :3] = by_target + turn @ by_target
    by_unknowns[:, :, 2] += shift
    by_unknowns[:, (0, 1, 2), (3, 4, 5)] = rho
    by_unknowns[:, :, ROTATION] = -skews(scaled)
    by_unknowns[:, :, AGE] = rho * v + crosses(w, scaled)
    ahead = np.maximum(ray[:, 2], _NEAREST)[:, None]
    project = np.zeros((len(rows), 2, 3))
    project[:, 0, 0] = project[:, 1, 1] = 1.0 + f
    project[:, :, 2] = -centroid
    project /= ahead[..., None]
    by_centroid = project @ by_unknowns
    by_centroid[:, :, FOCAL] = ray[:, :2] / ahead
    return -(project @ ray[..., None])[..., 0], by_centroid, by_centroid[:, :, 3:9]


def innovation_cov(rows: FloatArray, by_pose: FloatArray) -> FloatArray:
    """Covariance of the innovations by centroid and pose noise, without the one of the unknowns, shape (n, 2, 2)."""
    pose_cov = rows[:, 12:48].reshape(-1, 6, 6)
    return (rows[:, 56] ** 2)[:, None, None] * np.eye(2) + by_pose @ pose_cov @ np.swapaxes(by_pose, 1, 2)


def with_likely_poses(rows: FloatArray, by_pose: FloatArray, weight: FloatArray, innovation: FloatArray) -> FloatArray:
    """Rows with the poses that explain the innovations best (least squares with errors in all variables)."""
    pose_cov = rows[:, 12:48].reshape(-1, 6, 6)
    error = (pose_cov @ np.swapaxes(by_pose, 1, 2) @ weight @ innovation[..., None])[..., 0]
    rotation, baseline = rows[:, :9].reshape(-1, 3, 3), rows[:, 9:12, None]
    turn = skews(error[:, 3:])
    adjusted = rows.copy()
    adjusted[:, :9] += (turn @ rotation).reshape(-1, 9)
    adjusted[:, 9:12] += error[:, :3] + (turn @ baseline)[..., 0]
    return adjusted
