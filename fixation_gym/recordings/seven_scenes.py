"""7-Scenes (Shotton et al., CVPR 2013): ``frame-000000.color.png``, ``.depth.png`` and ``.pose.txt`` in a folder.

A pose is the 4 x 4 matrix from camera to world. There are no times: 30 pictures per second. Depth is in mm; in the data
set as it is published it is that of the depth camera 2.5 cm beside, so that it is good to a few px only.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from fixation_gym.errors import UsageError
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import matrix_to_pose
from fixation_gym.recordings.camera_file import read_camera
from fixation_gym.recordings.options import ReaderOptions
from fixation_gym.recordings.pictures import read_depth, read_image
from fixation_gym.recordings.recording import FrameList, RecordedFrame
from fixation_gym.types import FloatArray

PICTURES = "frame-*.color.png"
CAMERA = Intrinsics(640, 480, 585.0, 585.0, 320.0, 240.0)
"""What the data set's page gives."""
_PERIOD_S = 1.0 / 30.0
_DEPTH_UNIT_M, _NO_DEPTH = 1e-3, (0, 65535)
_RIGID = 1e-2
"""A rotation's product with its transpose differs from the unit matrix by this at most."""


def read_seven_scenes(folder: Path, options: ReaderOptions) -> FrameList:
    """Read a sequence of 7-Scenes; without ``options.camera`` it is the data set's.

    Raises:
        UsageError: naming the file that is wrong.
    """
    camera = CAMERA if options.camera is None else read_camera(options.camera)
    pictures = sorted(folder.glob(PICTURES))
    if not pictures:
        raise UsageError(f"{folder} has no pictures {PICTURES}")
    return FrameList(camera, [_frame(path, camera) for path in pictures])


def _frame(path: Path, camera: Intrinsics) -> RecordedFrame:
    stem = path.name.removesuffix(".color.png")
    number = stem.removeprefix("frame-")
    if not number.isdigit():
        raise UsageError(f"{path}: its name must be frame-, a number, and .color.png")
    depth, pose = path.with_name(f"{stem}.depth.png"), path.with_name(f"{stem}.pose.txt")
    return RecordedFrame(
        name=path.name,
        time=int(number) * _PERIOD_S,
        image=partial(read_image, path, camera),
        camera_pose=_pose(pose) if pose.exists() else None,
        depth=partial(read_depth, depth, camera, _DEPTH_UNIT_M, _NO_DEPTH) if depth.exists() else None,
    )


def _pose(path: Path) -> FloatArray | None:
    """The pose in a file; None where its numbers are not finite, as the data set marks a lost track."""
    try:
        matrix = np.array(path.read_text(encoding="utf-8").split(), np.float64).reshape(4, 4)
    except (OSError, ValueError):
        raise UsageError(f"{path} must hold the 16 numbers of a 4 x 4 matrix") from None
    if not np.isfinite(matrix).all():
        return None
    rotation = matrix[:3, :3]
    if np.abs(rotation @ rotation.T - np.eye(3)).max() > _RIGID or np.linalg.det(rotation) < 0.0:
        raise UsageError(f"{path}: the upper left 3 x 3 numbers are no rotation")
    return matrix_to_pose(matrix)
