"""From observations to percepts: the only stateful part of perception."""

from __future__ import annotations

import math
from collections import deque
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import lru_cache

import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import inverse, pose_to_matrix
from fixation_gym.geometry.twist import mean_twist
from fixation_gym.perception.body.target_centre import TargetBody, with_outline
from fixation_gym.perception.body.upright_body import UprightBody
from fixation_gym.perception.detection.colour import ColourDetector, segment
from fixation_gym.perception.detection.detector import Detector, detected
from fixation_gym.perception.detection.tracking import Track, expected_at, followed
from fixation_gym.perception.distance.estimator import DistanceEstimator, PoseEstimator, inverse_distance
from fixation_gym.perception.distance.following import Frame
from fixation_gym.perception.distance.pose_filter import Fixation
from fixation_gym.perception.flow.gradients import FlowSettings
from fixation_gym.perception.flow.optic_flow import (
    Flow,
    estimate_flow,
    flow_grid,
    invalid_flow,
    plane_homography,
    prepare_grey,
)
from fixation_gym.perception.flow.rolling_shutter import RowMotion, row_maps, row_motions
from fixation_gym.perception.hand_eye.hand_eye import HandEye
from fixation_gym.perception.hand_eye.hand_eye_filter import HandEyeState
from fixation_gym.perception.pairing import PoseHistory, at_the_picture, carried
from fixation_gym.perception.percept import Percept
from fixation_gym.perception.rectification import Rectification, in_colour
from fixation_gym.perception.scratch import Scratch
from fixation_gym.perception.settings import PerceptionSettings
from fixation_gym.perception.zero_flow.pictures import Pictures
from fixation_gym.perception.zero_flow.zero_flow import (
    Gaze,
    ZeroFlow,
    ZeroFlowSettings,
    unknown_zero_flow,
    zero_flow_test,
)
from fixation_gym.strangers import whose_code
from fixation_gym.types import FloatArray, MaskArray, Observation

_STAMP_ROUNDING_S = 1e-3
"""Stamps of 32 bits may be rounded apart, s."""
_HIDDEN_S = 1.0
"""After this time out of sight the target's body may be anywhere, s."""


