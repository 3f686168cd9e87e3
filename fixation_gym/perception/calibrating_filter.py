"""Distance from camera poses and centroids when the camera's calibration is uncertain, too.

As ``distance_filters`` the state holds the target (alpha, beta, rho), seen from an anchor camera. Here it also holds what
stays wrong for a whole run: the hand-eye error (translation t, rotation vector r, in the camera frame) and the age tau of
the image. Their priors come from the calibration; motion tells some of them. Left out, they make a filter sure and wrong.

Measurement: with q the target in the believed camera, the image shows q + t + v tau + (r + w tau) x q, projected.
Value in, value out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fixation_gym.geometry.twist import skew
from fixation_gym.types import FloatArray


@dataclass(frozen=True, slots=True)
class CalibratingSettings:
    """Prior, noise and gates."""

    initial_distance_m: float = 0.5
    """Guess before any motion, m."""
    initial_relative_std: float = 0.6
    """Standard deviation of the first inverse depth, as a share of it."""
    centroid_std: float = 1e-4
    """Noise of the centroid, normalised image coordinates."""
    hand_eye_m: float = 0.0
    """Prior of the hand-eye translation error per axis, m."""
    hand_eye_rad: float = 0.0
    """Prior of the hand-eye rotation error per axis, rad."""
    image_age_s: float = 0.0
    """Prior of the age of the image when the pose is read, s."""
    walk_m: float = 1e-5
    """Random walk of the target while it is seen, m per square root of a second."""
    lost_walk_m: float = 1e-2
    """Random walk of the target while it is not seen, m per square root of a second."""
    jump_std_m: float = 0.08
    """Size of the sudden displacements to expect: prior of the distance after a restart, m."""
    gate: float = 13.8
    """Largest accepted NIS: 99.9 % of chi-square with 2 degrees of freedom."""
    alarm_count: int = 4
    """Consecutive rejected centroids after which the target is taken to have moved and the filter restarts."""


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


@dataclass(frozen=True, slots=True, eq=False)
class CalibratingState:
    """Estimate."""

    T_base_anchor: FloatArray
    """Pose of the anchor camera, shape (4, 4)."""
    mean: FloatArray
    """(alpha, beta, rho, t (3), r (3), tau), shape (10,)."""
    cov: FloatArray
    """Its covariance, shape (10, 10)."""
    nis: float = np.nan
    """Normalised innovation squared of the last centroid, 2 degrees of freedom."""
    rejected: int = 0
    """Consecutive centroids that failed the gate."""


@dataclass(frozen=True, slots=True)
class Distance:
    """Depth of the target along the optical axis, twice, each with its standard deviation; all in m."""

    robot: float
    """In the camera frame that the robot believes in: where its kinematics would have to go."""
    robot_std: float
    lens: float
    """From the true camera, as far as its calibration could be learnt."""
    lens_std: float


def advance(
    state: CalibratingState | None, sighting: Sighting, dt: float, settings: CalibratingSettings
) -> CalibratingState | None:
    """Take in one frame, ``dt`` s after the last; None until the target was seen for the first time.

    Frames with a pose, twist or centroid that is not finite count as frames in which nothing was seen.
    """
    seen = sighting.centroid is not None and bool(np.all(np.isfinite(sighting.centroid)))
    seen = seen and bool(np.all(np.isfinite(sighting.T_base_cam)) and np.all(np.isfinite(sighting.twist)))
    if state is None:
        return _update(_first(sighting, settings), sighting, settings) if seen else None
    state = _predict(state, max(dt, 0.0), settings, seen)
    return _update(state, sighting, settings) if seen else replace(state, nis=np.nan)


def _first(sighting: Sighting, settings: CalibratingSettings) -> CalibratingState:
    """Anchor at the first sight, with priors; the direction is all but unknown until the update."""
    assert sighting.centroid is not None
    rho = 1.0 / settings.initial_distance_m
    stds = [1.0, 1.0, settings.initial_relative_std * rho]
    stds += [settings.hand_eye_m] * 3 + [settings.hand_eye_rad] * 3 + [settings.image_age_s]
    mean = np.array([*sighting.centroid, rho, *np.zeros(7)])
    return CalibratingState(np.array(sighting.T_base_cam), mean, np.diag(np.square(stds)))


def _predict(state: CalibratingState, dt: float, settings: CalibratingSettings, seen: bool) -> CalibratingState:
    alpha, beta, rho = state.mean[:3]
    walk = settings.walk_m if seen else settings.lost_walk_m
    jacobian = rho * np.array([[1.0, 0.0, -alpha], [0.0, 1.0, -beta], [0.0, 0.0, -rho]])
    cov = state.cov.copy()
    cov[:3, :3] += walk**2 * dt * jacobian @ jacobian.T
    return replace(state, cov=cov)


def _in_camera(state: CalibratingState, mean: FloatArray, T_base_cam: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Target in the believed camera times rho, shape (3,), and its derivative by (alpha, beta, rho), shape (3, 3)."""
    rotation = T_base_cam[:3, :3].T @ state.T_base_anchor[:3, :3]
    baseline = T_base_cam[:3, :3].T @ (state.T_base_anchor[:3, 3] - T_base_cam[:3, 3])
    columns = np.column_stack([rotation[:, 0], rotation[:, 1], baseline])
    return rotation @ [mean[0], mean[1], 1.0] + mean[2] * baseline, columns


