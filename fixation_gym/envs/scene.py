"""Scenes as values: what stands where, what moves when, and from where the robot first looks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fixation_gym.envs.motion import Motion, places
from fixation_gym.envs.object_pool import target_shape
from fixation_gym.envs.shapes import Shape
from fixation_gym.geometry.boxes import Box, BoxSet, joined
from fixation_gym.types import FloatArray, Vector

RED = (0.80, 0.06, 0.05, 1.0)
"""Colour of targets and distractors, where it is not drawn."""
UNTINTED = (1.0, 1.0, 1.0, 1.0)
"""Leaves a texture its own colours."""
DARK_FRAME = (0.16, 0.17, 0.20, 1.0)
"""Usual colour of frames and rims."""


ROOM = (
    "table_visual",
    *(f"sheet{i}" for i in range(6)),
    *(f"board{i}" for i in range(3)),
    "floor",
    *(f"wall_{side}_visual" for side in ("leftcorner", "rightcorner", "left", "right", "rear", "front")),
)
"""Names of what a scene has around its things, the table first."""


@dataclass(frozen=True)
class RoomSurface:
    """How a piece of the room looks."""

    name: str
    """One of ``ROOM``."""
    rgba: tuple[float, float, float, float]
    """Its colour, or the tint of its texture."""
    texture: str | None = None
    """None: the usual one."""


@dataclass(frozen=True)
class TargetSpec:
    """A red object: shape, scale per axis, centre in base at reset in m, rotation about the vertical in rad."""

    shape: str
    scale: Vector
    position: Vector
    yaw: float
    motion: Motion | None = None
    rgba: tuple[float, float, float, float] = RED
    texture: str | None = None
    """None: plain."""

    @property
    def half_extent(self) -> Vector:
        """Half sizes of the upright box around the object, m."""
        (x, y, z), (along, across, up) = target_shape(self.shape).half_extent, self.scale
        return x * along, y * across, z * up

    @property
    def box(self) -> Box:
        """Upright box around the object at reset, in base."""
        return Box(np.array(self.position), np.array(self.half_extent), self.yaw)

    @property
    def places(self) -> FloatArray:
        """Centres along its planned way, from first to last, shape (n, 3), in base, m."""
        return np.array(self.position) + places(self.motion)


@dataclass(frozen=True)
class ObstacleSpec:
    """One obstacle, centre in base at reset in m; ``texture`` dresses solid parts, ``rgba`` the see-through ones."""

    kind: str
    """What it is made of, one of ``shapes.MATERIALS``."""
    shape: Shape
    position: Vector
    yaw: float
    rgba: tuple[float, float, float, float]
    texture: str
    motion: Motion | None = None
    frame_rgba: tuple[float, float, float, float] = DARK_FRAME
    tint: tuple[float, float, float, float] = UNTINTED
    """Of what is textured."""

    @property
    def box(self) -> Box:
        """Upright box around the obstacle at reset, in base."""
        return Box(np.array(self.position), np.array(self.shape.half_extent), self.yaw)

    @property
    def boxes(self) -> BoxSet:
        """Boxes around its parts at all places of its planned way, in base."""
        boxes = self.shape.boxes(self.position, self.yaw)
        return boxes if self.motion is None else joined([boxes.moved(offset) for offset in places(self.motion)])

    @property
    def last_boxes(self) -> BoxSet:
        """Boxes around its parts at the end of its planned way, in base."""
        return self.shape.boxes(self.position, self.yaw).moved(places(self.motion)[-1])


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
    room: tuple[RoomSurface, ...] = ()
    """What of the room does not look as usual."""
    free_way: tuple[float, float] | None = None
    """Azimuth in base and elevation of the way that was left free, rad; None without obstacles."""
