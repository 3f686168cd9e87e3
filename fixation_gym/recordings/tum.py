"""TUM RGB-D (Sturm et al., IROS 2012): ``rgb.txt``, ``groundtruth.txt``, perhaps ``depth.txt``, times in s.

Poses are those of the colour camera's optical frame, tx ty tz qx qy qz qw; a picture gets the pose at its own time.
Depth pictures, of which a step is 0.2 mm, are in the view of the colour camera.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from fixation_gym.errors import UsageError
from fixation_gym.geometry.camera import Intrinsics, Lens
from fixation_gym.recordings.camera_file import read_camera
from fixation_gym.recordings.options import ReaderOptions
from fixation_gym.recordings.pictures import read_depth, read_image
from fixation_gym.recordings.recording import FrameList, RecordedFrame
from fixation_gym.recordings.tables import read_plain
from fixation_gym.recordings.trajectory import Trajectory, pose_of

RGB_FILE, DEPTH_FILE, POSES_FILE = "rgb.txt", "depth.txt", "groundtruth.txt"
_DEPTH_UNIT_M = 1.0 / 5000.0
_DEPTH_WITHIN_S = 0.02
"""A depth picture belongs to a picture that is no farther away than this, as in the benchmark's own tools."""
_POSE = ("tx", "ty", "tz", "qx", "qy", "qz", "qw")
_CAMERAS = {
    "freiburg1": Intrinsics(640, 480, 517.3, 516.5, 318.6, 255.3, Lens((0.2624, -0.9531, -0.0054, 0.0026, 1.1633))),
    "freiburg2": Intrinsics(640, 480, 520.9, 521.0, 325.1, 249.7, Lens((0.2312, -0.7849, -0.0033, -0.0001, 0.9172))),
    "freiburg3": Intrinsics(640, 480, 535.4, 539.2, 320.1, 247.6),
}
"""Cameras of the benchmark's sequences, as its page on file formats gives them, by a part of the folder's name."""


def read_tum(folder: Path, options: ReaderOptions) -> FrameList:
    """Read a sequence in the format of TUM RGB-D; without ``options.camera`` the folder's name tells the camera.

    Raises:
        UsageError: naming file and column of what is wrong.
    """
    camera = _camera(folder, options)
    rows = read_plain(folder / POSES_FILE, ("timestamp", *_POSE))
    poses = [pose_of([row.number(name) for name in _POSE], row.place, "xyzw") for row in rows]
    trajectory = Trajectory([row.number("timestamp") for row in rows], poses)
    depths = _stamped(folder / DEPTH_FILE) if (folder / DEPTH_FILE).exists() else []
    depth_times = np.array([time for time, _ in depths])
    frames = []
    for time, name in _stamped(folder / RGB_FILE):
        nearest = int(np.argmin(np.abs(depth_times - time))) if depths else -1
        close = bool(depths) and abs(depth_times[nearest] - time) <= _DEPTH_WITHIN_S
        depth = partial(read_depth, folder / depths[nearest][1], camera, _DEPTH_UNIT_M) if close else None
        image = partial(read_image, folder / name, camera)
        frames.append(RecordedFrame(name, time, image, trajectory.at(time), depth=depth))
    return FrameList(camera, frames)


def _stamped(path: Path) -> list[tuple[float, str]]:
    return [(row.number("timestamp"), row.cells["filename"]) for row in read_plain(path, ("timestamp", "filename"))]


def _camera(folder: Path, options: ReaderOptions) -> Intrinsics:
    if options.camera is not None:
        return read_camera(options.camera)
    for name, camera in _CAMERAS.items():
        if name in folder.resolve().name:
            return camera
    known = ", ".join(_CAMERAS)
    raise UsageError(f"{folder}: its camera is not known, since its name has none of {known} in it; give --camera FILE")
