"""The door for distance estimators, and those that are there; each is an object that keeps a state between frames.

``PoseEstimator`` works on poses and centroids, and is checked by the motion of the target's own pixels. The paper's,
``FlowEstimator``, works on twist and flow, with the fixation constraint ("hard") or without ("free").
``TwistEstimator`` has the constraint alone. ``CalibratingEstimator``, in a file of its own, is as ``PoseEstimator`` and
also learns the errors of the calibration.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

import numpy as np

from fixation_gym.perception.detection.segmentation import Segmentation
from fixation_gym.perception.distance import flow_filters, pose_filter
from fixation_gym.perception.distance.fixation_constraint import ConstrainedGaze, ConstraintSettings, gaze_drift
from fixation_gym.perception.distance.flow_filters import FlowFilterState, FlowSamples
from fixation_gym.perception.distance.flow_models import Kind
from fixation_gym.perception.distance.flow_samples import edge_samples
from fixation_gym.perception.distance.following import (
    Frame,
    begun_again,
    follow_constraint,
    follow_poses,
    mean_variance,
)
from fixation_gym.perception.distance.own_motion import OwnMotion
from fixation_gym.perception.distance.pose_filter import DistanceSettings, DistanceState, Fixation
from fixation_gym.perception.distance.target_motion import InverseDepth
from fixation_gym.perception.flow.optic_flow import Flow
from fixation_gym.types import FloatArray

Frames = tuple[Frame, Frame, Frame]
Follow = Callable[[DistanceState | None, Frame | None, Frame, DistanceSettings], tuple[DistanceState | None, bool]]
"""Advances the distance by a frame, as ``follow_poses`` does."""


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
    depth, std = fixation.depth_seen
    return 1.0 / depth, std / depth**2


def described(
    state: DistanceState | None, T_base_cam: FloatArray, seen: Segmentation | None, settings: DistanceSettings
) -> Fixation:
    """What a state of the pose filter says of the target, for a camera at a pose, shape (4, 4)."""
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
        self._own = OwnMotion()

    def add_frame(self, frame: Frame) -> None:
        """Advance by a frame's pose and centroid."""
        self._state, covering = self._follow(self._state, self._before, frame, self._settings)
        self._own.note_frame(self._before, frame, covering)
        self._before = frame

    def add_flow(self, flow: Flow, frames: Frames) -> None:
        """Begin the distance again if the target's own motion contradicts what its centroid says."""
        _, middle, last = frames
        assert self._state is not None, "the target was seen"
        depth, std, _ = pose_filter.distance_at(self._state, middle.T_base_cam, self._settings)
        own = self._own.contradiction((1.0 / depth, std / depth**2), flow, frames)
        if own is not None:
            self._state = begun_again(own, middle, last, self._settings)

    def fixation(self, T_base_cam: FloatArray, seen: Segmentation | None) -> Fixation:
        """What is known of the target."""
        return described(self._state, T_base_cam, seen, self._settings)


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
        return described(self._state, T_base_cam, seen, self._settings)


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
        return described(state, T_base_cam, seen, self._settings)


def _doubted(samples: FlowSamples) -> FlowSamples:
    """Samples that count the less the faster the target as a whole moves in the image: then it is not fixated."""
    finite = np.isfinite(samples.flow).all(axis=1)
    if not finite.any():
        return samples
    drift = np.median(samples.flow[finite], axis=0)
    return replace(samples, cov=samples.cov + float(drift @ drift) * len(samples.flow) * np.eye(2))
