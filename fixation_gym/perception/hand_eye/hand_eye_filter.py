"""The hand-eye error, learnt from how the support surface moves in the picture while a robot gazes.

The height of the table is known, and so is how the hand moves; if the camera sits on the hand as was believed, the flow
of the table follows from both. A hand-eye error turns the direction of motion, moves the table and tilts it, each time
by a few percent, and all of this is linear in the error. So a few thousand pixels of table say in a second what a
calibration with a board says; without it Z_f is off by percents, and the table seems to be an obstacle.

Beside the error (translation t, rotation vector r: the true camera in the believed one) two things are learnt: how much
higher the table is, which also takes what kinematic calibration leaves, and the gain of the flow, since gradients
shorten it by some percent. Errors of the momentary twist are unknown, too, and forgotten with each picture.

Value in, value out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np

from fixation_gym.geometry.rigid import cross
from fixation_gym.geometry.twist import skew
from fixation_gym.perception.flow.optic_flow import Flow
from fixation_gym.perception.hand_eye.plane_kernel import COLUMNS, plane_equations
from fixation_gym.types import FloatArray, MaskArray

_UNKNOWNS = 14
"""Hand-eye translation (3) and rotation (3), height, gain of the flow, errors of the velocity (3) and the rate (3)."""
HEIGHT, _GAIN = 6, 7
"""Where the height and the gain are among them."""
_KEPT = 8
"""Unknowns that last: all but the errors of the twist."""
_HAND_EYE = slice(0, 6)
_FIRST = 10
"""The first pictures, whose equations are solved twice; later ones move little."""


@dataclass(frozen=True, slots=True)
class HandEyeSettings:
    """Priors, noise and gates."""

    translation_std_m: float = 3e-3
    """Prior of the hand-eye translation error per axis, m."""
    rotation_std_rad: float = 9e-3
    """Prior of the hand-eye rotation error per axis, rad."""
    height_std_m: float = 5e-3
    """Prior of the error of the surface's height, m."""
    gain: float = -0.04
    """Relative error of the flow's length, as it usually is: gradients shorten it."""
    gain_std: float = 0.02
    """Standard deviation of it."""
    translation_walk_m: float = 2.5e-4
    """Random walk of the translation error, m per square root of a second: a hand's joints have errors, too, and what
    they do depends on the posture."""
    rotation_walk_rad: float = 5e-4
    """The same of the rotation error, rad."""
    height_walk_m: float = 2e-3
    """The same of the height, m."""
    gain_walk: float = 1e-3
    """The same of the gain."""
    velocity_std: float = 5e-4
    """Noise of the camera's velocity between pictures per axis, m/s."""
    rate_std: float = 1e-3
    """Noise of its angular rate per axis, rad/s."""
    least_speed: float = 0.02
    """A camera slower than this, m/s, teaches nothing."""
    nearest_m: float = 0.18
    """Nor does one that is nearer to the target: the hand and what it holds fill the picture, m."""
    stride: int = 4
    """Step between the pixels that are asked, px of the flow's grid."""
    highest_m: float = 0.02
    """What seems higher above or below the surface does not belong to it, m."""
    least_sure_m: float = 0.02
    """Nor is asked what does not know its height to this standard deviation, m."""
    thickness_m: float = 4e-3
    """Standard deviation of what lies on the surface, m."""
    worst_fit_m: float = 8e-3
    """A picture whose pixels lie farther from the surface in the mean is not used, m."""
    shared: float = 400.0
    """Pixels that are wrong together, by their common window and by what lies on the table. This and the noise of the
    twist were chosen in 40 recorded approaches, where what is learnt was nearest to the truth with them."""
    least_pixels: int = 60
    """Pictures with fewer pixels of the surface are not used."""
    translation_floor_m: float = 1.5e-3
    """What pixels that err together and joint errors leave of the translation, m: see ``evidence``."""
    rotation_floor_rad: float = 3e-3
    """The same of the rotation, rad."""
    proven: float = 12.6
    """Evidence from which the error is corrected: 95 % of chi-square with 6 degrees of freedom. A good calibration
    stays as it is."""
    least_pictures: int = 40
    """And this many pictures."""
    proven_by_many: float = 10.6
    """Evidence that is enough after many pictures, 90 %: from many sides pixels no longer err together. In 60
    approaches with nominal noise the evidence was 9.7 at most from 40 pictures on, and 7.2 from 80."""
    many_pictures: int = 80
    """So many."""
    in_a_row: int = 25
    """Pictures that must have enough evidence one after the other: a few with something odd in view may have 17."""
    off_axis: float = 0.12
    """A target farther from the image centre is not fixated, but grasped or lifted, and nothing is learnt; normalised
    image coordinates."""


