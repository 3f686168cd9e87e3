"""The door for distance estimators, and the ones that are there; each is an object that keeps a state between frames.

``PoseEstimator`` works on poses and centroids, and is checked by the motion of the target's own pixels. The paper's,
``FlowEstimator``, works on twist and flow, with the fixation constraint ("hard") or without ("free").
``TwistEstimator`` has the constraint alone. ``CalibratingEstimator`` also learns the errors of the calibration.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

import numpy as np

from fixation_gym.geometry.twist import mean_twist
from fixation_gym.perception.detection.segmentation import Segmentation
from fixation_gym.perception.distance import calibrating_filter, flow_filters, pose_filter
from fixation_gym.perception.distance.calibrating_filter import CalibratingSettings, CalibratingState, Sighting
from fixation_gym.perception.distance.fixation_constraint import ConstrainedGaze, ConstraintSettings, gaze_drift
from fixation_gym.perception.distance.flow_filters import FlowFilterState, FlowSamples, Kind
from fixation_gym.perception.distance.flow_samples import edge_samples
from fixation_gym.perception.distance.following import (
    Frame,
    begun_again,
    follow_constraint,
    follow_poses,
    mean_variance,
)
from fixation_gym.perception.distance.pose_filter import DistanceSettings, DistanceState, Fixation
from fixation_gym.perception.distance.target_motion import InverseDepth, contradiction, target_inverse_depth
from fixation_gym.perception.flow.optic_flow import Flow
from fixation_gym.perception.zero_flow.zero_flow import widened_on_grid
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray

Frames = tuple[Frame, Frame, Frame]
Follow = Callable[[DistanceState | None, Frame | None, Frame, DistanceSettings], tuple[DistanceState | None, bool]]
"""Advances the distance by a frame, as ``follow_poses`` does."""

_OWN_DEPTHS = 5
"""Frames over which the motion of the target's own pixels is believed."""
_COVERED_S = 1.0
"""For this time after something covered or uncovered the target its centroid is not to be trusted, s."""
_MAX_GAP_S = 0.15
"""Frames farther apart than this say nothing together, s."""


class DistanceEstimator(Protocol):
    """Says how far the target is, from frames one after the other."""

    def reset(self) -> None:
        """Forget everything; also called when the target was pushed or dropped."""
        ...

    def add_frame(self, frame: Frame) -> None:
        """Take in a frame, whether or not the target is seen in it."""
        ...

    def add_flow(self, flow: Flow, frames: Frames) -> None:
        """Take in the flow at the middle of the last three frames; called where the target is seen in the last two."""
        ...

    def fixation(self, T_base_cam: FloatArray, seen: Segmentation | None) -> Fixation:
        """What is known of the target, for a camera at a pose, shape (4, 4), in which it is seen, if it is."""
        ...


def inverse_distance(estimator: DistanceEstimator, T_base_cam: FloatArray) -> InverseDepth:
    """Inverse depth of the target for a camera and its standard deviation, 1/m; 0 before it was seen."""
    fixation = estimator.fixation(T_base_cam, None)
    if not fixation.initialised:
        return 0.0, 0.0
    return 1.0 / fixation.distance_m, fixation.distance_std_m / fixation.distance_m**2


def _described(
    state: DistanceState | None, T_base_cam: FloatArray, seen: Segmentation | None, settings: DistanceSettings
) -> Fixation:
    if seen is None or not seen.visible:
        return pose_filter.fixation_at(state, T_base_cam, settings)
    return pose_filter.fixation_at(state, T_base_cam, settings, seen.centroid, mean_variance(seen))


