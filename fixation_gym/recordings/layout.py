"""The project's own layout: ``camera.json``, ``frames.csv``, perhaps ``target.json``; see docs/recordings.md."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from fixation_gym.errors import UsageError
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.recordings.camera_file import read_camera, read_json
from fixation_gym.recordings.options import ReaderOptions
from fixation_gym.recordings.pictures import read_depth, read_image, read_mask
from fixation_gym.recordings.recording import FrameList, RecordedFrame
from fixation_gym.recordings.tables import Row, read_table
from fixation_gym.recordings.trajectory import POSE_COLUMNS, TIME_COLUMN, pose_of
from fixation_gym.types import FloatArray

CAMERA_FILE, FRAMES_FILE, TARGET_FILE = "camera.json", "frames.csv", "target.json"
IMAGE_COLUMN, DEPTH_COLUMN, MASK_COLUMN, DISTANCE_COLUMN = "rgb", "depth", "mask", "distance_true_m"
JOINT_PREFIX = "joint_"
BOX_KEY = "first_frame_box_xywh"
DEPTH_UNIT_M = 1e-3


def read_layout(folder: Path, options: ReaderOptions) -> FrameList:
    """Read a folder of the project's own layout; ``options.camera`` replaces its camera.

    Raises:
        UsageError: naming file and column of what is wrong.
    """
    camera = read_camera(options.camera or folder / CAMERA_FILE)
    rows = read_table(folder / FRAMES_FILE, (TIME_COLUMN, *POSE_COLUMNS, IMAGE_COLUMN))
    joints = tuple(name for name in rows[0].cells if name.startswith(JOINT_PREFIX))
    return FrameList(camera, [_frame(folder, row, camera, joints) for row in rows], _target_box(folder / TARGET_FILE))


def _frame(folder: Path, row: Row, camera: Intrinsics, joints: tuple[str, ...]) -> RecordedFrame:
    pose, angles = row.numbers(POSE_COLUMNS), row.numbers(joints) if joints else None
    picture = row.cells[IMAGE_COLUMN]
    if not picture:
        raise UsageError(f"{row.place}, column '{IMAGE_COLUMN}' names no picture")
    mask, depth = row.cells.get(MASK_COLUMN), row.cells.get(DEPTH_COLUMN)
    return RecordedFrame(
        name=picture,
        time=row.number(TIME_COLUMN),
        image=partial(read_image, folder / picture, camera),
        camera_pose=None if pose is None else pose_of(pose, f"{row.place}, columns 'qw' to 'qz'"),
        joint_pos=None if angles is None else np.array(angles),
        mask=partial(read_mask, folder / mask, camera) if mask else None,
        depth=partial(read_depth, folder / depth, camera, DEPTH_UNIT_M) if depth else None,
        distance_true_m=row.number(DISTANCE_COLUMN) if row.cells.get(DISTANCE_COLUMN) else None,
    )


def _target_box(path: Path) -> FloatArray | None:
    if not path.exists():
        return None
    box = read_json(path).get(BOX_KEY)
    if not isinstance(box, list) or len(box) != 4 or not all(isinstance(value, (int, float)) for value in box):
        raise UsageError(f"{path} needs four numbers as '{BOX_KEY}', got {box!r}")
    return np.array(box, np.float64)
