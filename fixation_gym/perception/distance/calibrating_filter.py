"""Distance from camera poses and centroids when the camera's calibration is uncertain, too.

As in ``pose_filter`` the unknowns are the target (alpha, beta, rho), seen from an anchor camera. Here they are joined
by what stays wrong for a whole run, see ``calibration_model``: hand-eye error, age of the image, focal length. Their
priors come from the calibration; motion tells some of them. Left out, they make a filter sure and wrong.

A Kalman filter on these unknowns becomes sure and wrong, too: which of their combinations cannot be told apart depends
on where it linearises, so a changing estimate seems to tell them apart. Therefore the estimate is the most probable one
given all frames of a window, linearised at one place. Value in, value out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from fixation_gym.geometry.rigid import cross
from fixation_gym.perception.distance.calibration_model import (
    AGE,
    ROTATION,
    ROW,
    TARGET,
    TRANSLATION,
    TWIST,
    UNKNOWNS,
    Misfit,
    Sighting,
    frame_row,
    innovation_cov,
    innovations,
    with_likely_poses,
)
from fixation_gym.perception.distance.inverse_depth import MIN_DEPTH_M, MIN_INVERSE_DEPTH
from fixation_gym.robots import ROBOT
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
    position_std_m: float = ROBOT.arm.position_std
    """Noise of each camera position per axis, m."""
    rotation_std_rad: float = ROBOT.arm.rotation_std
    """Noise of each camera orientation per axis, rad."""
    noise_dof: float = math.inf
    """Degrees of freedom that the stated noise counts for: where innovations are larger, the noise is scaled up to what
    they and the statement say together. inf: the statement stands."""
    hand_eye_m: float = 0.0
    """Prior of the hand-eye translation error per axis, m."""
    hand_eye_rad: float = 0.0
    """Prior of the hand-eye rotation error per axis, rad."""
    image_age_s: float = 0.0
    """Prior of the age of the image when the pose is read, s."""
    focal: float = 0.0
    """Prior of the relative error of the focal length."""
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

    @property
    def prior_stds(self) -> FloatArray:
        """Standard deviations of hand-eye error, age and focal length, shape (8,)."""
        stds = [self.hand_eye_m] * 3 + [self.hand_eye_rad] * 3 + [self.image_age_s, self.focal]
        return np.maximum(stds, _EXACT)

    def noise_of(self, sighting: Sighting) -> float:
        """Standard deviation of a centroid, normalised coordinates."""
        if sighting.centroid_std is not None:
            return sighting.centroid_std
        return math.hypot(self.centroid_std, self.centroid_std_size * sighting.image_std)


@dataclass(frozen=True, slots=True, eq=False)
class CalibratingState:
    """Estimate, and what it rests on."""

    T_base_anchor: FloatArray
    """Pose of the anchor camera, shape (4, 4)."""
    mean: FloatArray
    """The unknowns of ``calibration_model``, shape (11,)."""
    cov: FloatArray
    """Its covariance, shape (11, 11)."""
    prior_mean: FloatArray
    """What was known before the window, shape (11,)."""
    prior_cov: FloatArray
    """Its covariance, shape (11, 11)."""
    window: FloatArray
    """One row per accepted frame, shape (n, ``ROW``): see ``frame_row``."""
    nis: float = np.nan
    """Normalised innovation squared of the last centroid, 2 degrees of freedom."""
    rejected: int = 0
    """Consecutive centroids that failed the gate."""
    restarts: int = 0
    """How often the target was not where it should be, so that it began again."""
    past: Misfit = field(default_factory=Misfit)
    """Of the windows before."""
    present: Misfit = field(default_factory=Misfit)
    """Of this window."""
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
        state = _update(first_state(sighting, settings), sighting, settings)
    else:
        state = _update(state, sighting, settings) if seen else walked(state, settings.lost_walk_m**2 * max(dt, 0.0))
    return replace(state, last_pose=sighting.T_base_cam) if np.all(np.isfinite(sighting.T_base_cam)) else state


def first_state(sighting: Sighting, settings: CalibratingSettings) -> CalibratingState:
    """Anchor at the first sight, with priors; the direction is all but unknown until the update."""
    assert sighting.centroid is not None
    rho = 1.0 / settings.initial_distance_m
    stds = [1.0, 1.0, settings.initial_relative_std * rho, *settings.prior_stds]
    mean = np.array([*sighting.centroid, rho, *np.zeros(UNKNOWNS - 3)])
    cov = np.diag(np.square(stds))
    return CalibratingState(np.array(sighting.T_base_cam), mean, cov, mean, cov, np.zeros((0, ROW)))


def walked(state: CalibratingState, variance: float) -> CalibratingState:
    """The target is somewhere else by this variance per axis, m^2; the window ends, because it shows where it was."""
    alpha, beta, rho = state.mean[TARGET]
    jacobian = rho * np.array([[1.0, 0.0, -alpha], [0.0, 1.0, -beta], [0.0, 0.0, -rho]])
    cov = state.cov.copy()
    cov[:3, :3] += variance * jacobian @ jacobian.T
    return _collapse(replace(state, cov=cov, nis=np.nan))


def with_last_twist(state: CalibratingState, twist: FloatArray) -> CalibratingState:
    """The last frame's twist, shape (6,), known better; nothing changes if that frame is not in the window."""
    if state.rejected or not len(state.window) or not np.all(np.isfinite(twist)):
        return state
    last = state.window[-1:].copy()
    last[0, TWIST] = twist
    return replace(state, window=np.concatenate([state.window[:-1], last]))


