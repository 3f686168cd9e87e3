"""Distance from measured twist and optic flow: the paper's filter with the fixation constraint, and one without it.

Both are extended Kalman filters whose motion is driven by white jerk (Battaje & Brock 2022, section III, with the signs
of ``geometry.interaction``). Flow u at (x, y) is u = d A v + B w. ``flow_models`` has their states.

Units: m, rad, s; twists in the camera frame, image coordinates normalised. Value in, value out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fixation_gym.geometry.interaction import rotation_part, translation_part
from fixation_gym.perception.distance.flow_models import MODELS, FlowModel, Kind
from fixation_gym.types import FloatArray, MaskArray


@dataclass(frozen=True, slots=True)
class FlowFilterSettings:
    """Prior, process noise and gates."""

    initial_distance_m: float = 0.5
    """Guess before any motion, m."""
    initial_relative_std: float = 0.6
    """Standard deviation of the first inverse depth, as a share of it."""
    slant_std: float = 0.3
    """Prior of the tangent of the target's slant; the hard filter, which knows none, adds it to its flow noise."""
    jerk: float = 0.05
    """Root of the spectral density of the jerk, m/s^3 per root Hz: A Omega^3 of the motion."""
    onset_jerk: float = 0.5
    """The same while the motion starts, m/s^3 per root Hz."""
    onset_s: float = 0.6
    """How long the motion starts, s."""
    drift: float = 1e-3
    """Random walk of the inverse depth per root second, as a share of it."""
    gate: float = 13.8
    """Largest accepted NIS of a flow sample: 99.9 % of chi-square with 2 degrees of freedom."""
    huber: float = 1.5
    """Flow residuals beyond this many standard deviations lose weight."""
    alarm_nis: float = 3.0
    """NIS per degree of freedom that is suspicious."""
    alarm_count: int = 6
    """Suspicious frames in a row after which the distance is forgotten."""


@dataclass(frozen=True, slots=True, eq=False)
class FlowSamples:
    """Flow at n points of the target."""

    points: FloatArray
    """Normalised image coordinates, shape (n, 2)."""
    flow: FloatArray
    """Image motion, shape (n, 2), 1/s; rows that are not finite are ignored."""
    cov: FloatArray
    """Its covariance, shape (n, 2, 2), 1/s^2."""


@dataclass(frozen=True, slots=True, eq=False)
class FlowFilterState:
    """Estimate: motion and inverse depth or plane."""

    kind: Kind
    """Which of the two models."""
    mean: FloatArray
    """State vector, shape (9,) or (15,)."""
    cov: FloatArray
    """Its covariance."""
    nis: float = np.nan
    """Normalised innovation squared of the last measurement, per degree of freedom."""
    rejected_share: float = 0.0
    """Share of the last flow samples that failed the gate."""
    suspicious: int = 0
    """Frames in a row with too large a NIS."""
    age: float = 0.0
    """Time since the first frame, s."""

    @property
    def model(self) -> FlowModel:
        """What its states mean."""
        return MODELS[self.kind]


def initialise(kind: Kind, settings: FlowFilterSettings) -> FlowFilterState:
    """State before any motion: at rest, at the guessed distance, facing the camera."""
    d, model = 1.0 / settings.initial_distance_m, MODELS[kind]
    speed, turning = [0.2] * 3, [1.0] * (model.motion - 3)
    stds = [*speed, *turning, *speed, *turning, *_depth_stds(d, model, settings)]
    return FlowFilterState(kind, np.array([*np.zeros(model.size - 1), d]), np.diag(np.square(stds)))


def _depth_stds(d: float, model: FlowModel, settings: FlowFilterSettings) -> FloatArray:
    """Standard deviations of the states of depth before any motion."""
    stds = np.full(model.size - 2 * model.motion, settings.slant_std * d)
    stds[-1] = settings.initial_relative_std * d
    return stds


