"""The distance of the target from frame to frame: by poses and centroids, or by the fixation constraint alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fixation_gym.geometry.rigid import inverse, transform
from fixation_gym.perception import distance_filters as distance
from fixation_gym.perception import fixation_constraint
from fixation_gym.perception.covering import slide
from fixation_gym.perception.distance_filters import DistanceSettings, DistanceState
from fixation_gym.perception.fixation_constraint import ConstrainedGaze, ConstraintSettings
from fixation_gym.perception.scratch import Float32Array
from fixation_gym.perception.segmentation import Segmentation
from fixation_gym.perception.target_motion import InverseDepth
from fixation_gym.types import FloatArray


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


def follow_poses(
    state: DistanceState | None, before: Frame | None, now: Frame, settings: DistanceSettings
) -> DistanceState | None:
    """Advance the distance by a frame's pose and centroid.

    Args:
        state: estimate before; None before the target was seen for the first time.
        before: the frame before; None for the first one.
        now: this frame.
        settings: of the filter.
    """
    seen, T_base_cam = now.segmentation, now.T_base_cam
    if state is not None and before is not None:
        dt = now.time - before.time
        depths = [distance.distance_at(state, T, settings)[0] for T in (before.T_base_cam, T_base_cam)]
        slid = slide(before.segmentation, seen, depths[0] / depths[1], dt)
        state = distance.predict(state, dt, settings, seen.visible, slid)
    if not seen.visible:
        return state
    if state is None:
        return distance.initialise(seen.centroid, T_base_cam, settings)
    size = math.sqrt(mean_variance(seen))
    return distance.update(state, seen.centroid, T_base_cam, settings, size, seen.touches_border)


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


def mended(own: InverseDepth, middle: Frame, last: Frame, settings: DistanceSettings) -> DistanceState:
    """The pose filter begun anew in the last frame, with the target's inverse depth in the middle one."""
    depth = 1.0 / own[0]
    point = transform(middle.T_base_cam, depth * np.array([*middle.segmentation.centroid, 1.0]))
    now = float(transform(inverse(last.T_base_cam), point)[2])
    return distance.restart(last.segmentation.centroid, last.T_base_cam, now, own[1] * depth**2, settings)


def mean_variance(seen: Segmentation) -> float:
    """Of the target's pixels about their centroid, normalised coordinates."""
    return 0.5 * float(seen.second_moments[0, 0] + seen.second_moments[1, 1])
