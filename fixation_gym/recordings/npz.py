"""Arrays in one ``.npz``, as ``examples/03_recorded_frames.py`` saves them: a robot's observations in order."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fixation_gym.errors import UsageError
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.recordings.camera_file import read_camera
from fixation_gym.recordings.options import ReaderOptions
from fixation_gym.recordings.pictures import check_size
from fixation_gym.recordings.recording import FrameList, RecordedFrame
from fixation_gym.recordings.trajectory import pose_of
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, ImageArray

_NEEDED = ("time", "rgb", "camera_pose")
_POSE_SIZE, _BOX_SIZE = 7, 4


def read_npz(path: Path, options: ReaderOptions) -> FrameList:
    """Read observations; without ``options.camera`` they are of the simulated wrist camera.

    Raises:
        UsageError: naming the array that is missing or wrong.
    """
    arrays = _arrays(path)
    rgb, count = arrays["rgb"], len(arrays["rgb"])
    if rgb.dtype != np.uint8 or rgb.ndim not in (3, 4) or not rgb.size:
        raise UsageError(f"{path}: rgb must be uint8 of shape (n, H, W, 3) or (n, H, W), got {rgb.dtype} {rgb.shape}")
    times = _numbers(path, arrays, "time").reshape(-1)
    poses = _numbers(path, arrays, "camera_pose")
    if times.shape != (count,) or poses.shape != (count, _POSE_SIZE):
        raise UsageError(
            f"{path}: {count} pictures need time of shape ({count},) and camera_pose of shape ({count}, {_POSE_SIZE}), "
            f"got {times.shape} and {poses.shape}"
        )
    camera = Intrinsics.from_fovy(rgb.shape[1], rgb.shape[2], ROBOT.camera.fovy)
    camera = camera if options.camera is None else read_camera(options.camera)
    joints = _numbers(path, arrays, "joint_pos") if "joint_pos" in arrays else None
    return FrameList(
        camera,
        [
            RecordedFrame(
                name=f"{path.name}, picture {k}",
                time=float(times[k]),
                image=partial(_image, rgb[k], camera, f"{path}, picture {k},"),
                camera_pose=pose_of(poses[k].tolist(), f"{path}, camera_pose {k}"),
                joint_pos=None if joints is None else joints[k],
                mask=partial(np.asarray, arrays["mask"][k], np.bool_) if "mask" in arrays else None,
            )
            for k in range(count)
        ],
        _box(path, arrays),
    )


def _arrays(path: Path) -> Mapping[str, Any]:
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = dict(file)
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise UsageError(f"{path} cannot be read: {error}") from error
    missing = [name for name in _NEEDED if name not in arrays]
    if missing:
        raise UsageError(f"{path} has no array '{missing[0]}'; it needs {', '.join(_NEEDED)}")
    return arrays


def _numbers(path: Path, arrays: Mapping[str, Any], name: str) -> FloatArray:
    try:
        numbers = np.asarray(arrays[name], np.float64)
    except ValueError:
        raise UsageError(f"{path}: array '{name}' must hold numbers") from None
    if not np.isfinite(numbers).all():
        raise UsageError(f"{path}: array '{name}' has numbers that are not finite")
    return numbers


def _box(path: Path, arrays: Mapping[str, Any]) -> FloatArray | None:
    if "target_box" not in arrays:
        return None
    boxes = _numbers(path, arrays, "target_box").reshape(-1, _BOX_SIZE)
    return boxes[0] if boxes[0].any() else None  # zeros: the target was not in the picture


def _image(image: ImageArray, camera: Intrinsics, name: str) -> ImageArray:
    check_size(image, camera, name)
    return image