class PoseEstimator:
    """The three-state filter on poses and centroids, begun again where the target's own motion contradicts it."""

    def __init__(self, settings: DistanceSettings | None = None, follow: Follow = follow_poses) -> None:
        """Start without knowledge; ``follow`` says how a frame changes the estimate."""
        self._settings, self._follow = settings or DistanceSettings(), follow
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._state: DistanceState | None = None
        self._before: Frame | None = None
        self._own_depths: deque[InverseDepth | None] = deque(maxlen=_OWN_DEPTHS)
        self._covered_time = -math.inf

    def add_frame(self, frame: Frame) -> None:
        """Advance by a frame's pose and centroid."""
        before = self._before
        if not frame.segmentation.visible or (before is not None and frame.time - before.time > _MAX_GAP_S):
            self._own_depths.clear()
        self._state, covering = self._follow(self._state, before, frame, self._settings)
        self._covered_time = frame.time if covering else self._covered_time
        self._before = frame

    def add_flow(self, flow: Flow, frames: Frames) -> None:
        """Begin the distance again if the target's own motion contradicts what its centroid says."""
        first, middle, last = frames
        twist = mean_twist(first.T_base_cam, last.T_base_cam, last.time - first.time)
        target = widened_on_grid(middle.segmentation.mask, flow.overlap.shape, 0)
        # None takes a place, too: what the motion said long ago is about another distance.
        self._own_depths.append(target_inverse_depth(flow, twist, target))
        recent = [own for own in self._own_depths if own is not None]
        covered = last.time - self._covered_time < _COVERED_S
        assert self._state is not None, "the target was seen"
        depth, std, _ = pose_filter.distance_at(self._state, middle.T_base_cam, self._settings)
        own = contradiction((1.0 / depth, std / depth**2), recent, covered)
        if own is not None:
            self._state = begun_again(own, middle, last, self._settings)
            self._own_depths.clear()

    def fixation(self, T_base_cam: FloatArray, seen: Segmentation | None) -> Fixation:
        """What is known of the target."""
        return _described(self._state, T_base_cam, seen, self._settings)


class TwistEstimator:
    """The paper's fixation constraint on the measured twist alone."""

    def __init__(self, settings: DistanceSettings | None = None, constraint: ConstraintSettings | None = None) -> None:
        """Start without knowledge."""
        self._settings, self._constraint = settings or DistanceSettings(), constraint or ConstraintSettings()
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._state: DistanceState | None = None
        self._gaze: ConstrainedGaze | None = None
        self._before: Frame | None = None

    def add_frame(self, frame: Frame) -> None:
        """Advance by a frame's twist."""
        self._state, self._gaze = follow_constraint(
            self._state, self._gaze, self._before, frame, self._settings, self._constraint
        )
        self._before = frame

    def add_flow(self, flow: Flow, frames: Frames) -> None:
        """Flow is not used."""

    def fixation(self, T_base_cam: FloatArray, seen: Segmentation | None) -> Fixation:
        """What is known of the target."""
        return _described(self._state, T_base_cam, seen, self._settings)


class FlowEstimator:
    """The filters on measured twist and flow at random edge points of the target, the paper's with kind "hard".

    Flow comes a frame late: the filter stands at the last frame but one, and is predicted to the last.
    """

    def __init__(
        self,
        kind: Kind = "hard",
        settings: DistanceSettings | None = None,
        constraint: ConstraintSettings | None = None,
    ) -> None:
        """Start without knowledge."""
        self._kind: Kind = kind
        self._settings, self._constraint = settings or DistanceSettings(), constraint or ConstraintSettings()
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._filter: FlowFilterState | None = None
        self._filter_time = -math.inf
        self._frames: deque[Frame] = deque(maxlen=2)  # the last two
        self._drift = np.zeros(2)
        self._hidden: DistanceState | None = None
        self._rng = np.random.default_rng(0)  # chooses edge points

    def add_frame(self, frame: Frame) -> None:
        """Note a frame; those for which no flow came bring their twist."""
        if self._frames and self._frames[-1].time > self._filter_time and len(self._frames) == 2:
            self._absorb(self._frames[0], None)
        before = self._frames[-1] if self._frames else None
        if not frame.segmentation.visible:
            self._hide(frame, before)
            return
        if before is not None and before.segmentation.visible:
            centroids = before.segmentation.centroid, frame.segmentation.centroid
            dt = frame.time - before.time
            self._drift = gaze_drift(self._drift, *centroids, dt, self._constraint.centroid_std)
        if self._filter is None:
            self._filter = flow_filters.initialise(self._kind, self._constraint.filter)
            self._filter_time = frame.time
        self._frames.append(frame)

    def _hide(self, frame: Frame, before: Frame | None) -> None:
        """While the target is hidden its point stays where it is, ever less sure; the filter begins again after."""
        if self._filter is not None and before is not None:
            self._hidden = self._anchored(before)
            self._filter, self._drift = None, np.zeros(2)
        if self._hidden is not None:
            dt = 0.0 if before is None else frame.time - before.time
            self._hidden = pose_filter.predict(self._hidden, dt, self._settings, visible=False)
        self._frames.append(frame)

    def add_flow(self, flow: Flow, frames: Frames) -> None:
        """Take in flow on the target's edges with the twist of the same frame."""
        samples = edge_samples(flow, frames[1].segmentation.mask, self._rng)
        self._absorb(frames[1], None if samples is None else _doubted(samples))

    def _absorb(self, frame: Frame, samples: FlowSamples | None) -> None:
        if self._filter is None or not frame.segmentation.visible or frame.time <= self._filter_time:
            return
        constraint = self._constraint
        noise = np.diag([constraint.velocity_std**2] * 3 + [constraint.rate_std**2] * 3)
        state = flow_filters.predict(self._filter, frame.time - self._filter_time, constraint.filter)
        state = flow_filters.update(state, frame.camera_twist, noise, samples, constraint.filter, self._drift)
        if flow_filters.distance_of(state)[0] > constraint.farthest_m:
            state = flow_filters.initialise(self._kind, constraint.filter)
        self._filter, self._filter_time = state, frame.time

    def _anchored(self, frame: Frame) -> DistanceState:
        """The estimate as a point on the ray to the centroid of a frame in which the target is seen."""
        assert self._filter is not None
        state = self._filter
        if frame.time > self._filter_time:
            state = flow_filters.predict(state, frame.time - self._filter_time, self._constraint.filter)
        centroid = frame.segmentation.centroid
        depth, std = flow_filters.distance_of(state, centroid)
        return pose_filter.restart(centroid, frame.T_base_cam, depth, std, self._settings)

    def fixation(self, T_base_cam: FloatArray, seen: Segmentation | None) -> Fixation:
        """What is known of the target."""
        last = self._frames[-1] if self._frames else None
        visible = self._filter is not None and last is not None and last.segmentation.visible
        state = self._anchored(last) if visible and last is not None else self._hidden
        return _described(state, T_base_cam, seen, self._settings)


