"""Distance from camera poses and centroids when the camera's calibration is uncertain, too.

As in ``pose_filter`` the unknowns are the target (alpha, beta, rho), seen from an anchor camera. Here they are
joined by what stays wrong for a whole run: the hand-eye error (translation t, rotation vector r, in the camera frame)
and the age tau of the image. Their priors come from the calibration; motion tells some of them. Left out, they make a
filter sure and wrong.

Measurement: with q the target in the believed camera, the image shows the ray q + t + v tau + (r + w tau) x q.

A Kalman filter on these ten unknowns becomes sure and wrong, too: which of their combinations cannot be told apart
depends on where it linearises, so a changing estimate seems to tell them apart. Therefore the estimate is the most
probable one given all frames of a window, linearised at one place. Value in, value out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fixation_gym.geometry.rigid import cross
from fixation_gym.geometry.twist import crosses, skews
from fixation_gym.perception.distance.inverse_depth import MIN_DEPTH_M, MIN_INVERSE_DEPTH
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
    centroid_std_size: float = 0.0015
    """Part of it that grows with the target, as a share of the standard deviation of its pixels."""
    hand_eye_m: float = 0.0
    """Prior of the hand-eye translation error per axis, m."""
    hand_eye_rad: float = 0.0
    """Prior of the hand-eye rotation error per axis, rad."""
    image_age_s: float = 0.0
    """Prior of the age of the image when the pose is read, s."""
    lost_walk_m: float = 1e-2
    """Random walk of the target while it is not seen, m per square root of a second."""
    jump_std_m: float = 0.08
    """Size of the sudden displacements to expect: prior of the distance after a restart, m."""
    gate: float = 13.8
    """Largest accepted NIS: 99.9 % of chi-square with 2 degrees of freedom."""
    window: int = 300
    """Frames that are kept; then their estimate becomes the prior of a new window."""
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
    image_std: float = 0.0
    """Standard deviation of the target's pixels about the centroid, normalised."""


@dataclass(frozen=True, slots=True, eq=False)
class CalibratingState:
    """Estimate, and what it rests on."""

    T_base_anchor: FloatArray
    """Pose of the anchor camera, shape (4, 4)."""
    mean: FloatArray
    """(alpha, beta, rho, t (3), r (3), tau), shape (10,)."""
    cov: FloatArray
    """Its covariance, shape (10, 10)."""
    prior_mean: FloatArray
    """What was known before the window, shape (10,)."""
    prior_cov: FloatArray
    """Its covariance, shape (10, 10)."""
    window: FloatArray
    """One row per accepted frame, shape (n, ``_ROW``): see ``_row``."""
    nis: float = np.nan
    """Normalised innovation squared of the last centroid, 2 degrees of freedom."""
    rejected: int = 0
    """Consecutive centroids that failed the gate."""
    last_pose: FloatArray | None = None
    """Last finite camera pose, shape (4, 4); stands in for one that is not."""


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
    numbers = (sighting.T_base_cam, sighting.pose_cov, sighting.twist, sighting.image_std)
    seen = seen and all(bool(np.all(np.isfinite(number))) for number in numbers)
    if state is None and not seen:
        return None
    if state is None:
        state = _update(_first(sighting, settings), sighting, settings)
    else:
        state = _update(state, sighting, settings) if seen else _walk(state, max(dt, 0.0), settings)
    return replace(state, last_pose=sighting.T_base_cam) if np.all(np.isfinite(sighting.T_base_cam)) else state


def _first(sighting: Sighting, settings: CalibratingSettings) -> CalibratingState:
    """Anchor at the first sight, with priors; the direction is all but unknown until the update."""
    assert sighting.centroid is not None
    rho = 1.0 / settings.initial_distance_m
    stds = [1.0, 1.0, settings.initial_relative_std * rho]
    stds += [max(settings.hand_eye_m, _EXACT)] * 3 + [max(settings.hand_eye_rad, _EXACT)] * 3
    stds += [max(settings.image_age_s, _EXACT)]
    mean = np.array([*sighting.centroid, rho, *np.zeros(7)])
    cov = np.diag(np.square(stds))
    return CalibratingState(np.array(sighting.T_base_cam), mean, cov, mean, cov, np.zeros((0, _ROW)))


def _walk(state: CalibratingState, dt: float, settings: CalibratingSettings) -> CalibratingState:
    """Let the unseen target wander; the window ends, because its frames show where the target was before."""
    alpha, beta, rho = state.mean[:3]
    jacobian = rho * np.array([[1.0, 0.0, -alpha], [0.0, 1.0, -beta], [0.0, 0.0, -rho]])
    cov = state.cov.copy()
    cov[:3, :3] += settings.lost_walk_m**2 * dt * jacobian @ jacobian.T
    return _collapse(replace(state, cov=cov, nis=np.nan))


