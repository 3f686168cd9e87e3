"""Write the project's own layout; pictures at once, the tables that make a folder a recording at the end."""

from __future__ import annotations

import math
from pathlib import Path
from types import TracebackType
from typing import Any

import cv2
import numpy as np

from fixation_gym.evaluation.files import write_csv, write_file, write_json
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.scratch import Float32Array
from fixation_gym.recordings.camera_file import camera_values
from fixation_gym.recordings.layout import (
    BOX_KEY,
    CAMERA_FILE,
    DEPTH_COLUMN,
    DEPTH_UNIT_M,
    DISTANCE_COLUMN,
    FRAMES_FILE,
    IMAGE_COLUMN,
    JOINT_PREFIX,
    MASK_COLUMN,
    TARGET_FILE,
)
from fixation_gym.recordings.trajectory import POSE_COLUMNS, TIME_COLUMN
from fixation_gym.types import FloatArray, ImageArray, MaskArray


class LayoutWriter:
    """Writes one recording. Use as a context manager; after an exception the folder has pictures, but is none."""

    def __init__(self, folder: Path, camera: Intrinsics, notes: dict[str, Any], target_box: FloatArray | None) -> None:
        """Prepare a folder; it is made if needed.

        Args:
            folder: for the files.
            camera: of all pictures.
            notes: JSON-able, kept beside the camera: where pictures and poses come from.
            target_box: x, y, width, height around the target in the first picture, shape (4,), px; None: not known.
        """
        self._folder, self._camera, self._notes, self._box = folder, camera, notes, target_box
        self._rows: list[dict[str, Any]] = []

    def add(
        self,
        time: float,
        image: ImageArray,
        camera_pose: FloatArray,
        joint_pos: FloatArray,
        mask: MaskArray | None = None,
        depth: Float32Array | None = None,
        distance_true_m: float | None = None,
    ) -> None:
        """Append a frame; arguments as the fields of ``RecordedFrame``, loaded."""
        name = f"{len(self._rows):06d}.png"
        row: dict[str, Any] = {TIME_COLUMN: time, **dict(zip(POSE_COLUMNS, camera_pose.tolist(), strict=True))}
        row[IMAGE_COLUMN] = self._picture("rgb", name, image[..., ::-1] if image.ndim == 3 else image)
        row[DEPTH_COLUMN] = "" if depth is None else self._picture("depth", name, _in_steps(depth))
        row[MASK_COLUMN] = "" if mask is None else self._picture("mask", name, mask * np.uint8(255))
        row[DISTANCE_COLUMN] = "" if distance_true_m is None else distance_true_m
        angles = ["" if math.isnan(angle) else angle for angle in joint_pos.tolist()]
        row |= {f"{JOINT_PREFIX}{joint}": angle for joint, angle in enumerate(angles, start=1)}
        self._rows.append(row)

    def _picture(self, kind: str, name: str, pixels: np.ndarray) -> str:
        """Write a PNG; returns its path in the recording."""
        (self._folder / kind).mkdir(parents=True, exist_ok=True)
        ok, data = cv2.imencode(".png", np.ascontiguousarray(pixels))
        if not ok:
            raise OSError(f"cannot encode pixels of shape {pixels.shape} as PNG")
        write_file(self._folder / kind / name, data.tobytes())
        return f"{kind}/{name}"

    def __enter__(self) -> LayoutWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if error is not None:
            return
        write_json(self._folder / CAMERA_FILE, {**camera_values(self._camera), **self._notes})
        if self._box is not None:
            write_json(self._folder / TARGET_FILE, {BOX_KEY: self._box.tolist()})
        write_csv(self._folder / FRAMES_FILE, self._rows)


def _in_steps(depth: Float32Array) -> np.ndarray:
    """Depth in steps of 1 mm, shape (H, W), uint16; 0 where there is none or it is too far."""
    steps = np.nan_to_num(np.rint(depth / DEPTH_UNIT_M), nan=0.0, posinf=0.0, neginf=0.0)
    return np.where(steps <= np.iinfo(np.uint16).max, steps, 0.0).astype(np.uint16)