def _doubted(samples: FlowSamples) -> FlowSamples:
    """Samples that count the less the faster the target as a whole moves in the image: then it is not fixated."""
    finite = np.isfinite(samples.flow).all(axis=1)
    if not finite.any():
        return samples
    drift = np.median(samples.flow[finite], axis=0)
    return replace(samples, cov=samples.cov + float(drift @ drift) * len(samples.flow) * np.eye(2))


class CalibratingEstimator:
    """Poses and centroids over a window, with hand-eye error and image age among the unknowns."""

    def __init__(self, settings: CalibratingSettings | None = None) -> None:
        """Start without knowledge."""
        self._settings = settings or CalibratingSettings(
            centroid_std=1e-3, centroid_std_size=0.02, hand_eye_m=1e-3, hand_eye_rad=2e-3, image_age_s=8e-3
        )
        self.reset()

    def reset(self) -> None:
        """Forget the target and what was learnt of the calibration."""
        self._state: CalibratingState | None = None
        self._last: Sighting | None = None
        self._time = -math.inf

    def add_frame(self, frame: Frame) -> None:
        """Add a frame to the window."""
        dt = 0.0 if self._last is None else frame.time - self._time
        self._last, self._time = _sighting(frame), frame.time
        self._state = calibrating_filter.advance(self._state, self._last, dt, self._settings)

    def add_flow(self, flow: Flow, frames: Frames) -> None:
        """Flow is not used."""

    def fixation(self, T_base_cam: FloatArray, seen: Segmentation | None) -> Fixation:
        """What is known of the target."""
        state, settings = self._state, self._settings
        prior = DistanceSettings(settings.initial_distance_m, settings.initial_relative_std)
        if state is None or self._last is None:
            return _described(None, T_base_cam, seen, prior)
        point = DistanceState(state.T_base_anchor, state.mean[:3], state.cov[:3, :3], state.nis)
        now = calibrating_filter.distance_at(state, replace(self._last, T_base_cam=T_base_cam))
        return replace(
            _described(point, T_base_cam, seen, prior),
            distance_m=now.robot,
            distance_std_m=now.robot_std,
            lens=(now.lens, now.lens_std),
        )


def _sighting(frame: Frame) -> Sighting:
    """A frame as the calibrating filter takes it."""
    seen = frame.segmentation
    stds = [ROBOT.arm.position_std] * 3 + [ROBOT.arm.rotation_std] * 3
    pose_cov = np.diag(np.square(stds)) if frame.rig is None else frame.rig.pose_cov
    if not seen.visible:
        return Sighting(frame.T_base_cam, pose_cov, frame.camera_twist, None)
    return Sighting(frame.T_base_cam, pose_cov, frame.camera_twist, seen.centroid, math.sqrt(mean_variance(seen)))
