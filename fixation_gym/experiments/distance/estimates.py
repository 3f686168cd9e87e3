"""Every estimator on one recorded sequence, and how well it did."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fixation_gym.envs.config import SensorNoise
from fixation_gym.experiments.distance.recording import Frame, Recording, filter_settings, pose_estimate
from fixation_gym.experiments.distance.sequence import CENTROID_STD_PX, CYCLE_RATE, INTRINSICS
from fixation_gym.geometry.twist import skew
from fixation_gym.perception.distance import calibrating_filter
from fixation_gym.perception.distance import flow_filters as flow_distance_filters
from fixation_gym.perception.distance import pose_filter as distance_filters
from fixation_gym.perception.distance.fixation_constraint import gaze_drift
from fixation_gym.perception.distance.flow_filters import FlowFilterSettings, Kind
from fixation_gym.perception.distance.flow_samples import FLOW_NAMES, FlowName
from fixation_gym.perception.distance.pose_filter import DistanceSettings
from fixation_gym.types import FloatArray

ONSET_TOLERANCE, JUMP_TOLERANCE = 0.03, 0.05
"""Relative errors that count as settled after the onset of motion and after the jump."""


@dataclass(frozen=True)
class Estimator:
    """One way to get the distance from a recording."""

    name: str
    """"hard", "free", "pose", or "pose3": the three-state filter of the pick task with its own settings."""
    flow: FlowName | None = None
    """Which flow it uses, if any."""
    hand_eye: bool = True
    """False: the same run with perfect hand-eye calibration."""


def estimators(motion: str) -> tuple[Estimator, ...]:
    """Those that make sense: without rotation the fixation constraint would put the target at infinity."""
    kinds = ("hard", "free") if motion == "fixation" else ("free",)
    on_flow = tuple(Estimator(kind, flow) for kind in kinds for flow in FLOW_NAMES)
    return (*on_flow, Estimator("pose"), Estimator("pose", hand_eye=False), Estimator("pose3"))


@dataclass(frozen=True, eq=False)
class Track:
    """Estimates at every frame of a recording, each of shape (n,), m; NaN before the first one."""

    robot: FloatArray
    """Depth in the camera frame that the robot believes in."""
    robot_std: FloatArray
    lens: FloatArray
    """Depth from the true camera; the same as ``robot`` for estimators that know no difference."""
    lens_std: FloatArray
    nis: FloatArray
    """Normalised innovation squared per degree of freedom."""


def run(recording: Recording, estimator: Estimator, noise: SensorNoise) -> Track:
    """Run one estimator over all frames."""
    if estimator.name == "pose":
        rows = recording.pose_track if estimator.hand_eye else _calibrated_pose(recording, noise)
    elif estimator.name == "pose3":
        rows = _pose3(recording)
    else:
        rows = _flow(recording, estimator)
    return Track(*np.array(list(rows)).T)


def _calibrated_pose(recording: Recording, noise: SensorNoise) -> Iterator[tuple[float, ...]]:
    """The pose filter as if the hand-eye calibration had been perfect."""
    settings = filter_settings(noise, recording.first_guess_m, hand_eye=False)
    state = None
    for frame in recording.frames:
        sighting = replace(frame.sighting, T_base_cam=frame.T_base_cam_calibrated)
        state = calibrating_filter.advance(state, sighting, recording.period, settings)
        yield pose_estimate(state, sighting)


def _pose3(recording: Recording) -> Iterator[tuple[float, ...]]:
    settings = DistanceSettings(initial_distance_m=recording.first_guess_m)
    state = None
    for frame in recording.frames:
        sighting = frame.sighting
        pose, centroid = sighting.T_base_cam, sighting.centroid
        if state is not None:
            state = distance_filters.predict(state, recording.period, settings, centroid is not None)
        if centroid is not None:
            if state is None:
                state = distance_filters.initialise(centroid, pose, settings)
            else:
                state = distance_filters.update(
                    state, centroid, pose, settings, sighting.image_std, frame.touches_border
                )
        if state is None:
            yield (np.nan,) * 5
            continue
        depth, std, _ = distance_filters.distance_at(state, pose, settings)
        yield depth, std, depth, std, state.nis / 2.0


def _flow(recording: Recording, estimator: Estimator) -> Iterator[tuple[float, ...]]:
    """Frame k brings the flow of frame k - 1; the state is of that time and is predicted to now."""
    kind: Kind = "hard" if estimator.name == "hard" else "free"
    dt = recording.period
    settings = FlowFilterSettings(
        initial_distance_m=recording.first_guess_m, jerk=recording.condition.amplitude_m * CYCLE_RATE**3
    )
    state = flow_distance_filters.initialise(kind, settings)
    drift = np.zeros(2)
    last: Frame | None = None
    for frame in recording.frames:
        if last is not None:
            flow = None if frame.flow is None or estimator.flow is None else frame.flow[estimator.flow]
            seen = last.sighting.centroid, frame.sighting.centroid
            drift = gaze_drift(drift, *seen, dt, CENTROID_STD_PX / INTRINSICS.fx)
            state = flow_distance_filters.update(state, last.sighting.twist, last.twist_cov, flow, settings, drift)
            state = flow_distance_filters.predict(state, dt, settings)
        depth, std = flow_distance_filters.distance_of(state, frame.sighting.centroid)
        yield depth, std, depth, std, state.nis
        last = frame


def assess(recording: Recording, estimator: Estimator, track: Track) -> dict[str, Any]:
    """Sums over the measured samples and settling times, JSON-able."""
    frames = recording.frames
    counted = recording.measured
    distance = recording.condition.distance_m
    result: dict[str, Any] = {"estimator": estimator.name, "flow": estimator.flow, "hand_eye": estimator.hand_eye}
    pairs = {
        "robot": (track.robot, track.robot_std, np.array([frame.distance_robot_m for frame in frames])),
        "lens": (track.lens, track.lens_std, np.array([frame.distance_lens_m for frame in frames])),
    }
    for name, (estimate, std, truth) in pairs.items():
        if not estimator.hand_eye:
            truth = pairs["lens"][2]
        error = (estimate - truth)[counted]
        nees = (error / std[counted]) ** 2
        result[name] = {
            "samples": int(error.size),
            "error": float(error.sum()),
            "error2": float((error**2).sum()),
            "absolute": float(np.abs(error).sum()),
            "nees": float(nees.sum()),
            "std": float(std[counted].sum()),
        }
    truth = pairs["robot" if estimator.hand_eye else "lens"][2]
    relative = np.abs(track.robot - truth) / distance
    one = round(1.0 / recording.period)
    jump = counted.stop - 1
    nis = track.nis[2 : counted.stop]
    result["nis"] = float(nis[np.isfinite(nis)].mean())
    result["relative_1s"] = float(relative[one])
    result["settle_s"] = _settled(relative[: counted.stop], ONSET_TOLERANCE, recording.period)
    result["jump_relative_1s"] = float(relative[jump + one])
    result["jump_settle_s"] = _settled(relative[jump:], JUMP_TOLERANCE, recording.period)
    return result


def _settled(relative: FloatArray, tolerance: float, period: float) -> float | None:
    """Time after which the error stays within the tolerance, s; None if it does not."""
    outside = np.flatnonzero(~(relative <= tolerance))
    if outside.size == 0:
        return 0.0
    return None if outside[-1] == relative.size - 1 else float((outside[-1] + 1) * period)


def bounds(recording: Recording, centroid_std: float, flow_std_px: float = 0.2) -> dict[str, float]:
    """Cramer-Rao bounds on the standard deviation of the distance, m, mean over the measured samples.

    ``pose``: poses and centroids, var(d) >= s_ray^2 / sum |p_k - p_mean|^2, with s_ray the noise of a bearing (pose and
    centroid), plus the momentary noise of the pose. ``velocity_hard`` and ``velocity_free``: twist and flow,
    var(d) >= (s_w^2 + d^2 s_v^2 + k s_u^2) / sum |v_k|^2 with k = 0 under the fixation constraint and 1 without.
    """
    frames, counted = recording.frames, recording.measured
    z = recording.condition.distance_m
    by_pose = np.hstack([np.eye(3), -skew(np.array([0.0, 0.0, z]))])
    noise = np.mean([by_pose @ frame.sighting.pose_cov @ by_pose.T for frame in frames], axis=0)
    ray = centroid_std**2 + 0.5 * (noise[0, 0] + noise[1, 1]) / z**2
    positions = np.array([frame.sighting.T_base_cam[:3, 3] for frame in frames])
    count = np.arange(1, len(frames) + 1)
    spread = np.cumsum((positions**2).sum(1)) - (np.cumsum(positions, axis=0) ** 2).sum(1) / count
    pose = np.sqrt(z**4 * ray / spread[counted] + noise[2, 2])
    twist = np.mean([frame.twist_cov for frame in frames], axis=0)
    s_v, s_w = 0.5 * (twist[0, 0] + twist[1, 1]), 0.5 * (twist[3, 3] + twist[4, 4])
    s_u = (flow_std_px * np.sqrt(0.1) / (INTRINSICS.fx * recording.period)) ** 2
    travelled = (recording.condition.amplitude_m * CYCLE_RATE) ** 2 * count[counted]
    result = {"pose": float(pose.mean())}
    for name, share in (("velocity_hard", 0.0), ("velocity_free", 1.0)):
        variance = (s_w + s_v / z**2 + share * s_u) / travelled
        result[name] = float(np.mean(z**2 * np.sqrt(variance)))
    return result
