"""The distance of the target from frame to frame: by poses and centroids, or by the fixation constraint alone."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fixation_gym.geometry.rigid import cross, inverse, transform
from fixation_gym.perception.detection.segmentation import Segmentation
from fixation_gym.perception.distance import fixation_constraint
from fixation_gym.perception.distance import pose_filter as distance
from fixation_gym.perception.distance.covering import slide
from fixation_gym.perception.distance.fixation_constraint import ConstrainedGaze, ConstraintSettings
from fixation_gym.perception.distance.flow_filters import FlowSamples
from fixation_gym.perception.distance.flow_samples import FlowName
from fixation_gym.perception.distance.pose_filter import DistanceSettings, DistanceState
from fixation_gym.perception.distance.target_motion import InverseDepth
from fixation_gym.perception.flow.rolling_shutter import RowMotion
from fixation_gym.perception.scratch import Float32Array
from fixation_gym.types import FloatArray

_COVERING = 0.05
"""Something covers or uncovers the target if its centroid may slide by this share of its size in a frame."""


@dataclass(frozen=True, slots=True, eq=False)
class RigMeasurement:
    """What a rig knows of a frame besides: its noise in the arm's posture, and flow that was sampled in advance."""

    pose_cov: FloatArray
    """Covariance of the pose's noise [translation, rotation vector] in ``cam``, shape (6, 6)."""
    twist_cov: FloatArray
    """Covariance of the measured twist, shape (6, 6)."""
    flow: Mapping[FlowName, FlowSamples] | None
    """Flow on the target at the time of the frame before, by several methods; None where there is none."""


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One observation as far as later ones need it."""

    time: float
    """s."""
    grey: Float32Array
    """Image at the working size, shape (h, w)."""
    T_base_cam: FloatArray
    """Camera pose in base, shape (4, 4)."""
    camera_twist: FloatArray
    """Measured twist [v, w] in ``cam``, shape (6,), m/s and rad/s."""
    segmentation: Segmentation
    """Target in the image."""
    rig: RigMeasurement | None = None
    """What a rig knows besides; None on a robot."""
    depth: FloatArray | None = None
    """What a depth camera says, any size of the same view, m; None without one."""
    rows: RowMotion | None = None
    """How the camera moved from row to row of a rolling shutter; None: as far as the poses of three frames tell."""


def follow_poses(
    state: DistanceState | None, before: Frame | None, now: Frame, settings: DistanceSettings
) -> tuple[DistanceState | None, bool]:
    """Advance the distance by a frame's pose and centroid.

    Args:
        state: estimate before; None before the target was seen for the first time.
        before: the frame before; None for the first one.
        now: this frame.
        settings: of the filter.

    Returns:
        The estimate, and whether something is covering or uncovering the target.
    """
    seen, T_base_cam, covering = now.segmentation, now.T_base_cam, False
    if state is not None and before is not None:
        depth, _, point = distance.distance_at(state, T_base_cam, settings)
        slid = slide_of(point, before, now)
        dt = now.time - before.time
        covering = is_covering(before, now, slid)
        state = distance.predict(state, dt, settings, seen.visible, slid * depth)
    if not seen.visible:
        return state, covering
    if state is None:
        return distance.initialise(seen.centroid, T_base_cam, settings, *_noise(seen)), covering
    return distance.update(state, seen.centroid, T_base_cam, settings, *_noise(seen)), covering


def slide_of(point: FloatArray, before: Frame, now: Frame) -> float:
    """Standard deviation of the slide of the centroid since the frame before, normalised coordinates.

    A point that a detector follows does not slide.

    Args:
        point: the target in base, shape (3,), m.
        before: the frame before.
        now: this frame.
    """
    if now.segmentation.centroid_std is not None:
        return 0.0
    was, is_ = (point - frame.T_base_cam[:3, 3] for frame in (before, now))
    lengths = math.sqrt(was @ was), math.sqrt(is_ @ is_)
    turned = float(np.linalg.norm(cross(was, is_))) / (lengths[0] * lengths[1])
    return slide(before.segmentation, now.segmentation, lengths[0] / lengths[1], turned, now.time - before.time)


def is_covering(before: Frame, now: Frame, slid: float) -> bool:
    """Whether something covers or uncovers the target, by the slide of its centroid since the frame before."""
    return now.segmentation.visible and (
        not before.segmentation.visible or slid > _COVERING * size_of(now.segmentation)
    )


def follow_constraint(
    state: DistanceState | None,
    gaze: ConstrainedGaze | None,
    before: Frame | None,
    now: Frame,
    settings: DistanceSettings,
    constraint: ConstraintSettings,
) -> tuple[DistanceState | None, ConstrainedGaze | None]:
    """Advance the distance by the fixation constraint; arguments as in ``follow_poses``, and the constraint's own.

    While the target is hidden, its point in space is kept as it is with poses.
    """
    seen, T_base_cam = now.segmentation, now.T_base_cam
    dt = 0.0 if before is None else now.time - before.time
    if not seen.visible:
        return None if state is None else distance.predict(state, dt, settings, visible=False), None
    known = state or distance.initialise(seen.centroid, T_base_cam, settings)
    depth, std, _ = distance.distance_at(known, T_base_cam, settings)
    gaze = fixation_constraint.advance(gaze, seen.centroid, now.camera_twist, dt, (depth, std), constraint)
    if fixation_constraint.too_far(gaze, constraint):
        return distance.initialise(seen.centroid, T_base_cam, settings), None
    return fixation_constraint.anchored(gaze, T_base_cam, settings), gaze


def begun_again(own: InverseDepth, middle: Frame, last: Frame, settings: DistanceSettings) -> DistanceState:
    """The pose filter begun again in the last frame, with the target's inverse depth in the middle one."""
    depth = 1.0 / own[0]
    point = transform(middle.T_base_cam, depth * np.array([*middle.segmentation.centroid, 1.0]))
    now = float(transform(inverse(last.T_base_cam), point)[2])
    seen, std = last.segmentation, own[1] * depth**2
    return distance.restart(seen.centroid, last.T_base_cam, now, std, settings, *_noise(seen))


def size_of(seen: Segmentation) -> float:
    """Standard deviation of the target's pixels about their centroid, normalised coordinates."""
    return math.sqrt(mean_variance(seen))


def _noise(seen: Segmentation) -> tuple[float, bool, float | None]:
    """What the noise of the centroid depends on, as the filter takes it."""
    return size_of(seen), seen.touches_border, seen.centroid_std


def mean_variance(seen: Segmentation) -> float:
    """Of the target's pixels about their centroid, normalised coordinates."""
    return 0.5 * float(seen.second_moments[0, 0] + seen.second_moments[1, 1])