class Perception:
    """Follows the target's distance and tests what is in front of it, one observation at a time."""

    def __init__(
        self,
        intrinsics: Intrinsics,
        settings: PerceptionSettings | None = None,
        self_mask: MaskArray | None = None,
        support_height_m: float | None = None,
        detector: Detector | None = None,
        estimator: DistanceEstimator | None = None,
    ) -> None:
        """Prepare for a camera.

        Args:
            intrinsics: of the images to come; any size. With a lens, images are undistorted first: all that a percept
                says is about the pinhole's image, as detectors get it.
            settings: of every stage; None for the defaults.
            self_mask: pixels where the camera sees the robot itself, shape (H, W); never obstacles.
            support_height_m: height of the table in base, m; its surface is no obstacle. None: unknown.
            detector: says which pixels are the target; None: those of the colour in ``settings``.
            estimator: says how far the target is; None: poses and centroids, with ``settings.distance``.

        Raises:
            ValueError: if ``self_mask`` has not the size of the images.
        """
        import scipy.optimize  # noqa: F401  # half a second now, and not in the middle of an episode

        shape = (intrinsics.height, intrinsics.width)
        if self_mask is not None and self_mask.shape != shape:
            raise ValueError(f"self_mask has shape {self_mask.shape}, but the images are {shape}")
        self._settings = settings or PerceptionSettings()
        self._self_mask = None if self_mask is None else np.array(self_mask, dtype=np.bool_)
        self._rectification = None if intrinsics.lens is None else Rectification(intrinsics)
        if self._rectification is not None:
            intrinsics = intrinsics.pinhole
            self._self_mask = self._rectification.unseen(self._self_mask)
        self._intrinsics = intrinsics
        self.support_height_m = support_height_m
        self._detector: Detector = detector or ColourDetector(intrinsics, self._settings.colour)
        self._estimator: DistanceEstimator = estimator or PoseEstimator(self._settings.distance)
        self._hand_eye = HandEye(self._settings.hand_eye)
        self._working = intrinsics.halved(self._settings.flow.max_width)
        self._scratch = Scratch()
        _run_once()
        self.reset()

    def reset(self) -> None:
        """Forget everything seen."""
        self._detector.reset()
        self._poses = PoseHistory()
        self._hand_eye.reset()
        self._noise_share = 1.0
        self.forget_place()

    def forget_place(self) -> None:
        """Forget where the target is, but not what it looks like: it was pushed or dropped."""
        self._frames: deque[Frame] = deque(maxlen=3)
        self._estimator.reset()
        self._track: Track | None = None
        self._body = TargetBody()
        self._seen_time = -math.inf
        self._late: Percept | None = None

    @property
    def flow_intrinsics(self) -> Intrinsics:
        """Camera of the grid of flow and zero-flow test: half the image, or less if that is wider than 160 px."""
        return flow_grid(self._working)

    @property
    def hand_eye(self) -> HandEyeState | None:
        """What was learnt of the hand-eye error; None if it is not learnt."""
        return self._hand_eye.state

    def update(self, observation: Observation) -> Percept:
        """Take in one observation.

        An image that came late, by its ``image_time``, goes with the pose of that time. One that was there before adds
        nothing but how the camera moved since.

        Raises:
            ValueError: if the image has the wrong shape, the pose is not finite, or times do not increase. What was
                seen before stays as it was.
        """
        if observation.rgb.ndim == 2:
            observation = replace(observation, rgb=in_colour(observation.rgb))
        self._check(observation)
        taken = observation.image_time
        if taken is not None:
            self._poses = self._poses.with_reading(observation)
        if taken is None or taken == observation.time:
            return self._look(observation)
        if self._late is None or taken > self._late.time:
            rows = self._poses.row_motion(taken, self._intrinsics.readout_s)
            self._late = self._look(at_the_picture(observation, self._poses), rows)
        return carried(self._late, observation, self._poses)

    def _look(self, observation: Observation, rows: RowMotion | None = None) -> Percept:
        """Take in an observation all of whose values are of one time, but for what its rows saw of the motion."""
        if self._frames and not observation.time > self._frames[-1].time:
            last = self._frames[-1].time
            raise ValueError(f"time must increase: got {observation.time} s after {last} s; call reset() first")
        if self._rectification is not None:
            observation = self._rectification.observation(observation)
        T_base_cam = self._hand_eye.true_pose(pose_to_matrix(observation.camera_pose))
        expected = expected_at(self._track, T_base_cam, observation.time, self._settings.tracking)
        segmentation = detected(self._detector, observation, expected, self._intrinsics)
        grey = prepare_grey(observation.rgb, self._working.height, self._working.width)
        twist = self._twist(observation, T_base_cam)
        frame = Frame(observation.time, grey, T_base_cam, twist, segmentation, depth=observation.depth, rows=rows)
        with self._estimating():
            self._estimator.add_frame(frame)
        if self._frames and observation.time - self._frames[-1].time > self._settings.max_gap_s:
            self._frames.clear()
        self._frames.append(frame)
        flow = self._flow()
        zero_flow = self._look_for_obstacles(flow)
        with self._estimating():
            fixation = self._estimator.fixation(T_base_cam, segmentation)
        if segmentation.visible:
            self._track = followed(segmentation, fixation.distance_m, T_base_cam, observation.time)
        middle = self._frames[max(0, len(self._frames) - 2)]
        body = self._fit_body(frame, fixation)
        self._learn_hand_eye(flow, zero_flow, fixation)
        learnt = self.hand_eye
        return Percept(observation.time, segmentation, flow, zero_flow, fixation, middle.T_base_cam, body, learnt)

    def _learn_hand_eye(self, flow: Flow, zero_flow: ZeroFlow, fixation: Fixation) -> None:
        """Learn from how the support surface moves; what was learnt corrects the frames that are kept."""
        height = self.support_height_m
        if self.hand_eye is None or height is None or not flow.valid:
            return
        if not all(frame.segmentation.visible for frame in self._frames):
            return
        frames = self._hand_eye.learn(self._frames, flow, zero_flow.usable, height, fixation.distance_m)
        self._frames = deque(frames, maxlen=3)

    def _estimating(self) -> AbstractContextManager[str]:
        """Call the estimator, which may be somebody else's."""
        return whose_code("distance estimator", self._estimator)

    def _check(self, observation: Observation) -> None:
        expected = (self._intrinsics.height, self._intrinsics.width, 3)
        if observation.rgb.shape != expected or observation.rgb.dtype != np.uint8:
            found = f"{observation.rgb.dtype} of shape {observation.rgb.shape}"
            raise ValueError(f"rgb is {found}, but the intrinsics ask for uint8 of shape {expected}")
        pose = np.asarray(observation.camera_pose)
        if pose.shape != (7,) or not all(map(math.isfinite, pose.tolist())) or not any(pose[3:].tolist()):
            raise ValueError(f"camera_pose must be a finite position and quaternion (w, x, y, z), got {pose.tolist()}")
        taken = observation.image_time
        if taken is not None and not taken <= observation.time + _STAMP_ROUNDING_S:
            raise ValueError(f"image_time must not be later than time, {observation.time} s, got {taken} s")

    def _twist(self, observation: Observation, T_base_cam: FloatArray) -> FloatArray:
        """The measured twist, or else the mean one since the frame before; a camera is at rest before its first."""
        if not math.isnan(observation.camera_twist[0]):
            return self._hand_eye.true_twist(observation.camera_twist)
        if not self._frames:
            return np.zeros(6)
        before = self._frames[-1]
        return mean_twist(before.T_base_cam, T_base_cam, observation.time - before.time)

    def _fit_body(self, now: Frame, fixation: Fixation) -> UprightBody | None:
        """The target's body, with the outline of this frame."""
        settings, height = self._settings.centre, self.support_height_m
        if settings is None or height is None:
            return None
        seen, T_base_cam = now.segmentation, now.T_base_cam
        self._body = with_outline(self._body, seen, fixation, self._intrinsics, T_base_cam, height, settings)
        self._seen_time = now.time if seen.visible else self._seen_time
        hidden = now.time - self._seen_time > _HIDDEN_S
        return None if hidden else self._body.believed(T_base_cam, settings)

    def _flow(self) -> Flow:
        """Flow at the middle one of the last three frames."""
        if len(self._frames) < 3:
            return invalid_flow(self._frames[0].time, self._working)
        first, middle, last = self._frames
        with self._estimating():
            fixated, _ = inverse_distance(self._estimator, middle.T_base_cam)
        outer = (inverse(frame.T_base_cam) @ middle.T_base_cam for frame in (first, last))
        to_first, to_last = (plane_homography(T, fixated, self._working) for T in outer)
        times = [frame.time for frame in self._frames]
        rolling = None
        if self._working.readout_s > 0.0:
            poses = [frame.T_base_cam for frame in self._frames]
            by_poses = row_motions(poses, times)
            motions = [frame.rows or motion for frame, motion in zip(self._frames, by_poses, strict=True)]
            rolling = row_maps(poses, motions, fixated, self._working)
        flow = estimate_flow(
            [frame.grey for frame in self._frames],
            times,
            self._working,
            (to_first, to_last),
            fixated,
            self._settings.flow,
            self._scratch,
            rolling,
            self._noise_share,
        )
        self._noise_share = flow.noise_share
        return flow

    def _look_for_obstacles(self, flow: Flow) -> ZeroFlow:
        """Zero-flow test where the flow is, after the distance has heard of the flow."""
        shape = flow.overlap.shape
        if not flow.valid:
            return unknown_zero_flow(*shape)
        first, middle, last = self._frames
        if not (middle.segmentation.visible and last.segmentation.visible):
            return unknown_zero_flow(*shape)
        twist = mean_twist(first.T_base_cam, last.T_base_cam, last.time - first.time)
        with self._estimating():
            self._estimator.add_flow(flow, (first, middle, last))
            fixated = inverse_distance(self._estimator, middle.T_base_cam)
        gaze = Gaze(twist, *fixated, middle.segmentation.mask, middle.T_base_cam)
        settings, pictures = self._settings.zero_flow, _pictures((first, middle, last))
        return zero_flow_test(flow, gaze, settings, self._self_mask, self.support_height_m, pictures)