def predict(state: FlowFilterState, dt: float, settings: FlowFilterSettings) -> FlowFilterState:
    """Let ``dt`` s pass."""
    model = state.model
    motion, depths = model.motion, slice(2 * model.motion, None)
    rate, by_state = model.depth_rate(state.mean)
    F, mean = np.eye(model.size), state.mean.copy()
    F[:motion, motion : 2 * motion] = dt * np.eye(motion)
    F[depths] += dt * by_state
    mean[:motion] += dt * mean[motion : 2 * motion]
    mean[depths] += dt * rate
    cov = F @ state.cov @ F.T + _process_noise(state, dt, settings)
    return _bounded(replace(state, mean=mean, cov=cov, age=state.age + dt), settings)


def _bounded(state: FlowFilterState, settings: FlowFilterSettings) -> FlowFilterState:
    """Keep the inverse depth between that of 1 km and of 1 cm; a state that ran into the camera knows no distance."""
    d = float(state.mean[-1])
    if MIN_INVERSE_DEPTH <= d <= MAX_INVERSE_DEPTH:
        return state
    mean = state.mean.copy()
    mean[-1] = min(max(d, MIN_INVERSE_DEPTH), MAX_INVERSE_DEPTH)
    if d < MIN_INVERSE_DEPTH:  # its covariance says that it may be nearer
        return replace(state, mean=mean)
    return _forget_depth(replace(state, mean=state.model.tilted(mean, MAX_INVERSE_DEPTH / d)), settings)


def _process_noise(state: FlowFilterState, dt: float, settings: FlowFilterSettings) -> FloatArray:
    """White jerk on the motion, random walk on the depth."""
    motion, d = state.model.motion, state.mean[-1]
    jerk = settings.onset_jerk if state.age < settings.onset_s else settings.jerk
    jerks = np.full(motion, jerk * d)
    jerks[:3] = jerk
    Q = np.zeros_like(state.cov)
    rates, accelerations = np.arange(motion), np.arange(motion, 2 * motion)
    Q[rates, rates] = jerks**2 * dt**3 / 3.0
    Q[accelerations, accelerations] = jerks**2 * dt
    Q[rates, accelerations] = Q[accelerations, rates] = jerks**2 * dt**2 / 2.0
    depths = np.arange(2 * motion, state.mean.size)
    Q[depths, depths] = (settings.drift * d) ** 2 * dt
    return Q


def update(
    state: FlowFilterState,
    twist: FloatArray,
    twist_cov: FloatArray,
    samples: FlowSamples | None,
    settings: FlowFilterSettings,
    gaze_rate: FloatArray | None = None,
) -> FlowFilterState:
    """Take in a measured twist and, where there is any, flow of the same instant.

    Args:
        state: estimate before.
        twist: [v, w], shape (6,).
        twist_cov: its covariance, shape (6, 6).
        samples: flow on the target; None where there is none.
        settings: gates.
        gaze_rate: measured rate of the target's centroid, shape (2,), 1/s, by which the fixation constraint is
            violated; it is added to the noise of the hard filter's rotation. None: perfect fixation.
    """
    if not np.all(np.isfinite(twist)):
        return state
    h, H = state.model.twist(state.mean)
    noise = np.array(twist_cov, dtype=np.float64)
    if state.model.fixates and gaze_rate is not None:
        noise[[3, 4], [3, 4]] += _DRIFT_FRAMES * np.square(gaze_rate[::-1])
    information = np.linalg.inv(noise)
    residual = twist - h
    nis = float(residual @ np.linalg.solve(noise + H @ state.cov @ H.T, residual))
    normal, vector, dof, rejected = H.T @ information @ H, H.T @ information @ residual, 6, 0.0
    finite = None if samples is None else np.asarray(np.isfinite(samples.flow).all(axis=1), np.bool_)
    if samples is not None and finite is not None and finite.any():
        flow_normal, flow_vector, flow_nis, used, rejected = _flow_information(state, samples, finite, settings)
        normal, vector, nis, dof = normal + flow_normal, vector + flow_vector, nis + flow_nis, dof + 2 * used
    inflation = 4.0 if rejected > 0.5 else 1.0
    cov = np.linalg.inv(np.linalg.inv(inflation * state.cov) + normal)
    mean = state.mean + cov @ vector
    suspicious = state.suspicious + 1 if nis / dof > settings.alarm_nis else 0
    updated = FlowFilterState(state.kind, mean, 0.5 * (cov + cov.T), nis / dof, rejected, suspicious, state.age)
    updated = _bounded(updated, settings)
    return _forget_depth(updated, settings) if suspicious >= settings.alarm_count else updated


