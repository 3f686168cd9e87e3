"""Scenes as values: what stands where, what moves when, and from where the robot first looks."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fixation_gym.control.corridor import Box, approach_directions
from fixation_gym.envs.motion import Motion, places
from fixation_gym.envs.object_pool import Vector, obstacle_shape, target_shape
from fixation_gym.types import FloatArray

TABLE_HEIGHT = -0.112
"""Height of the table top in the robot base frame, m."""
TARGET_REGION = ((0.50, 0.62), (-0.14, 0.14))
"""Ranges of x and y in which the target is placed, in base, m."""
DARK_FRAME = (0.16, 0.17, 0.20, 1.0)
"""Usual colour of frames and rims."""
APPROACH_AZIMUTHS = np.radians(np.linspace(15.0, 75.0, 5))
APPROACH_ELEVATIONS = np.radians(np.linspace(45.0, 83.0, 5))
"""Directions, relative to the bearing of the target, from which the arm can reach it; one must be free of obstacles."""


@dataclass(frozen=True)
class TargetSpec:
    """A red object: shape, scale per axis, centre in base at reset in m, rotation about the vertical in rad."""

    shape: str
    scale: Vector
    position: Vector
    yaw: float
    motion: Motion | None = None

    @property
    def box(self) -> Box:
        """Upright box around the object at reset, in base."""
        half = np.array(target_shape(self.shape).half_extent) * self.scale
        return Box(np.array(self.position), half, self.yaw)

    @property
    def places(self) -> FloatArray:
        """Centres along its planned way, from first to last, shape (n, 3), in base, m."""
        return np.array(self.position) + places(self.motion)


@dataclass(frozen=True)
class ObstacleSpec:
    """One obstacle, centre in base at reset in m; ``texture`` dresses solid parts, ``rgba`` the see-through ones."""

    kind: str
    shape: str
    scale: float
    position: Vector
    yaw: float
    rgba: tuple[float, float, float, float]
    texture: str
    has_label: bool
    motion: Motion | None = None
    frame_rgba: tuple[float, float, float, float] = DARK_FRAME

    @property
    def box(self) -> Box:
        """Upright box around the obstacle at reset, in base."""
        half = np.array(obstacle_shape(self.kind, self.shape).half_extent) * self.scale
        return Box(np.array(self.position), half, self.yaw)

    @property
    def boxes(self) -> list[Box]:
        """The box at all places of its planned way, from first to last, in base."""
        return [Box(self.box.centre + offset, self.box.half_extent, self.yaw) for offset in places(self.motion)]


@dataclass(frozen=True)
class SceneSpec:
    """Everything that a reset decides. Frame: robot base, m."""

    target: TargetSpec
    obstacles: tuple[ObstacleSpec, ...]
    camera_position: Vector
    """Where the wrist camera starts."""
    gaze_point: Vector
    """Point on its optical axis at the start; near the target, but not on it."""
    light_direction: Vector
    table_texture: str
    distractor: TargetSpec | None = None
    """Another object of the target's colour. At the start the target is the one nearer to the image centre."""


def reachable_directions(target: FloatArray) -> FloatArray:
    """Unit vectors from the target to the camera that the arm can take up, shape (n, 3), in base."""
    bearing = math.atan2(target[1], target[0])
    return approach_directions(bearing + APPROACH_AZIMUTHS, APPROACH_ELEVATIONS)
