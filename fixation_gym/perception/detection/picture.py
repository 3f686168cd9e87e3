"""An image at the size at which things are followed, and where the camera was."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import pose_to_matrix
from fixation_gym.types import FloatArray, ImageArray, Observation


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """An image and where the camera was."""

    rgb: ImageArray
    """Shape (h, w, 3)."""
    camera: Intrinsics
    """Of this image."""
    T_base_cam: FloatArray
    """Camera pose, shape (4, 4)."""

    @property
    def rotation(self) -> FloatArray:
        """Of the camera in base, shape (3, 3)."""
        return self.T_base_cam[:3, :3]

    def pixel(self, place: FloatArray) -> FloatArray:
        """Column and row, shape (2,), of a place in normalised coordinates, shape (2,)."""
        return self.camera.project(np.append(place, 1.0))

    def line_of_sight(self, place: FloatArray) -> FloatArray:
        """Unit vector in base, shape (3,), to a place in normalised coordinates, shape (2,)."""
        ray = self.rotation @ np.append(place, 1.0)
        return ray / np.linalg.norm(ray)


def angle_between(first: FloatArray, second: FloatArray) -> float:
    """Angle between two unit vectors, rad."""
    return math.acos(min(1.0, max(-1.0, float(first @ second))))


def picture_of(observation: Observation, camera: Intrinsics) -> Picture:
    """An observation in the size of a camera."""
    rgb = observation.rgb
    if rgb.shape[:2] != (camera.height, camera.width):
        rgb = cv2.resize(rgb, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    return Picture(np.ascontiguousarray(rgb, np.uint8), camera, pose_to_matrix(observation.camera_pose))