def _model(state: CalibratingState, mean: FloatArray, sighting: Sighting) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Expected centroid (2,), its derivative by the state (2, 10) and by the pose noise (2, 6).

    Scaling q by rho leaves the image as it is and keeps targets at infinity finite.
    """
    scaled, columns = _in_camera(state, mean, sighting.T_base_cam)
    rho, t, r, tau = mean[2], mean[3:6], mean[6:9], mean[9]
    v, w = sighting.twist[:3], sighting.twist[3:]
    turn = r + tau * w
    ray = scaled + rho * (t + tau * v) + np.cross(turn, scaled)
    by_motion = np.hstack([rho * np.eye(3), -skew(scaled)])
    by_target = (np.eye(3) + skew(turn)) @ columns
    by_target[:, 2] += t + tau * v
    by_age = rho * v + np.cross(w, scaled)
    by_state = np.column_stack([by_target, by_motion, by_age])
    depth = max(ray[2], 1e-3 * rho)
    image = ray[:2] / depth
    project = np.array([[1.0, 0.0, -image[0]], [0.0, 1.0, -image[1]]]) / depth
    return image, project @ by_state, project @ by_motion


def _update(state: CalibratingState, sighting: Sighting, settings: CalibratingSettings) -> CalibratingState:
    """Three Gauss-Newton steps; outliers are rejected, and restart the filter when they persist."""
    expected, jacobian, by_pose = _model(state, state.mean, sighting)
    noise = settings.centroid_std**2 * np.eye(2) + by_pose @ sighting.pose_cov @ by_pose.T
    innovation = sighting.centroid - expected
    nis = float(innovation @ np.linalg.solve(jacobian @ state.cov @ jacobian.T + noise, innovation))
    if nis > settings.gate:
        rejected = state.rejected + 1
        if rejected >= settings.alarm_count:
            return _restart(state, sighting, settings)
        return replace(state, nis=nis, rejected=rejected)
    mean, gain = state.mean, np.zeros((state.mean.size, 2))
    for _ in range(3):
        expected, jacobian, _ = _model(state, mean, sighting)
        gain = state.cov @ jacobian.T @ np.linalg.inv(jacobian @ state.cov @ jacobian.T + noise)
        mean = state.mean + gain @ (sighting.centroid - expected - jacobian @ (state.mean - mean))
        mean[2] = max(mean[2], MIN_INVERSE_DEPTH)
    keep = np.eye(mean.size) - gain @ jacobian
    cov = keep @ state.cov @ keep.T + gain @ noise @ gain.T
    return CalibratingState(state.T_base_anchor, mean, 0.5 * (cov + cov.T), nis, 0)


def _restart(state: CalibratingState, sighting: Sighting, settings: CalibratingSettings) -> CalibratingState:
    """Begin anew where the target is seen now; what was learnt about the calibration stays."""
    before = distance_at(state, sighting)
    fresh = _first(sighting, settings)
    rho = 1.0 / before.robot
    mean, cov = fresh.mean.copy(), fresh.cov.copy()
    mean[2], mean[3:] = rho, state.mean[3:]
    spread = float(np.hypot(before.robot_std, settings.jump_std_m))
    cov[2, 2] = min(spread * rho**2, settings.initial_relative_std * rho) ** 2
    cov[3:, 3:] = state.cov[3:, 3:]
    return _update(CalibratingState(fresh.T_base_anchor, mean, cov), sighting, settings)


def distance_at(state: CalibratingState, sighting: Sighting) -> Distance:
    """Depth of the target now; standard deviations include the momentary noise of the pose. Never NaN, at least 1 cm."""
    mean = state.mean
    scaled, columns = _in_camera(state, mean, sighting.T_base_cam)
    q = scaled / mean[2]
    by_target = columns / mean[2]
    by_target[:, 2] -= q / mean[2]
    robot = np.zeros(10)
    robot[:3] = by_target[2]
    momentary = np.array([0.0, 0.0, 1.0, q[1], -q[0], 0.0])  # of q_z by pose noise: t_z + (r x q)_z
    pose_variance = float(momentary @ sighting.pose_cov @ momentary)
    lens = robot.copy()
    lens[3:9] = momentary
    lens_depth = float(q[2] + mean[5] + np.cross(mean[6:9], q)[2])
    stds = [float(np.sqrt(by @ state.cov @ by + pose_variance)) for by in (robot, lens)]
    return Distance(max(float(q[2]), MIN_DEPTH_M), stds[0], max(lens_depth, MIN_DEPTH_M), stds[1])


def facing_centroid(
    centroid: FloatArray, second_moments: FloatArray, normal_cam: FloatArray
) -> FloatArray:
    """Image of a flat target's centre from the centroid of its pixels, shape (2,).

    The near half of a slanted target covers more pixels than the far one. With inverse depth
    d(p) = d_c (1 + s . (p - p_c)) area goes with d^-3 and position with 1/d, so the centre is at p_c - 4 M s to first
    order in the slant s (the terms of third order all but cancel).

    Args:
        centroid: p_c, mean of the target's pixels, normalised, shape (2,).
        second_moments: M, covariance of the target's pixels, normalised, shape (2, 2).
        normal_cam: normal of the target's plane in the camera frame, either sense, shape (3,).
    """
    slant = normal_cam[:2] / (normal_cam @ np.array([*centroid, 1.0]))
    return centroid - 4.0 * second_moments @ slant


MIN_INVERSE_DEPTH = 1e-3
"""Targets farther than 1 km are put there, 1/m."""
MIN_DEPTH_M = 0.01
"""Targets nearer than this, or behind the camera, are reported at this depth, m."""
