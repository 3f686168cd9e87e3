"""A replay for the viewer Rerun: all that perception sees and says, on one time line and in one space."""

from __future__ import annotations

from collections import deque
from pathlib import Path
from types import TracebackType
from typing import Any

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import pose_to_matrix, transform
from fixation_gym.perception.drawing import TARGET_RGB, colour_map
from fixation_gym.perception.flow.optic_flow import Flow
from fixation_gym.replay.looks import Look
from fixation_gym.types import FloatArray

_TIME_LINE = "time"
_CAMERA, _PICTURE = "base/camera", "base/camera/picture"
_FLOW_STEP = 5
"""Every fifth pixel of the flow's grid gets an arrow, along both axes."""
_LARGEST_VARIANCE_PX2 = 0.25
"""Arrows are drawn where the motion in a frame is known to this variance, px^2 of the grid."""
_JPEG_QUALITY = 85
_PATH_LENGTH = 300
"""The camera's path is shown over so many pictures."""


class RerunLog:
    """Writes looks to an ``.rrd`` file. Use as a context manager."""

    def __init__(self, path: Path, grid: Intrinsics) -> None:
        """Begin the file.

        Args:
            path: of the file; its folder is made if needed.
            grid: camera of flow and map.
        """
        import rerun as rr  # pyright: ignore[reportMissingImports]

        path.parent.mkdir(parents=True, exist_ok=True)
        self._rr, self._grid = rr, grid
        self._recording: Any = rr.RecordingStream("fixation_gym_replay")
        self._recording.save(str(path))
        self._way: deque[FloatArray] = deque(maxlen=_PATH_LENGTH)

    def add(self, look: Look) -> None:
        """Log a look: the picture at its own time, flow and map at theirs."""
        rr, recording, percept = self._rr, self._recording, look.percept
        T_base_cam = pose_to_matrix(look.camera_pose)
        height, width = look.rgb.shape[:2]
        full = self._grid.scaled(height, width)
        recording.set_time(_TIME_LINE, duration=percept.time)
        recording.log(_CAMERA, rr.Transform3D(translation=T_base_cam[:3, 3], mat3x3=T_base_cam[:3, :3]))
        pinhole = rr.Pinhole(image_from_camera=full.matrix, resolution=(width, height), image_plane_distance=0.1)
        recording.log(_PICTURE, pinhole)
        recording.log(_PICTURE, rr.Image(look.rgb).compress(jpeg_quality=_JPEG_QUALITY))
        recording.log(f"{_PICTURE}/target", rr.LineStrips2D(_outlines(percept.segmentation.mask), colors=TARGET_RGB))
        self._way.append(T_base_cam[:3, 3])
        recording.log("base/camera_path", rr.LineStrips3D([np.array(self._way)]))
        self._log_fixation(look, T_base_cam, full)
        if percept.flow.valid:
            self._log_map(look, full)

    def _log_fixation(self, look: Look, T_base_cam: FloatArray, camera: Intrinsics) -> None:
        """The target, its distance, and the plane through it at which the map changes sides."""
        rr, recording, fixation = self._rr, self._recording, look.percept.fixation
        if not fixation.initialised:
            return
        radius = min(fixation.distance_std_m, fixation.distance_m)
        recording.log("base/target", rr.Points3D([fixation.point_base], radii=[radius], colors=[TARGET_RGB]))
        recording.log("distance/estimate", rr.Scalars(fixation.distance_m))
        recording.log("distance/std", rr.Scalars(fixation.distance_std_m))
        if look.truth.distance_m is not None:
            recording.log("distance/truth", rr.Scalars(look.truth.distance_m))
        plane = rr.LineStrips3D([transform(T_base_cam, _plane(camera, fixation.distance_m))])
        recording.log("base/zero_flow_plane", plane)

    def _log_map(self, look: Look, camera: Intrinsics) -> None:
        rr, recording, percept = self._rr, self._recording, look.percept
        recording.set_time(_TIME_LINE, duration=percept.flow.time)
        recording.log("zero_flow/map", rr.Image(colour_map(percept.zfc.cells)))
        sides = np.where(percept.zfc.supported, np.rint(255.0 * percept.zfc.p_nearer), 128.0).astype(np.uint8)
        recording.log("zero_flow/pixels", rr.Image(colour_map(sides)))
        starts, ways = _arrows(percept.flow, camera)
        recording.log(f"{_PICTURE}/flow", rr.Arrows2D(origins=starts, vectors=ways))

    def __enter__(self) -> RerunLog:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._recording.flush()
        self._recording.disconnect()


def _outlines(mask: np.ndarray) -> list[FloatArray]:
    """Closed outlines of a mask, shape (n, 2) each, px."""
    contours, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    return [np.concatenate([c[:, 0], c[:1, 0]]).astype(np.float32) for c in contours]


def _plane(camera: Intrinsics, depth: float) -> FloatArray:
    """Border of the view at a depth, closed, shape (5, 3), in ``cam``, m."""
    right, bottom = camera.width - 0.5, camera.height - 0.5
    corners = np.array([[-0.5, -0.5], [right, -0.5], [right, bottom], [-0.5, bottom], [-0.5, -0.5]])
    return depth * np.column_stack([camera.normalise(corners), np.ones(5)])


def _arrows(flow: Flow, camera: Intrinsics) -> tuple[FloatArray, FloatArray]:
    """Motion in one frame where it is known, in px of the picture: starts and ways, shape (n, 2) each."""
    sparse = np.zeros_like(flow.overlap)
    sparse[_FLOW_STEP // 2 :: _FLOW_STEP, _FLOW_STEP // 2 :: _FLOW_STEP] = True
    variance = flow.residual_cov[0] + flow.residual_cov[2]
    rows, columns = np.nonzero(sparse & flow.overlap & (variance < _LARGEST_VARIANCE_PX2))
    scale = camera.width / flow.overlap.shape[1]
    starts = (np.column_stack([columns, rows]) + 0.5) * scale - 0.5
    return starts, flow.flow[rows, columns] * (scale * flow.period)
