"""Distance from measured twist and optic flow: the paper's filter with the fixation constraint, and one without it.

Both are extended Kalman filters whose motion is driven by white jerk (Battaje & Brock 2022, section III, with the signs
of ``geometry.interaction``). Flow u at (x, y) is u = d A v + B w.

* ``HARD`` has 9 states [v (3), w_Z, a (3), alpha_Z, d] and knows that the fixated point stands still in the image, so
  w_X = d v_Y and w_Y = -d v_X: the distance is the ratio of translation and rotation, flow only checks it.
* ``FREE`` has 15 states [v (3), w (3), a (3), alpha (3), n (3)] and no constraint. n is the target's plane, n . P = 1,
  so the inverse depth at (x, y) is n . (x, y, 1), exact for any slant, and n_dot = (n . v) n - w x n.

Units: m, rad, s; twists in the camera frame, image coordinates normalised. Value in, value out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from fixation_gym.geometry.interaction import rotation_part, translation_part
from fixation_gym.geometry.rigid import cross
from fixation_gym.geometry.twist import skew
from fixation_gym.types import FloatArray, MaskArray

Kind = Literal["hard", "free"]


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


def initialise(kind: Kind, settings: FlowFilterSettings) -> FlowFilterState:
    """State before any motion: at rest, at the guessed distance, facing the camera."""
    d = 1.0 / settings.initial_distance_m
    d_std = settings.initial_relative_std * d
    speed, acceleration = 0.2, 0.2
    if kind == "hard":
        mean = np.array([*np.zeros(8), d])
        stds = [speed] * 3 + [1.0] + [acceleration] * 3 + [1.0, d_std]
    else:
        mean = np.array([*np.zeros(14), d])
        slant = settings.slant_std * d
        stds = [speed] * 3 + [1.0] * 3 + [acceleration] * 3 + [1.0] * 3 + [slant, slant, d_std]
    return FlowFilterState(kind, mean, np.diag(np.square(stds)))


def predict(state: FlowFilterState, dt: float, settings: FlowFilterSettings) -> FlowFilterState:
    """Let ``dt`` s pass."""
    motion = 4 if state.kind == "hard" else 6
    size = state.mean.size
    F = np.eye(size)
    F[:motion, motion : 2 * motion] = dt * np.eye(motion)
    mean = state.mean.copy()
    mean[:motion] += dt * mean[motion : 2 * motion]
    v = state.mean[:3]
    if state.kind == "hard":
        d = state.mean[8]
        mean[8] += d * d * v[2] * dt
        F[8, 8], F[8, 2] = 1.0 + 2.0 * d * v[2] * dt, d * d * dt
    else:
        w, n = state.mean[3:6], state.mean[12:]
        mean[12:] += dt * ((n @ v) * n - cross(w, n))
        F[12:, :3] = dt * np.outer(n, n)
        F[12:, 3:6] = dt * skew(n)
        F[12:, 12:] += dt * ((n @ v) * np.eye(3) + np.outer(n, v) - skew(w))
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
    if state.kind == "free":
        mean[12:14] *= MAX_INVERSE_DEPTH / d
    return _forget_depth(replace(state, mean=mean), settings)


def _process_noise(state: FlowFilterState, dt: float, settings: FlowFilterSettings) -> FloatArray:
    """White jerk on the motion, random walk on the depth."""
    motion = 4 if state.kind == "hard" else 6
    d = state.mean[-1]
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
    h, H = _twist_model(state)
    noise = np.array(twist_cov, dtype=np.float64)
    if state.kind == "hard" and gaze_rate is not None:
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


def _twist_model(state: FlowFilterState) -> tuple[FloatArray, FloatArray]:
    """Expected twist, shape (6,), and its derivative by the state, shape (6, n)."""
    H = np.zeros((6, state.mean.size))
    if state.kind == "free":
        H[:6, :6] = np.eye(6)
        return state.mean[:6], H
    v, roll, d = state.mean[:3], state.mean[3], state.mean[8]
    H[:3, :3] = np.eye(3)
    H[3, 1], H[3, 8] = d, v[1]
    H[4, 0], H[4, 8] = -d, -v[0]
    H[5, 3] = 1.0
    return np.array([*v, d * v[1], -d * v[0], roll]), H


def _flow_model(state: FlowFilterState, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Expected flow, shape (m, 2), and its derivative by the state, shape (m, 2, n)."""
    A, B = translation_part(points[:, 0], points[:, 1]), rotation_part(points[:, 0], points[:, 1])
    twist, H_twist = _twist_model(state)
    moved = A @ twist[:3]
    if state.kind == "hard":
        d = np.full(len(points), state.mean[8])
        d_by_state = np.zeros((len(points), 9))
        d_by_state[:, 8] = 1.0
    else:
        rays = np.column_stack([points, np.ones(len(points))])
        d = rays @ state.mean[12:]
        d_by_state = np.zeros((len(points), 15))
        d_by_state[:, 12:] = rays
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
    if state.kind == "hard":
        spread = np.linalg.norm(points - points.mean(axis=0), axis=1)
        model = settings.slant_std * state.mean[8] * spread * np.linalg.norm(state.mean[:2])
        cov = cov + model[:, None, None] ** 2 * np.eye(2)
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
    first = 8 if state.kind == "hard" else 12
    d = state.mean[-1]
    cov = state.cov.copy()
    cov[first:, :] = cov[:, first:] = 0.0
    stds = np.full(state.mean.size - first, settings.slant_std * d)
    stds[-1] = settings.initial_relative_std * d
    cov[first:, first:] = np.diag(stds**2)
    return replace(state, cov=cov, suspicious=0)


def distance_of(state: FlowFilterState, centroid: FloatArray | None = None) -> tuple[float, float]:
    """Depth along the optical axis of the target's centroid, m, and its standard deviation, m; both finite.

    Args:
        state: the estimate.
        centroid: normalised image coordinates, shape (2,); None for the image centre. The hard filter ignores it.
    """
    if state.kind == "hard":
        d, variance = float(state.mean[8]), float(state.cov[8, 8])
    else:
        ray = np.array([*(np.zeros(2) if centroid is None else centroid), 1.0])
        d, variance = float(ray @ state.mean[12:]), float(ray @ state.cov[12:, 12:] @ ray)
    d = min(max(d, MIN_INVERSE_DEPTH), MAX_INVERSE_DEPTH)
    return 1.0 / d, float(np.sqrt(variance)) / d**2


_DRIFT_FRAMES = 10
"""A gaze error lasts for about this many frames, so it counts as so many independent ones."""
MIN_INVERSE_DEPTH, MAX_INVERSE_DEPTH = 1e-3, 1e2
"""Objects farther than 1 km or nearer than 1 cm are put there, 1/m."""
