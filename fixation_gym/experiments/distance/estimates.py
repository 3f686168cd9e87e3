"""Every estimator on one recorded sequence, and how well it did."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fixation_gym.envs.sensor_noise import SensorNoise
from fixation_gym.experiments.distance.recording import Recording, calibrating_settings
from fixation_gym.experiments.distance.sequence import CENTROID_STD_PX, CYCLE_RATE, INTRINSICS
from fixation_gym.geometry.rigid import transform
from fixation_gym.geometry.twist import skew
from fixation_gym.perception.detection.segmentation import Segmentation
from fixation_gym.perception.distance import flow_filters, pose_filter
from fixation_gym.perception.distance.batch_triangulation import triangulate
from fixation_gym.perception.distance.calibrating_estimator import CalibratingEstimator
from fixation_gym.perception.distance.calibrating_filter import CalibratingSettings, CalibratingState, distance_at
from fixation_gym.perception.distance.calibration_model import Sighting
from fixation_gym.perception.distance.estimator import DistanceEstimator, Frames, PoseEstimator
from fixation_gym.perception.distance.fixation_constraint import gaze_drift
from fixation_gym.perception.distance.flow_filters import FlowFilterSettings
from fixation_gym.perception.distance.flow_models import Kind
from fixation_gym.perception.distance.flow_samples import FLOW_NAMES, FlowName
from fixation_gym.perception.distance.following import Frame, mean_variance
from fixation_gym.perception.distance.pose_filter import DistanceSettings, DistanceState, Fixation
from fixation_gym.perception.flow.optic_flow import Flow
from fixation_gym.types import FloatArray

ONSET_TOLERANCE, JUMP_TOLERANCE = 0.03, 0.05
"""Relative errors that count as settled after the onset of motion and after the jump."""
_TRIANGULATE_EVERY = 12
"""Frames after which the triangulation is made again: half a second."""


class RecordedFlow:
    """A flow filter on the twists and the flow of a rig; the paper's with kind "hard".

    Frame k brings the flow of frame k - 1: the filter hears of both, and is predicted to now. While the target is not
    seen it goes on by twist.
    """

    def __init__(self, kind: Kind, flow: FlowName, settings: FlowFilterSettings) -> None:
        """Start at the first guess."""
        self._kind: Kind = kind
        self._flow: FlowName = flow
        self._settings = settings
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._state = flow_filters.initialise(self._kind, self._settings)
        self._drift = np.zeros(2)
        self._last: Frame | None = None

    def add_frame(self, frame: Frame) -> None:
        """Take in the twist and the flow of the frame before."""
        last, self._last = self._last, frame
        if last is None or last.rig is None or frame.rig is None:
            return
        dt = round(frame.time - last.time, 9)  # all equal, as those of the rig are
        before, now = (f.segmentation.centroid if f.segmentation.visible else None for f in (last, frame))
        self._drift = gaze_drift(self._drift, before, now, dt, CENTROID_STD_PX / INTRINSICS.fx)
        flow = None if frame.rig.flow is None else frame.rig.flow[self._flow]
        twist, settings = last.camera_twist, self._settings
        state = flow_filters.update(self._state, twist, last.rig.twist_cov, flow, settings, self._drift)
        self._state = flow_filters.predict(state, dt, settings)

    def add_flow(self, flow: Flow, frames: Frames) -> None:
        """Flow of whole images is not used."""

    def fixation(self, T_base_cam: FloatArray, seen: Segmentation | None) -> Fixation:
        """What is known of the target, for the camera of the last frame."""
        visible = seen is not None and seen.visible
        centroid = seen.centroid if seen is not None and visible else np.zeros(2)
        depth, std = flow_filters.distance_of(self._state, centroid)
        point = transform(T_base_cam, depth * np.array([*centroid, 1.0]))
        return Fixation(visible, np.array(centroid), point, depth, std, 2.0 * self._state.nis, True)


class RecordedTriangulation:
    """One triangulation of all centroids so far, made again every few frames."""

    def __init__(self, settings: CalibratingSettings) -> None:
        """Start without knowledge."""
        self._settings = settings
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._sightings: list[Sighting] = []
        self._state: CalibratingState | None = None

    def add_frame(self, frame: Frame) -> None:
        """Keep a frame; every few of them the triangulation is made again."""
        assert frame.rig is not None
        seen = frame.segmentation
        centroid = seen.centroid if seen.visible else None
        self._sightings.append(Sighting(frame.T_base_cam, frame.rig.pose_cov, frame.camera_twist, centroid))
        if self._state is None or len(self._sightings) % _TRIANGULATE_EVERY == 0:
            self._state = triangulate(self._sightings, self._settings)

    def add_flow(self, flow: Flow, frames: Frames) -> None:
        """Flow is not used."""

    def fixation(self, T_base_cam: FloatArray, seen: Segmentation | None) -> Fixation:
        """What is known of the target, for the camera of the last frame."""
        prior = DistanceSettings(self._settings.initial_distance_m, self._settings.initial_relative_std)
        if self._state is None:
            return pose_filter.fixation_at(None, T_base_cam, prior)
        found = distance_at(self._state, self._sightings[-1])
        state = DistanceState(self._state.T_base_anchor, self._state.mean[:3], self._state.cov[:3, :3])
        fixation = pose_filter.fixation_at(state, T_base_cam, prior)
        depths = {"distance_m": found.robot, "distance_std_m": found.robot_std, "lens": (found.lens, found.lens_std)}
        return replace(fixation, **depths)


def follow_unguarded(
    state: DistanceState | None, before: Frame | None, now: Frame, settings: DistanceSettings
) -> tuple[DistanceState | None, bool]:
    """As ``follow_poses``, without its watch for what covers the target: nothing does here."""
    seen = now.segmentation
    if state is not None and before is not None:
        state = pose_filter.predict(state, now.time - before.time, settings, seen.visible)
    if not seen.visible:
        return state, False
    if state is None:
        return pose_filter.initialise(seen.centroid, now.T_base_cam, settings), False
    size = math.sqrt(mean_variance(seen))
    return pose_filter.update(state, seen.centroid, now.T_base_cam, settings, size, seen.touches_border), False


@dataclass(frozen=True, eq=False)
class Method:
    """An estimator and its name in the results."""

    name: str
    """"hard", "free", "pose", "batch": a triangulation with the unknowns of "pose", "pose3": the three-state filter of
    the pick task with its own settings."""
    estimator: DistanceEstimator
    flow: FlowName | None = None
    """Which flow it uses, if any."""
    hand_eye: bool = True
    """False: the same run with perfect hand-eye calibration."""


def methods(recording: Recording, noise: SensorNoise) -> tuple[Method, ...]:
    """Those that make sense: without rotation the fixation constraint would put the target at infinity."""
    condition, guess = recording.condition, recording.first_guess_m
    kinds: tuple[Kind, ...] = ("hard", "free") if condition.motion == "fixation" else ("free",)
    settings = FlowFilterSettings(initial_distance_m=guess, jerk=condition.amplitude_m * CYCLE_RATE**3)
    exact = replace(noise, hand_eye_m=0.0, hand_eye_rad=0.0)
    return (
        *(Method(kind, RecordedFlow(kind, flow, settings), flow) for kind in kinds for flow in FLOW_NAMES),
        Method("pose", CalibratingEstimator(calibrating_settings(noise, guess))),
        Method("pose", CalibratingEstimator(calibrating_settings(exact, guess)), hand_eye=False),
        Method("batch", RecordedTriangulation(calibrating_settings(noise, guess))),
        Method("pose3", PoseEstimator(DistanceSettings(initial_distance_m=guess), follow_unguarded)),
    )


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


def run(recording: Recording, method: Method) -> Track:
    """Run one estimator over all frames."""
    rows = []
    method.estimator.reset()
    for frame in recording.frames:
        seen = frame.seen if method.hand_eye else replace(frame.seen, T_base_cam=frame.T_base_cam_calibrated)
        method.estimator.add_frame(seen)
        rows.append(_numbers(method.estimator.fixation(seen.T_base_cam, seen.segmentation)))
    return Track(*np.array(rows).T)


def _numbers(fixation: Fixation) -> tuple[float, ...]:
    """A row of a ``Track``."""
    if not fixation.initialised:
        return (math.nan,) * 5
    robot = fixation.distance_m, fixation.distance_std_m
    return (*robot, *(fixation.lens or robot), fixation.nis / 2.0)


def assess(recording: Recording, method: Method, track: Track) -> dict[str, Any]:
    """Sums over the measured samples and settling times, JSON-able."""
    frames = recording.frames
    counted = recording.measured
    distance = recording.condition.distance_m
    result: dict[str, Any] = {"estimator": method.name, "flow": method.flow, "hand_eye": method.hand_eye}
    pairs = {
        "robot": (track.robot, track.robot_std, np.array([frame.distance_robot_m for frame in frames])),
        "lens": (track.lens, track.lens_std, np.array([frame.distance_lens_m for frame in frames])),
    }
    for name, (estimate, std, truth) in pairs.items():
        if not method.hand_eye:
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
    truth = pairs["robot" if method.hand_eye else "lens"][2]
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
    known = [frame.seen.rig for frame in frames if frame.seen.rig is not None]
    by_pose = np.hstack([np.eye(3), -skew(np.array([0.0, 0.0, z]))])
    noise = np.mean([by_pose @ rig.pose_cov @ by_pose.T for rig in known], axis=0)
    ray = centroid_std**2 + 0.5 * (noise[0, 0] + noise[1, 1]) / z**2
    positions = np.array([frame.seen.T_base_cam[:3, 3] for frame in frames])
    count = np.arange(1, len(frames) + 1)
    spread = np.cumsum((positions**2).sum(1)) - (np.cumsum(positions, axis=0) ** 2).sum(1) / count
    pose = np.sqrt(z**4 * ray / spread[counted] + noise[2, 2])
    twist = np.mean([rig.twist_cov for rig in known], axis=0)
    s_v, s_w = 0.5 * (twist[0, 0] + twist[1, 1]), 0.5 * (twist[3, 3] + twist[4, 4])
    s_u = (flow_std_px * np.sqrt(0.1) / (INTRINSICS.fx * recording.period)) ** 2
    travelled = (recording.condition.amplitude_m * CYCLE_RATE) ** 2 * count[counted]
    result = {"pose": float(pose.mean())}
    for name, share in (("velocity_hard", 0.0), ("velocity_free", 1.0)):
        variance = (s_w + s_v / z**2 + share * s_u) / travelled
        result[name] = float(np.mean(z**2 * np.sqrt(variance)))
    return result
