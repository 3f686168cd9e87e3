"""Pictures and poses of different times: the pose that belongs to a picture, and what it says about now.

A picture is there some time after it was taken. What perception makes of it must be made with the pose of that time,
between the readings before and after; and where the target is in the camera now follows from how the camera moved
since. All of it by stamps: nothing is estimated here.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fixation_gym.geometry.rigid import inverse, matrix_to_pose, pose_to_matrix, transform
from fixation_gym.geometry.twist import exp_twist, mean_twist
from fixation_gym.perception.distance.pose_filter import Fixation
from fixation_gym.perception.flow.rolling_shutter import RowMotion, row_motion
from fixation_gym.perception.percept import Percept
from fixation_gym.types import FloatArray, Observation

_KEPT_S = 0.5
"""How long readings are kept, s: the pose of an older picture would be a guess."""
_ROUNDING_S = 1e-3
"""A last row that is read out now may seem later by this, by stamps of 32 bits, s."""
_STALE_S = 0.3
"""A picture older than this says nothing about whether the target is seen now, s."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseHistory:
    """Readings of the last moments, in order."""

    times: tuple[float, ...] = ()
    """s."""
    poses: tuple[FloatArray, ...] = ()
    """T_base_cam, each of shape (4, 4)."""
    twists: tuple[FloatArray, ...] = ()
    """Measured camera twists, each of shape (6,)."""

    def with_reading(self, observation: Observation) -> PoseHistory:
        """The history with a reading that is later than all others.

        Raises:
            ValueError: if it is not.
        """
        if self.times and not observation.time > self.times[-1]:
            raise ValueError(
                f"time must increase: got {observation.time} s after {self.times[-1]} s; call reset() first"
            )
        first = bisect_right(self.times, observation.time - _KEPT_S)
        return PoseHistory(
            (*self.times[first:], observation.time),
            (*self.poses[first:], pose_to_matrix(observation.camera_pose)),
            (*self.twists[first:], observation.camera_twist),
        )

    def at(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Pose, shape (4, 4), and twist, shape (6,), at a time: ``between`` two readings, else of the nearest.

        Raises:
            IndexError: without a reading.
        """
        after = bisect_right(self.times, time)
        if after == 0 or after == len(self.times):
            nearest = min(after, len(self.times) - 1)
            return self.poses[nearest], self.twists[nearest]
        duration = self.times[after] - self.times[after - 1]
        share = (time - self.times[after - 1]) / duration
        before = slice(after - 1, after + 1)
        first, second = self.twists[before]
        return between(self.poses[before], (first, second), duration, share), (1.0 - share) * first + share * second

    def row_motion(self, time: float, readout_s: float) -> RowMotion | None:
        """Motion while a picture with a rolling shutter was read out, by the readings around its rows.

        Args:
            time: of the middle row, s.
            readout_s: from the first row to the last, s.

        Returns:
            The motion; None if there is no shutter, or the rows were not all exposed between readings.
        """
        half = 0.5 * readout_s
        if not readout_s or not self.times or time - half < self.times[0] or time + half > self.times[-1] + _ROUNDING_S:
            return None
        return row_motion([self.at(time + late)[0] for late in (-half, 0.0, half)], half)


def between(poses: Sequence[FloatArray], twists: Sequence[FloatArray], duration: float, share: float) -> FloatArray:
    """Pose between two readings, by the cubic that has their poses and twists (Hermite, in the frame of the first).

    An arm speeds up and slows down between readings. Constant motion would miss that: at the servo's pace by 0.15 mm
    and 0.4 mrad from one picture to the next, eight times as much as joint readings do.

    Args:
        poses: T_base_cam of both, each of shape (4, 4).
        twists: measured camera twists of both, each of shape (6,); NaN: constant motion is all that is known.
        duration: from one to the other, s.
        share: of it that has passed, 0..1.

    Returns:
        T_base_cam, shape (4, 4).
    """
    mean = mean_twist(poses[0], poses[1], duration)
    motion = share * mean
    if not any(math.isnan(twist[0]) for twist in twists):
        # What the speeds at both ends add to the motion at the mean one. A twist at the end is one in the frame of
        # that end, which is that of the first to first order: a few hundredths of a radian.
        left = 1.0 - share
        motion = motion + share * left * (left * (twists[0] - mean) - share * (twists[1] - mean))
    return poses[0] @ exp_twist(motion, duration)


def at_the_picture(observation: Observation, history: PoseHistory) -> Observation:
    """An observation as it would have been when its picture was taken; joints stay those of now."""
    assert observation.image_time is not None
    pose, twist = history.at(observation.image_time)
    return replace(observation, time=observation.image_time, camera_pose=matrix_to_pose(pose), camera_twist=twist)


def carried(percept: Percept, observation: Observation, history: PoseHistory) -> Percept:
    """What was perceived in a picture, as of an observation after it: only the fixation is of now.

    A target seen in a picture that is too old is not seen any more.

    Args:
        percept: of the picture; its time is the picture's.
        observation: now.
        history: of the poses, with both.
    """
    (then, _), (now, _) = history.at(percept.time), history.at(observation.time)
    fixation = seen_from(percept.fixation, then, now)
    visible = fixation.visible and observation.time - percept.time < _STALE_S
    return replace(percept, time=observation.time, fixation=replace(fixation, visible=visible))


def seen_from(fixation: Fixation, T_base_then: FloatArray, T_base_now: FloatArray) -> Fixation:
    """What is known of the target in the camera of now, by how that moved since the picture.

    Args:
        fixation: at the picture.
        T_base_then: camera pose at the picture, shape (4, 4).
        T_base_now: camera pose now, shape (4, 4).
    """
    T_now_then = inverse(T_base_now) @ T_base_then
    seen = transform(T_now_then, fixation.distance_m * np.array([*fixation.centroid, 1.0]))
    if not fixation.initialised or seen[2] <= 0.0:
        return fixation
    # The centroid is carried along as it was seen, not replaced by what the filter expects.
    return replace(fixation, centroid=seen[:2] / seen[2], distance_m=float(seen[2]))
