"""Are poses late or early against pictures? The offset that explains best how corners moved; and poses put right.

Two clocks, or a pose that is read a frame too late, are no noise: everything is wrong by its speed. Where the motion
changes within a pair of pictures, the poses of another moment explain the corners better or worse.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import matrix_to_pose, pose_to_matrix
from fixation_gym.geometry.twist import exp_twist, mean_twist
from fixation_gym.recordings.recording import RecordedFrame
from fixation_gym.recordings.stamps import OrderedFrames
from fixation_gym.recordings.trajectory import Trajectory
from fixation_gym.replay.pose_check import CornerPair, unexplained
from fixation_gym.types import FloatArray

_STEP_S = 0.004
_OFFSETS_S = _STEP_S * np.arange(-25, 26)
"""Offsets that are tried, s; the best is refined between its neighbours."""
_LARGEST_PX = 5.0
"""Corners that are farther off were lost: they count like this."""
_LEAST_PAIRS = 4
_MAX_GAP_S = 0.15
"""Between poses farther apart than this none is made up, s."""
_MADE_UP = 1.3
"""Periods beyond the ends for which a pose is made up."""
_SURE, _LEAST_S = 3.0, 3e-3
"""An offset counts from so many standard deviations on, and from this size, s ..."""
_LEFT_SHARE = 0.5
"""... if it leaves at most this share of the squares."""


@dataclass(frozen=True, slots=True)
class TimeOffset:
    """By how much poses come late."""

    offset_s: float
    """The pose of a picture has a stamp that is later by this; below 0 it is earlier."""
    std_s: float
    """By leaving out one pair of pictures after the other."""
    counts: bool
    """Whether it is surely there. Never one at the end of what is tried: it may be any larger one."""


def time_offset(frames: Sequence[RecordedFrame], pairs: Sequence[CornerPair], camera: Intrinsics) -> TimeOffset | None:
    """How late the poses of a recording are; None where too few pictures tell.

    Args:
        frames: in order, each with a pose.
        pairs: corners that were followed between some of them.
        camera: pinhole.
    """
    poses = Trajectory([frame.time for frame in frames], [_pose(frame) for frame in frames], _MAX_GAP_S)
    rows = [row for pair in pairs if (row := _squares(pair, poses, camera)) is not None]
    if len(rows) < _LEAST_PAIRS:
        return None
    squares = np.array(rows)
    mean = squares.mean(axis=0)
    best = _best(mean)
    others = [_best(np.delete(squares, k, axis=0).mean(axis=0)) for k in range(len(squares))]
    std = float(np.sqrt((len(others) - 1) * np.var(others)))  # the jackknife's
    sure = abs(best) > max(_SURE * std, _LEAST_S) and mean.min() < _LEFT_SHARE * mean[len(_OFFSETS_S) // 2]
    inside = 0 < int(np.argmin(mean)) < len(_OFFSETS_S) - 1
    return TimeOffset(best, std, bool(sure and inside))


def put_right(ordered: OrderedFrames, offset_s: float) -> OrderedFrames:
    """Frames with the poses of their own moments.

    Across gaps, where none is known, a frame keeps the one it had. At the ends a pose is made up for a frame, as if the
    motion went on; those farther out have none and are left out.

    Args:
        ordered: frames.
        offset_s: how late their poses are.
    """
    frames = ordered.frames
    if len(frames) < 2:
        return ordered
    times, poses = [frame.time for frame in frames], [_pose(frame) for frame in frames]
    first, second, last_but_one, last = (pose_to_matrix(poses[k]) for k in (0, 1, -2, -1))
    begun, ended = times[1] - times[0], times[-1] - times[-2]
    start, end = times[0] - _MADE_UP * begun, times[-1] + _MADE_UP * ended
    before = first @ exp_twist(mean_twist(first, second, begun), start - times[0])
    after = last @ exp_twist(mean_twist(last_but_one, last, ended), end - times[-1])
    trajectory = Trajectory([start, *times, end], [matrix_to_pose(before), *poses, matrix_to_pose(after)], _MAX_GAP_S)
    kept = [frame for frame in frames if start <= frame.time + offset_s <= end]
    moved = [(frame, trajectory.at(frame.time + offset_s)) for frame in kept]
    right = [frame if pose is None else replace(frame, camera_pose=pose) for frame, pose in moved]
    return replace(ordered, frames=right, without_pose=ordered.without_pose + len(frames) - len(kept))


def _pose(frame: RecordedFrame) -> FloatArray:
    assert frame.camera_pose is not None, "every frame has a pose"
    return frame.camera_pose


def _squares(pair: CornerPair, poses: Trajectory, camera: Intrinsics) -> FloatArray | None:
    """Mean square of what is left of a pair's corners with every offset, px^2, shape (n,); None if one is unknown."""
    squares = []
    for offset in _OFFSETS_S:
        moved = [poses.at(time + offset) for time in pair.times]
        if moved[0] is None or moved[1] is None:
            return None
        left = camera.fx * unexplained(pair, pose_to_matrix(moved[0]), pose_to_matrix(moved[1]))
        squares.append(np.mean(np.minimum(left, _LARGEST_PX) ** 2))
    return np.array(squares)


def _best(squares: FloatArray) -> float:
    """Offset that leaves least, s: the vertex of the parabola through the best one and its neighbours."""
    k = int(np.clip(np.argmin(squares), 1, len(squares) - 2))
    before, here, after = squares[k - 1 : k + 2]
    bend = before - 2.0 * here + after
    share = 0.0 if bend <= 0.0 else float(np.clip(0.5 * (before - after) / bend, -1.0, 1.0))
    return float(_OFFSETS_S[k] + share * _STEP_S)
