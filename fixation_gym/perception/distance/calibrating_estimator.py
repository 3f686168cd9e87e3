"""The distance estimator that also learns what is wrong with poses, stamps and focal length, and says it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fixation_gym.geometry.rigid import inverse, transform
from fixation_gym.geometry.twist import mean_twist
from fixation_gym.perception.detection.segmentation import Segmentation
from fixation_gym.perception.distance import calibrating_filter
from fixation_gym.perception.distance.calibrating_filter import CalibratingSettings, CalibratingState
from fixation_gym.perception.distance.calibration_model import AGE, FOCAL, ROTATION, TRANSLATION, Sighting
from fixation_gym.perception.distance.estimator import Frames, described
from fixation_gym.perception.distance.following import Frame, is_covering, size_of, slide_of
from fixation_gym.perception.distance.own_motion import MAX_GAP_S, OwnMotion
from fixation_gym.perception.distance.pose_filter import DistanceSettings, DistanceState, Fixation
from fixation_gym.perception.flow.optic_flow import Flow
from fixation_gym.types import FloatArray

_BORDER_STD_SIZE = 0.5
"""Noise of the centroid, as a share of the target's size, where the target touches the image border."""


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """What was learnt of a camera; every std is that of the estimate beside it."""

    translation_m: FloatArray
    """Hand-eye translation error in the camera frame, shape (3,)."""
    translation_std_m: FloatArray
    rotation_rad: FloatArray
    """Hand-eye rotation error, a rotation vector in the camera frame, shape (3,)."""
    rotation_std_rad: FloatArray
    image_age_s: float
    """How much older pictures are than their poses."""
    image_age_std_s: float
    focal: float
    """Relative error of the focal length: above 0, the true one is larger."""
    focal_std: float
    noise: float
    """How many times larger than stated the noise of poses and centroids is, as a standard deviation."""
    noise_dof: float
    """Degrees of freedom that this rests on."""
    restarts: int
    """How often the target was not where it was expected, so that the distance began again."""