def _pictures(frames: tuple[Frame, Frame, Frame]) -> Pictures:
    """What front rules may look at of three frames."""
    first, middle, last = frames
    poses = first.T_base_cam, middle.T_base_cam, last.T_base_cam
    return Pictures((first.grey, middle.grey, last.grey), poses, middle.depth)


@lru_cache(maxsize=1)
def _run_once() -> None:
    """Run every stage on a small made-up scene, so that no frame of a live camera waits for compiled code to be made.

    It takes seconds on the first use after an installation, when nothing is cached on disk, and a fraction later.
    """
    camera = Intrinsics.from_fovy(96, 96, 0.7)
    rgb = np.random.default_rng(0).integers(0, 256, (96, 96, 3), dtype=np.uint8)
    rgb[40:56, 40:56] = 255, 0, 0
    seen = segment(rgb, camera)
    settings, maps = FlowSettings(), (np.eye(3), np.eye(3))
    frames = [prepare_grey(np.roll(rgb, shift, axis=1), 96, 96) for shift in range(3)]
    flow = estimate_flow(frames, (0.0, 1.0, 2.0), camera, maps, 1.0, settings)
    zero_flow_test(flow, Gaze(np.eye(6)[0], 1.0, 0.1, seen.mask, np.eye(4)), ZeroFlowSettings(), None, 0.0)