@dataclass(frozen=True, slots=True, eq=False)
class HandEyeState:
    """What was learnt."""

    mean: FloatArray
    """t in m and r in rad of the true camera in the believed one, height of the surface above where it should be in m,
    relative gain of the flow; shape (8,)."""
    cov: FloatArray
    """Its covariance, shape (8, 8)."""
    proven: bool = False
    """Whether the hand-eye error has shown."""
    pictures: int = 0
    """Pictures that it was learnt from."""
    in_a_row: int = 0
    """The last of these that had enough evidence, one after the other."""

    @property
    def stds(self) -> FloatArray:
        """Standard deviations of the unknowns, shape (8,)."""
        return np.sqrt(np.diag(self.cov))

    @property
    def T_believed_true(self) -> FloatArray:
        """The true camera in the believed one, shape (4, 4); no difference before it is proven."""
        T = np.eye(4)
        if self.proven:
            T[:3, :3], T[:3, 3] = _rotation(self.mean[3:6]), self.mean[:3]
        return T


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceView:
    """A picture, as far as it tells of the surface."""

    flow: Flow
    usable: MaskArray
    """Pixels that are neither target nor robot, shape (h, w)."""
    T_base_believed: FloatArray
    """Camera pose at the flow, uncorrected, shape (4, 4)."""
    twist: FloatArray
    """Mean twist [v, w] over the flow's frames, uncorrected, shape (6,)."""
    warp_twist: FloatArray
    """The twist of the poses that the pictures were warped with, shape (6,)."""
    height_m: float
    """Of the surface in base, m."""
    since_s: float
    """Since the picture before, s."""
    target: FloatArray
    """Where the target is seen, normalised image coordinates, shape (2,)."""
    distance_m: float
    """Of the target, m."""


def first_state(settings: HandEyeSettings) -> HandEyeState:
    """What is known without a picture."""
    stds = [settings.translation_std_m] * 3 + [settings.rotation_std_rad] * 3
    mean = np.zeros(_KEPT)
    mean[_GAIN] = settings.gain
    return HandEyeState(mean, np.diag(np.square([*stds, settings.height_std_m, settings.gain_std])))


def learned(state: HandEyeState, seen: SurfaceView, settings: HandEyeSettings) -> HandEyeState:
    """What is known after a picture; the same if it tells nothing."""
    v = seen.twist[:3]
    fixated = seen.distance_m > settings.nearest_m and float(np.abs(seen.target).max()) < settings.off_axis
    if not seen.flow.valid or not fixated or float(v @ v) < settings.least_speed**2:
        return state
    if seen.height_m >= float(seen.T_base_believed[2, 3]):
        return state
    cov = state.cov + seen.since_s * np.diag(_walk(settings))
    prior = np.zeros((_UNKNOWNS, _UNKNOWNS))
    prior[:_KEPT, :_KEPT] = np.linalg.inv(cov)
    prior[_KEPT:, _KEPT:] = np.diag([settings.velocity_std**-2] * 3 + [settings.rate_std**-2] * 3)
    before = np.concatenate([state.mean, np.zeros(_UNKNOWNS - _KEPT)])
    fit = _fitted(before, before, prior, seen, settings)
    if state.pictures < _FIRST and fit.pixels >= settings.least_pixels:
        fit = _fitted(fit.mean, before, prior, seen, settings)
    if fit.pixels < settings.least_pixels or fit.height_m > settings.worst_fit_m:
        return state
    cov = np.linalg.inv(fit.information)[:_KEPT, :_KEPT]
    found = HandEyeState(fit.mean[:_KEPT], 0.5 * (cov + cov.T), state.proven, state.pictures + 1)
    enough = settings.proven if found.pictures < settings.many_pictures else settings.proven_by_many
    in_a_row = state.in_a_row + 1 if evidence(found, settings) > enough else 0
    shown = found.pictures >= settings.least_pictures and in_a_row >= settings.in_a_row
    return replace(found, in_a_row=in_a_row, proven=found.proven or shown)


