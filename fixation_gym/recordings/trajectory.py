"""Camera poses over time: quaternions in either order, and the pose at the time of a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from fixation_gym.errors import UsageError
from fixation_gym.recordings.tables import Row, has_header, read_plain, read_table
from fixation_gym.types import FloatArray

QuaternionOrder = Literal["wxyz", "xyzw"]
POSE_COLUMNS = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")
TIME_COLUMN = "time_s"
MAX_GAP_S = 0.1
"""Between poses farther apart than this none is made up, s."""
_NORM_TOLERANCE = 0.05
"""A quaternion is longer or shorter than 1 by this at most: more, and it is something else."""


def pose_of(numbers: Sequence[float], place: str, order: QuaternionOrder = "wxyz") -> FloatArray:
    """Position and quaternion as a pose, shape (7,), quaternion (w, x, y, z), as it came but for its order.

    Args:
        numbers: x, y, z in m and the four of the quaternion.
        place: where they stand, for the message.
        order: of the quaternion.

    Raises:
        UsageError: if the quaternion has not about length 1.
    """
    x, y, z, *quaternion = numbers
    norm = float(np.linalg.norm(quaternion))
    if abs(norm - 1.0) > _NORM_TOLERANCE:
        raise UsageError(f"{place}: the quaternion {quaternion} has length {norm:.3g} instead of 1")
    if order == "xyzw":
        quaternion = [quaternion[3], *quaternion[:3]]
    return np.array([x, y, z, *quaternion])


class Trajectory:
    """Poses at known times; nothing changes after it was made."""

    def __init__(self, times: Sequence[float], poses: Sequence[FloatArray], max_gap_s: float = MAX_GAP_S) -> None:
        """Sort poses by time; of several at one time the first counts.

        Args:
            times: s.
            poses: shape (7,) each, position in m, quaternion (w, x, y, z); at least one.
            max_gap_s: between poses farther apart than this none is made up, s.
        """
        self._times, first = np.unique(np.asarray(times, np.float64), return_index=True)
        self._poses, self._max_gap_s = np.asarray(poses, np.float64)[first], max_gap_s

    def at(self, time: float) -> FloatArray | None:
        """The pose at a time, on the straight way between its neighbours, shape (7,); None if they are not close."""
        times, poses = self._times, self._poses
        after = int(np.searchsorted(times, time))
        if after < len(times) and times[after] == time:
            return poses[after]
        if after in (0, len(times)) or times[after] - times[after - 1] > self._max_gap_s:
            return None
        pair = slice(after - 1, after + 1)
        share = (time - times[after - 1]) / (times[after] - times[after - 1])
        position = (1.0 - share) * poses[after - 1, :3] + share * poses[after, :3]
        turn = Slerp([0.0, 1.0], Rotation.from_quat(poses[pair][:, [4, 5, 6, 3]]))([share])
        x, y, z, w = turn.as_quat()[0].tolist()
        return np.array([*position, w, x, y, z])


def read_trajectory(path: Path, order: QuaternionOrder | None) -> Trajectory:
    """Poses from a CSV with the columns of ``frames.csv``, or lines of eight numbers without names.

    Args:
        path: of the file.
        order: of the quaternions where columns have no names; must be None where they have.

    Raises:
        UsageError: if the file is bad, or the order is missing or given in vain.
    """
    if has_header(path):
        if order is not None:
            raise UsageError(f"{path} names its columns, so the order of quaternions is known; leave out --quaternion")
        rows, order = read_table(path, (TIME_COLUMN, *POSE_COLUMNS)), "wxyz"
        columns: tuple[str, ...] = POSE_COLUMNS
    elif order is None:
        raise UsageError(f"{path} does not name its columns; give --quaternion wxyz or --quaternion xyzw")
    else:
        columns = (*POSE_COLUMNS[:3], *(f"q{letter}" for letter in order))
        rows = read_plain(path, (TIME_COLUMN, *columns))
    return Trajectory([row.number(TIME_COLUMN) for row in rows], [_row_pose(row, columns, order) for row in rows])


def _row_pose(row: Row, columns: Sequence[str], order: QuaternionOrder) -> FloatArray:
    return pose_of([row.number(column) for column in columns], row.place, order)
