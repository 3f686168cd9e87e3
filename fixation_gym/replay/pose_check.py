"""Do the poses of a recording explain what its pictures show? Tells quaternions in the wrong order, and poses inverted.

Corners are followed from one picture to a later one. With true poses each has an inverse depth, not negative, by which
the camera's motion explains where it went; what is left is noise. For poses read in another way far more is left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from fixation_gym.errors import UsageError
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import inverse, pose_to_matrix, rotation_vector
from fixation_gym.recordings.recording import RecordedFrame
from fixation_gym.types import FloatArray, ImageArray

_PAIRS = 8
_FIRST_FRAMES = 300
"""Pairs are taken from so many frames at the start: a long video need not be decoded twice."""
_LONGEST_STEP = 10
_LEAST_TURN_RAD, _LEAST_WAY_M = 0.02, 0.01
"""Between the pictures of a pair the camera turned or moved by this at least ..."""
_LARGEST_TURN_RAD, _LARGEST_WAY_M = 0.2, 0.1
"""... and by less than this, so that corners can be followed."""
_CORNERS, _LEAST_CORNERS = 200, 30
_NEAREST_M = 0.1
_BAD_PX = 2.0
"""Where more is left in the median, another reading is tried ..."""
_BETTER = 3.0
"""... and named if it leaves less than that, and so many times less."""

Reading = Callable[[FloatArray], FloatArray]
"""Makes T_base_cam, shape (4, 4), of a pose as it was read, shape (7,)."""


def _swapped(pose: FloatArray) -> FloatArray:
    return pose_to_matrix(pose[[0, 1, 2, 6, 3, 4, 5]])


def _inverted(pose: FloatArray) -> FloatArray:
    return inverse(pose_to_matrix(pose))


_OTHERS: dict[str, Reading] = {
    "with the four numbers of the quaternion as x, y, z, w they fit": _swapped,
    "inverted, as poses of the base in the camera, they fit": _inverted,
}


@dataclass(frozen=True, slots=True, eq=False)
class CornerPair:
    """Corners in two pictures, normalised coordinates, shape (n, 2) each, and times and poses of both."""

    before: FloatArray
    after: FloatArray
    times: tuple[float, float]
    poses: tuple[FloatArray, FloatArray]


def corner_pairs(
    frames: Sequence[RecordedFrame], camera: Intrinsics, straighten: Callable[[ImageArray], ImageArray]
) -> list[CornerPair]:
    """Corners that were followed between pictures; none where the camera hardly moved or pictures show nothing.

    Args:
        frames: in order, each with a pose.
        camera: pinhole.
        straighten: undistorts a picture.
    """
    return [pair for a, b in _chosen(frames) if (pair := _followed(a, b, camera, straighten)) is not None]


def check_poses(pairs: Sequence[CornerPair], camera: Intrinsics) -> float | None:
    """Check poses against pictures.

    Args:
        pairs: of corners.
        camera: pinhole.

    Returns:
        What the poses leave unexplained in the median, px; None without pairs.

    Raises:
        UsageError: if another reading of the poses explains the pictures far better, saying which.
    """
    if not pairs:
        return None
    left = _left(pairs, pose_to_matrix, camera)
    if left > _BAD_PX:
        for words, reading in _OTHERS.items():
            better = _left(pairs, reading, camera)
            if better < _BAD_PX and _BETTER * better < left:
                raise UsageError(
                    f"the camera poses contradict the pictures ({left:.1f} px are left unexplained); {words} "
                    f"({better:.1f} px)"
                )
    return left


def _chosen(frames: Sequence[RecordedFrame]) -> list[tuple[RecordedFrame, RecordedFrame]]:
    """Pairs of frames between which the camera moved, one after the other."""
    pairs = []
    frames = frames[:_FIRST_FRAMES]
    start, stride = 0, max(1, len(frames) // _PAIRS)
    while start < len(frames) - 1 and len(pairs) < _PAIRS:
        end = next(
            (
                k
                for k in range(start + 1, min(start + 1 + _LONGEST_STEP, len(frames)))
                if _moved(frames[start], frames[k])
            ),
            None,
        )
        if end is not None:
            pairs.append((frames[start], frames[end]))
        start = max(start + stride, end or 0)
    return pairs


def _moved(a: RecordedFrame, b: RecordedFrame) -> bool:
    T_a_b = inverse(_pose(a)) @ _pose(b)
    turn, way = float(np.linalg.norm(rotation_vector(T_a_b[:3, :3]))), float(np.linalg.norm(T_a_b[:3, 3]))
    far_enough = turn > _LEAST_TURN_RAD or way > _LEAST_WAY_M
    return far_enough and turn < _LARGEST_TURN_RAD and way < _LARGEST_WAY_M


def _pose(frame: RecordedFrame) -> FloatArray:
    assert frame.camera_pose is not None
    return pose_to_matrix(frame.camera_pose)


def _followed(
    a: RecordedFrame, b: RecordedFrame, camera: Intrinsics, straighten: Callable[[ImageArray], ImageArray]
) -> CornerPair | None:
    """Corners that are found again, forward and back; None if there are few."""
    try:
        first, second = (_grey(straighten(frame.image())) for frame in (a, b))
    except UsageError:  # who perceives this picture says so, after those before it
        return None
    corners = cv2.goodFeaturesToTrack(first, _CORNERS, 0.01, 8.0)
    if corners is None or a.camera_pose is None or b.camera_pose is None:
        return None
    moved, found, _ = cv2.calcOpticalFlowPyrLK(first, second, corners, None)  # pyright: ignore[reportCallIssue, reportArgumentType]
    back, found_back, _ = cv2.calcOpticalFlowPyrLK(second, first, moved, None)  # pyright: ignore[reportCallIssue, reportArgumentType]
    same = (np.abs(back - corners).max(axis=(1, 2)) < 1.0) & (found[:, 0] > 0) & (found_back[:, 0] > 0)
    if np.count_nonzero(same) < _LEAST_CORNERS:
        return None
    before, after = (camera.normalise(points[same, 0]) for points in (corners, moved))
    return CornerPair(before, after, (a.time, b.time), (a.camera_pose, b.camera_pose))


def _grey(image: ImageArray) -> ImageArray:
    return image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)


def _left(pairs: Sequence[CornerPair], reading: Reading, camera: Intrinsics) -> float:
    """Median over all corners of what a reading of the poses leaves unexplained, px."""
    left = [unexplained(pair, *map(reading, pair.poses)) for pair in pairs]
    return camera.fx * float(np.median(np.concatenate(left)))


def unexplained(pair: CornerPair, T_base_before: FloatArray, T_base_after: FloatArray) -> FloatArray:
    """Distance of every corner from where the motion can have taken it, normalised coordinates, shape (n,).

    With inverse depth d a corner x goes to the image of R [x, 1] + d t: a way that begins at d = 0, the pure turn, and
    ends at the depth of the nearest thing. Distances are to the straight line between the two.

    Args:
        pair: of pictures.
        T_base_before: pose of the camera at the first, shape (4, 4).
        T_base_after: pose at the second, shape (4, 4).
    """
    T_after_before = inverse(T_base_after) @ T_base_before
    rays = np.column_stack([pair.before, np.ones(len(pair.before))]) @ T_after_before[:3, :3].T
    ends = []
    for inverse_depth in (0.0, 1.0 / _NEAREST_M):
        points = rays + inverse_depth * T_after_before[:3, 3]
        ends.append(points[:, :2] / np.maximum(points[:, 2:], 1e-2))
    start, way = ends[0], ends[1] - ends[0]
    offset = pair.after - start
    share = np.clip((offset * way).sum(axis=1) / np.maximum((way * way).sum(axis=1), 1e-12), 0.0, 1.0)
    return np.linalg.norm(offset - share[:, None] * way, axis=1)