def _collapse(state: CalibratingState) -> CalibratingState:
    """Make the estimate the prior of a new window."""
    past = state.past + state.present
    return replace(
        state, prior_mean=state.mean, prior_cov=state.cov, window=state.window[:0], past=past, present=Misfit()
    )


def noise_scale(state: CalibratingState, settings: CalibratingSettings) -> float:
    """How many times larger than stated the noise is, as a variance; at least 1."""
    if math.isinf(settings.noise_dof):
        return 1.0
    misfit = state.past + state.present
    return max(1.0, (settings.noise_dof + misfit.nis) / (settings.noise_dof + misfit.dof))


def _update(state: CalibratingState, sighting: Sighting, settings: CalibratingSettings) -> CalibratingState:
    """Add a frame to the window and solve it again; outliers are rejected, and restart the filter when they persist."""
    scale = noise_scale(state, settings)
    row = frame_row(state.T_base_anchor, sighting, settings.noise_of(sighting))[None]
    innovation, jacobian, by_pose = innovations(state.mean, row)
    spread = jacobian[0] @ state.cov @ jacobian[0].T + scale * innovation_cov(row, by_pose)[0]
    nis = float(innovation[0] @ np.linalg.solve(spread, innovation[0]))
    if nis > settings.gate:
        rejected = state.rejected + 1
        if rejected >= settings.alarm_count:
            return _restart(state, sighting, settings)
        # More than the gate would let a single outlier say that all is noisy.
        return replace(state, nis=nis, rejected=rejected, past=state.past + Misfit(settings.gate, 2.0))
    if len(state.window) >= settings.window:
        state = _collapse(state)
    window = np.concatenate([state.window, row])
    return replace(_solved(state, window, scale), nis=nis, rejected=0)


def _solved(state: CalibratingState, window: FloatArray, scale: float) -> CalibratingState:
    """The most probable unknowns given a window, shape (n, ``ROW``), and what was known before."""
    mean, cov, misfit = state.mean, state.cov, 0.0
    prior_information = np.linalg.inv(state.prior_cov)
    for _ in range(1 if len(window) > _SETTLED else 3):
        innovation, _, by_pose = innovations(mean, window)
        weight = np.linalg.inv(scale * innovation_cov(window, by_pose))
        misfit = scale * float(np.einsum("ki,kij,kj->", innovation, weight, innovation))
        _, jacobian, _ = innovations(mean, with_likely_poses(window, by_pose, scale * weight, innovation))
        weighted = np.swapaxes(jacobian, 1, 2) @ weight
        information = prior_information + (weighted @ jacobian).sum(axis=0)
        vector = (weighted @ innovation[..., None]).sum(axis=0)[:, 0]
        cov = np.linalg.inv(information)
        mean = mean + cov @ (vector - prior_information @ (mean - state.prior_mean))
        mean[2] = max(mean[2], MIN_INVERSE_DEPTH)
    present = Misfit(misfit, max(0.0, 2.0 * len(window) - 3.0))
    return replace(state, mean=mean, cov=0.5 * (cov + cov.T), window=window, present=present)