class CalibratingEstimator:
    """Poses and centroids over a window, with the errors of the calibration among the unknowns.

    Watched as ``PoseEstimator`` is: what covers the target lets its centroid slide, and the motion of its own pixels
    may contradict the distance.
    """

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
        self._before: Frame | None = None
        self._earlier: Frame | None = None
        self._own = OwnMotion()

    def add_frame(self, frame: Frame) -> None:
        """Add a frame to the window."""
        before, covering, slid = self._before, False, 0.0
        dt = 0.0 if before is None else frame.time - before.time
        if self._state is not None and before is not None and frame.rig is None:  # on a rig nothing covers it
            slid = slide_of(self._point(self._state), before, frame)
            covering = is_covering(before, frame, slid)
        self._state = self._with_central_twist(frame)
        self._last, self._before, self._earlier = self._sighting(frame, dt, slid), frame, before
        if covering and self._state is not None:
            depth = calibrating_filter.distance_at(self._state, self._last).robot
            self._state = calibrating_filter.walked(self._state, (slid * depth) ** 2)
        self._state = calibrating_filter.advance(self._state, self._last, dt, self._settings)
        self._own.note_frame(before, frame, covering)

    def add_flow(self, flow: Flow, frames: Frames) -> None:
        """Begin the distance again if the target's own motion contradicts what its centroid says."""
        _, middle, last = frames
        assert self._state is not None, "the target was seen"
        assert self._last is not None
        now = calibrating_filter.distance_at(self._state, replace(self._last, T_base_cam=middle.T_base_cam))
        own = self._own.contradiction((1.0 / now.lens, now.lens_std / now.lens**2), flow, frames)
        if own is None:
            return
        point = transform(middle.T_base_cam, np.array([*middle.segmentation.centroid, 1.0]) / own[0])
        depth = float(transform(inverse(last.T_base_cam), point)[2])
        self._state = calibrating_filter.begun_again(
            self._state, self._last, depth, own[1] / own[0] ** 2, self._settings
        )

    def fixation(self, T_base_cam: FloatArray, seen: Segmentation | None) -> Fixation:
        """What is known of the target."""
        state, settings = self._state, self._settings
        prior = DistanceSettings(settings.initial_distance_m, settings.initial_relative_std)
        if state is None or self._last is None:
            return described(None, T_base_cam, seen, prior)
        point = DistanceState(state.T_base_anchor, state.mean[:3], state.cov[:3, :3], state.nis)
        now = calibrating_filter.distance_at(state, replace(self._last, T_base_cam=T_base_cam))
        return replace(
            described(point, T_base_cam, seen, prior),
            distance_m=now.robot,
            distance_std_m=now.robot_std,
            lens=(now.lens, now.lens_std),
        )

    @property
    def calibration(self) -> Calibration | None:
        """What was learnt so far; None before the target was seen."""
        state = self._state
        if state is None:
            return None
        mean, stds = state.mean, np.sqrt(np.diag(state.cov))
        misfit = state.past + state.present
        return Calibration(
            mean[TRANSLATION],
            stds[TRANSLATION],
            mean[ROTATION],
            stds[ROTATION],
            float(mean[AGE]),
            float(stds[AGE]),
            float(mean[FOCAL]),
            float(stds[FOCAL]),
            math.sqrt(misfit.nis / misfit.dof) if misfit.dof else math.nan,
            misfit.dof,
            state.restarts,
        )

    def _with_central_twist(self, frame: Frame) -> CalibratingState | None:
        """The state, with the last frame's twist from the poses on both sides of it.

        A twist from the pose before shares that frame's noise, and noise would look like an offset of half a period.
        """
        state, before, earlier = self._state, self._before, self._earlier
        if state is None or before is None or earlier is None or before.rig is not None:
            return state
        if not before.segmentation.visible or frame.time - earlier.time > 2.0 * MAX_GAP_S:
            return state
        twist = mean_twist(earlier.T_base_cam, frame.T_base_cam, frame.time - earlier.time)
        return calibrating_filter.with_last_twist(state, twist)

    def _point(self, state: CalibratingState) -> FloatArray:
        """The target in base, shape (3,), m."""
        return transform(state.T_base_anchor, np.array([*state.mean[:2], 1.0]) / state.mean[2])

    def _sighting(self, frame: Frame, dt: float, slid: float) -> Sighting:
        """A frame as the filter takes it."""
        # Across a gap the mean motion is none that the camera had when the picture was taken.
        twist = frame.camera_twist if dt <= MAX_GAP_S else np.zeros(6)
        sighting = sighting_of(frame.T_base_cam, twist, frame.segmentation, self._settings, slid)
        if frame.rig is None:
            return sighting
        return replace(sighting, pose_cov=frame.rig.pose_cov, centroid_std=None)


def sighting_of(
    T_base_cam: FloatArray, twist: FloatArray, seen: Segmentation, settings: CalibratingSettings, slid: float = 0.0
) -> Sighting:
    """What a picture tells the calibrating filter.

    Args:
        T_base_cam: pose of the camera, shape (4, 4).
        twist: its twist [v, w] in the camera frame, shape (6,); zeros where it rests or nobody knows.
        seen: the target in the picture.
        settings: with the noise.
        slid: standard deviation of the slide of the centroid since the picture before, normalised coordinates.
    """
    pose_cov = np.diag(np.square([settings.position_std_m] * 3 + [settings.rotation_std_rad] * 3))
    if not seen.visible:
        return Sighting(T_base_cam, pose_cov, twist, None)
    size, std = size_of(seen), seen.centroid_std
    if std is None and (seen.touches_border or slid):
        share = _BORDER_STD_SIZE if seen.touches_border else settings.centroid_std_size
        std = math.hypot(settings.centroid_std, share * size, slid)
    return Sighting(T_base_cam, pose_cov, twist, seen.centroid, size, std)