def _collapse(state: CalibratingState) -> CalibratingState:
    """Make the estimate the prior of a new window."""
    return replace(state, prior_mean=state.mean, prior_cov=state.cov, window=state.window[:0])


def _row(state: CalibratingState, sighting: Sighting) -> FloatArray:
    """A frame as a row: rotation and baseline of the anchor in the camera, pose noise, twist, centroid, its size."""
    assert sighting.centroid is not None
    rotation = sighting.T_base_cam[:3, :3].T
    return np.concatenate(
        [
            (rotation @ state.T_base_anchor[:3, :3]).ravel(),
            rotation @ (state.T_base_anchor[:3, 3] - sighting.T_base_cam[:3, 3]),
            sighting.pose_cov.ravel(),
            sighting.twist,
            sighting.centroid,
            [sighting.image_std],
        ]
    )


def _model(mean: FloatArray, rows: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Innovation (n, 2), derivative of the expected centroid by the state (n, 2, 10) and by the pose noise (n, 2, 6).

    With z the centroid and s the ray to the target, the measurement is taken as z s_z - s_xy = 0: the noise of the
    pose, far larger than the one of z, then does not enter the derivatives. Linearised about the expected centroid,
    innovation and derivative share that noise, and the hand-eye translation drifts by many standard deviations.
    """
    rotation, baseline = rows[:, :9].reshape(-1, 3, 3), rows[:, 9:12]
    v, w, centroid = rows[:, 48:51], rows[:, 51:54], rows[:, 54:56]
    rho, t, tau = mean[2], mean[3:6], mean[9]
    scaled = rotation @ np.array([mean[0], mean[1], 1.0]) + rho * baseline  # q times rho: finite at infinity
    turn = skews(mean[6:9] + tau * w)
    shift = t + tau * v
    ray = scaled + rho * shift + (turn @ scaled[..., None])[..., 0]
    by_target = np.concatenate([rotation[:, :, :2], baseline[..., None]], axis=2)
    by_state = np.zeros((len(rows), 3, 10))
    by_state[:, :, :3] = by_target + turn @ by_target
    by_state[:, :, 2] += shift
    by_state[:, (0, 1, 2), (3, 4, 5)] = rho
    by_state[:, :, 6:9] = -skews(scaled)
    by_state[:, :, 9] = rho * v + crosses(w, scaled)
    by_motion = by_state[:, :, 3:9]
    project = np.zeros((len(rows), 2, 3))
    project[:, 0, 0] = project[:, 1, 1] = 1.0
    project[:, :, 2] = -centroid
    project /= np.maximum(ray[:, 2], 0.1)[:, None, None]
    return -(project @ ray[..., None])[..., 0], project @ by_state, project @ by_motion


def _noise(rows: FloatArray, by_pose: FloatArray, settings: CalibratingSettings) -> FloatArray:
    """Covariance of the innovations without the one of the state, shape (n, 2, 2)."""
    variance = settings.centroid_std**2 + (settings.centroid_std_size * rows[:, 56]) ** 2
    pose_cov = rows[:, 12:48].reshape(-1, 6, 6)
    return variance[:, None, None] * np.eye(2) + by_pose @ pose_cov @ np.swapaxes(by_pose, 1, 2)


def _adjusted(rows: FloatArray, by_pose: FloatArray, weight: FloatArray, innovation: FloatArray) -> FloatArray:
    """Rows with the poses that explain the innovations best (least squares with errors in all variables)."""
    pose_cov = rows[:, 12:48].reshape(-1, 6, 6)
    error = (pose_cov @ np.swapaxes(by_pose, 1, 2) @ weight @ innovation[..., None])[..., 0]
    rotation, baseline = rows[:, :9].reshape(-1, 3, 3), rows[:, 9:12, None]
    turn = skews(error[:, 3:])
    adjusted = rows.copy()
    adjusted[:, :9] += (turn @ rotation).reshape(-1, 9)
    adjusted[:, 9:12] += error[:, :3] + (turn @ baseline)[..., 0]
    return adjusted


def _update(state: CalibratingState, sighting: Sighting, settings: CalibratingSettings) -> CalibratingState:
    """Add a frame to the window and solve it again; outliers are rejected, and restart the filter when they persist."""
    row = _row(state, sighting)[None]
    innovation, jacobian, by_pose = _model(state.mean, row)
    spread = jacobian[0] @ state.cov @ jacobian[0].T + _noise(row, by_pose, settings)[0]
    nis = float(innovation[0] @ np.linalg.solve(spread, innovation[0]))
    if nis > settings.gate:
        rejected = state.rejected + 1
        if rejected >= settings.alarm_count:
            return _restart(state, sighting, settings)
        return replace(state, nis=nis, rejected=rejected)
    if len(state.window) >= settings.window:
        state = _collapse(state)
    window = np.concatenate([state.window, row])
    mean, cov = state.mean, state.cov
    prior_information = np.linalg.inv(state.prior_cov)
    for _ in range(1 if len(window) > 20 else 3):
        innovation, _, by_pose = _model(mean, window)
        weight = np.linalg.inv(_noise(window, by_pose, settings))
        _, jacobian, _ = _model(mean, _adjusted(window, by_pose, weight, innovation))
        weighted = np.swapaxes(jacobian, 1, 2) @ weight
        information = prior_information + (weighted @ jacobian).sum(axis=0)
        vector = (weighted @ innovation[..., None]).sum(axis=0)[:, 0]
        cov = np.linalg.inv(information)
        mean = mean + cov @ (vector - prior_information @ (mean - state.prior_mean))
        mean[2] = max(mean[2], MIN_INVERSE_DEPTH)
    return replace(state, mean=mean, cov=0.5 * (cov + cov.T), window=window, nis=nis, rejected=0)


def _restart(state: CalibratingState, sighting: Sighting, settings: CalibratingSettings) -> CalibratingState:
    """Begin again where the target is seen now; what was learnt about the calibration stays.

    So does the distance, unless it was hardly known. Noise of the first, nearly resting frames can put it far off; as a
    prior it would keep every following start from the truth, so that one begins with the first guess.
    """
    before = distance_at(state, sighting)
    fresh = _first(sighting, settings)
    mean, cov = fresh.mean.copy(), fresh.cov.copy()
    if before.robot_std < _KNOWN_RELATIVE_STD * before.robot:
        mean[2] = rho = 1.0 / before.robot
        spread = float(np.hypot(before.robot_std, settings.jump_std_m))
        cov[2, 2] = min(spread * rho**2, settings.initial_relative_std * rho) ** 2
    mean[3:], cov[3:, 3:] = state.mean[3:], state.cov[3:, 3:]
    fresh = replace(fresh, mean=mean, cov=cov, prior_mean=mean, prior_cov=cov)
    return _update(fresh, sighting, settings)


def distance_at(state: CalibratingState, sighting: Sighting) -> Distance:
    """Depth of the target now, finite and at least 1 cm; standard deviations include the pose's momentary noise."""
    mean = state.mean
    pose, pose_cov = sighting.T_base_cam, sighting.pose_cov
    if not (np.all(np.isfinite(pose)) and np.all(np.isfinite(pose_cov))):
        pose, pose_cov = state.T_base_anchor if state.last_pose is None else state.last_pose, np.zeros((6, 6))
    rotation = pose[:3, :3].T @ state.T_base_anchor[:3, :3]
    baseline = pose[:3, :3].T @ (state.T_base_anchor[:3, 3] - pose[:3, 3])
    scaled = rotation @ [mean[0], mean[1], 1.0] + mean[2] * baseline
    columns = np.column_stack([rotation[:, 0], rotation[:, 1], baseline])
    q = scaled / mean[2]
    by_target = columns / mean[2]
    by_target[:, 2] -= q / mean[2]
    robot = np.zeros(10)
    robot[:3] = by_target[2]
    momentary = np.array([0.0, 0.0, 1.0, q[1], -q[0], 0.0])  # of q_z by pose noise: t_z + (r x q)_z
    pose_variance = float(momentary @ pose_cov @ momentary)
    lens = robot.copy()
    lens[3:9] = momentary
    lens_depth = float(q[2] + mean[5] + cross(mean[6:9], q)[2])
    stds = [float(np.sqrt(by @ state.cov @ by + pose_variance)) for by in (robot, lens)]
    return Distance(max(float(q[2]), MIN_DEPTH_M), stds[0], max(lens_depth, MIN_DEPTH_M), stds[1])


_KNOWN_RELATIVE_STD = 0.3
"""A distance that is stated less surely than this is no prior for a new start."""
_EXACT = 1e-9
"""Prior of a calibration value that is taken to be exact."""
_ROW = 57
"""Numbers that describe a frame of the window."""