def _restart(state: CalibratingState, sighting: Sighting, settings: CalibratingSettings) -> CalibratingState:
    """Begin again where the target is seen now, at the distance it had, or, if that was hardly known, the first guess.

    Noise of the first, nearly resting frames can put it far off; as a prior it would bind every following start.
    """
    before, state = distance_at(state, sighting), replace(state, restarts=state.restarts + 1)
    if before.robot_std < _KNOWN_RELATIVE_STD * before.robot:
        spread = math.hypot(before.robot_std, settings.jump_std_m)
        return begun_again(state, sighting, before.robot, spread, settings)
    return begun_again(state, sighting, None, math.nan, settings)


def begun_again(
    state: CalibratingState, sighting: Sighting, depth: float | None, std: float, settings: CalibratingSettings
) -> CalibratingState:
    """Begin again where the target is seen now; what was learnt about calibration and noise stays.

    Args:
        state: before.
        sighting: in which it is seen.
        depth: of the target in the believed camera, m; None: the first guess.
        std: its standard deviation, m.
        settings: prior and noise.
    """
    fresh = first_state(sighting, settings)
    mean, cov = fresh.mean.copy(), fresh.cov.copy()
    if depth is not None:
        mean[2] = rho = 1.0 / depth
        cov[2, 2] = min(std * rho**2, settings.initial_relative_std * rho) ** 2
    mean[3:], cov[3:, 3:] = state.mean[3:], state.cov[3:, 3:]
    past = state.past + state.present
    prior = replace(_collapse(replace(fresh, mean=mean, cov=cov)), past=past, restarts=state.restarts)
    return _update(prior, sighting, settings)


def distance_at(state: CalibratingState, sighting: Sighting) -> Distance:
    """Depth of the target now, finite and at least 1 cm; standard deviations include the pose's momentary noise."""
    mean = state.mean
    pose, pose_cov, twist = sighting.T_base_cam, sighting.pose_cov, np.nan_to_num(sighting.twist)
    if not (np.all(np.isfinite(pose)) and np.all(np.isfinite(pose_cov))):
        pose, pose_cov = state.T_base_anchor if state.last_pose is None else state.last_pose, np.zeros((6, 6))
    rotation = pose[:3, :3].T @ state.T_base_anchor[:3, :3]
    baseline = pose[:3, :3].T @ (state.T_base_anchor[:3, 3] - pose[:3, 3])
    scaled = rotation @ [mean[0], mean[1], 1.0] + mean[2] * baseline
    columns = np.column_stack([rotation[:, 0], rotation[:, 1], baseline])
    q = scaled / mean[2]
    by_target = columns / mean[2]
    by_target[:, 2] -= q / mean[2]
    robot = np.zeros(UNKNOWNS)
    robot[TARGET] = by_target[2]
    momentary = np.array([0.0, 0.0, 1.0, q[1], -q[0], 0.0])  # of q_z by pose noise: t_z + (r x q)_z
    pose_variance = float(momentary @ pose_cov @ momentary)
    lens = robot.copy()
    lens[3:9] = momentary
    lens[AGE] = twist[2] + cross(twist[3:], q)[2]
    wrong = mean[TRANSLATION][2] + cross(mean[ROTATION], q)[2] + mean[AGE] * lens[AGE]
    stds = [float(np.sqrt(by @ state.cov @ by + pose_variance)) for by in (robot, lens)]
    return Distance(max(float(q[2]), MIN_DEPTH_M), stds[0], max(float(q[2] + wrong), MIN_DEPTH_M), stds[1])


_KNOWN_RELATIVE_STD = 0.3
"""A distance that is stated less surely than this is no prior for a new start."""
_EXACT = 1e-9
"""Prior of a calibration value that is taken to be exact."""
_SETTLED = 20
"""From so many frames on, one step per frame keeps up."""