def evidence(state: HandEyeState, settings: HandEyeSettings) -> float:
    """How sure it is that there is a hand-eye error: its squared Mahalanobis norm, 6 degrees of freedom.

    The variance is that of the filter and a floor: pixels are wrong together, by the gain of the flow and by what lies
    on the table, and no number of pictures takes that out.
    """
    floor = np.square([settings.translation_floor_m] * 3 + [settings.rotation_floor_rad] * 3)
    error = state.mean[_HAND_EYE]
    return float(error @ np.linalg.solve(state.cov[_HAND_EYE, _HAND_EYE] + np.diag(floor), error))


def _walk(settings: HandEyeSettings) -> FloatArray:
    """Variances per second, shape (8,)."""
    walks = [settings.translation_walk_m] * 3 + [settings.rotation_walk_rad] * 3
    return np.square([*walks, settings.height_walk_m, settings.gain_walk])


class _Fit(NamedTuple):
    """Unknowns that fit a picture."""

    mean: FloatArray
    """Shape (14,)."""
    information: FloatArray
    """Inverse of their covariance, shape (14, 14)."""
    pixels: int
    """Pixels of the surface."""
    height_m: float
    """Mean distance of these from it, m."""


def _fitted(
    mean: FloatArray, before: FloatArray, prior: FloatArray, seen: SurfaceView, settings: HandEyeSettings
) -> _Fit:
    """One Gauss-Newton step from ``mean``, where ``before`` was known with the information ``prior``."""
    camera, period = seen.flow.intrinsics, seen.flow.period
    x, y = camera.grid
    view, by_unknowns = _true_view(mean, seen)
    warp = np.concatenate([[seen.flow.warp_inverse_depth], seen.warp_twist])
    scale = np.array([camera.fx * period, camera.fy * period])
    shared = settings.shared / settings.stride**2
    bounds = np.array([settings.stride, settings.highest_m, settings.least_sure_m, settings.thickness_m, shared])
    sums = np.zeros((COLUMNS + 2, COLUMNS))
    products, gain = (seen.flow.information, seen.flow.gradient), 1.0 + float(mean[_GAIN])
    plane_equations(*products, seen.usable, x[0], y[:, 0], view, warp, scale, gain, bounds, sums)
    normal = sums[:COLUMNS] + np.tril(sums[:COLUMNS], -1).T
    information = prior + by_unknowns.T @ normal @ by_unknowns
    step = np.linalg.solve(information, by_unknowns.T @ sums[COLUMNS] - prior @ (mean - before))
    pixels, heights = sums[COLUMNS + 1, :2].tolist()
    return _Fit(mean + step, information, int(pixels), heights / max(pixels, 1.0))


def _true_view(mean: FloatArray, seen: SurfaceView) -> tuple[FloatArray, FloatArray]:
    """The surface m, n . p / distance = 1 with m = n / distance, and the twist, both in the true camera.

    Returns:
        m, v and w and the distance, shape (10,), and the derivatives of m, v, w and the gain by the unknowns, shape
        (10, 14): those by r to first order in r.
    """
    t, turn_back = mean[:3], _rotation(mean[3:6]).T
    v, w = seen.twist[:3] + mean[_KEPT : _KEPT + 3], seen.twist[3:] + mean[_KEPT + 3 :]
    up = seen.T_base_believed[2, :3]
    distance = seen.height_m + float(mean[HEIGHT]) - float(seen.T_base_believed[2, 3]) - float(up @ t)
    surface = turn_back @ up / distance
    velocity, rate = turn_back @ (v + cross(w, t)), turn_back @ w
    jacobian = np.zeros((COLUMNS, _UNKNOWNS))
    jacobian[:3, :3] = np.outer(surface, up) / distance
    jacobian[:3, 3:6] = skew(surface)
    jacobian[:3, HEIGHT] = -surface / distance
    jacobian[3:6, :3] = turn_back @ skew(w)
    jacobian[3:6, 3:6] = skew(velocity)
    jacobian[3:6, _KEPT : _KEPT + 3] = turn_back
    jacobian[3:6, _KEPT + 3 :] = -turn_back @ skew(t)
    jacobian[6:9, 3:6] = skew(rate)
    jacobian[6:9, _KEPT + 3 :] = turn_back
    jacobian[9, _GAIN] = 1.0
    return np.array([*surface, *velocity, *rate, distance]), jacobian


def _rotation(vector: FloatArray) -> FloatArray:
    """Rotation matrix of a rotation vector, shape (3, 3)."""
    return np.asarray(cv2.Rodrigues(vector)[0], np.float64)