def _flow_model(state: FlowFilterState, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Expected flow, shape (m, 2), and its derivative by the state, shape (m, 2, n)."""
    A, B = translation_part(points[:, 0], points[:, 1]), rotation_part(points[:, 0], points[:, 1])
    twist, H_twist = state.model.twist(state.mean)
    d, d_by_state = state.model.inverse_depths(state.mean, points)
    moved = A @ twist[:3]
    flow = d[:, None] * moved + B @ twist[3:]
    by_twist = np.concatenate([d[:, None, None] * A, B], axis=2) @ H_twist
    return flow, by_twist + moved[:, :, None] * d_by_state[:, None, :]


def _flow_information(
    state: FlowFilterState, samples: FlowSamples, finite: MaskArray, settings: FlowFilterSettings
) -> tuple[FloatArray, FloatArray, float, int, float]:
    """Information matrix and vector of the samples, their NIS, how many count, and the share that failed the gate."""
    points, cov = samples.points[finite], samples.cov[finite]
    h, H = _flow_model(state, points)
    residual = samples.flow[finite] - h
    if state.model.fixates:
        spread = np.linalg.norm(points - points.mean(axis=0), axis=1)
        slanted = settings.slant_std * state.mean[-1] * spread * np.linalg.norm(state.mean[:2])
        cov = cov + slanted[:, None, None] ** 2 * np.eye(2)
    expected = cov + H @ state.cov @ np.swapaxes(H, 1, 2)
    nis = np.einsum("mi,mi->m", residual, np.linalg.solve(expected, residual[..., None])[..., 0])
    good = nis <= settings.gate
    rejected = 1.0 - float(good.mean())
    if rejected > 0.5:  # rejecting the majority would lock the filter in; the state is doubted instead
        good[:] = True
    information = np.linalg.inv(cov)
    size = np.sqrt(np.einsum("mi,mij,mj->m", residual, information, residual))
    weight = good * np.minimum(1.0, settings.huber / np.maximum(size, 1e-9))
    weighted = np.swapaxes(H, 1, 2) @ (weight[:, None, None] * information)
    normal = (weighted @ H).sum(axis=0)
    vector = (weighted @ residual[..., None]).sum(axis=0)[:, 0]
    return normal, vector, float(nis[good].sum()), int(good.sum()), rejected


def _forget_depth(state: FlowFilterState, settings: FlowFilterSettings) -> FlowFilterState:
    """Keep the motion and the mean, but take the distance to be as uncertain as at first."""
    first, cov = 2 * state.model.motion, state.cov.copy()
    cov[first:, :] = cov[:, first:] = 0.0
    cov[first:, first:] = np.diag(_depth_stds(state.mean[-1], state.model, settings) ** 2)
    return replace(state, cov=cov, suspicious=0)


def distance_of(state: FlowFilterState, centroid: FloatArray | None = None) -> tuple[float, float]:
    """Depth along the optical axis of the target's centroid, m, and its standard deviation, m; both finite.

    Args:
        state: the estimate.
        centroid: normalised image coordinates, shape (2,); None for the image centre. The hard filter ignores it.
    """
    at = np.zeros((1, 2)) if centroid is None else np.reshape(centroid, (1, 2))
    depths, by_state = state.model.inverse_depths(state.mean, at)
    d, variance = float(depths[0]), float(by_state[0] @ state.cov @ by_state[0])
    d = min(max(d, MIN_INVERSE_DEPTH), MAX_INVERSE_DEPTH)
    return 1.0 / d, float(np.sqrt(variance)) / d**2


_DRIFT_FRAMES = 10
"""A gaze error lasts for about this many frames, so it counts as so many independent ones."""
MIN_INVERSE_DEPTH, MAX_INVERSE_DEPTH = 1e-3, 1e2
"""Objects farther than 1 km or nearer than 1 cm are put there, 1/m."""
