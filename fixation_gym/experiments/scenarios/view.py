"""From where an instance of a hard scene is looked at, and what is seen of a thing there. Knows no simulator."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fixation_gym.control.box_tests import boxes_meet
from fixation_gym.control.corridor import approach_directions, hand_boxes
from fixation_gym.envs.object_pool import target_shape
from fixation_gym.envs.scene import ObstacleSpec, TargetSpec
from fixation_gym.experiments.scenarios.rules import plane_front
from fixation_gym.geometry.boxes import BoxSet
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import look_at
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, MaskArray

MARGIN = 0.12
"""What is clearly nearer or farther than the target differs by this share of its depth."""
_HAND_GAP = 0.04
"""Between things and the hand, m: it circles."""
_EYES = Intrinsics.from_fovy(27, 36, ROBOT.camera.fovy)
"""Lines of sight along which things are looked for; as many pixels as that are enough to tell shares."""
_RAYS = np.stack([*_EYES.grid, np.ones((_EYES.height, _EYES.width))], axis=-1).reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class Sight:
    """What is seen of one thing when nothing else is there."""

    depths: FloatArray
    """Of the lines of sight that meet it, relative to the target's, shape (n,)."""
    places: FloatArray
    """Where they are in the image, normalised, shape (n, 2)."""
    lines: MaskArray
    """Which of all lines of sight meet it."""
    low_share: float
    """Share of them for which the table alone says "in front": there its plane is nearer than the target."""

    def overlap(self, lines: MaskArray) -> float:
        """Share of the lines of sight of this or of another thing, of which fewer are there, that meet both."""
        return float(np.count_nonzero(self.lines & lines)) / max(1, min(len(self.depths), int(np.count_nonzero(lines))))

    def is_clearly(self, in_front: bool) -> bool:
        """Whether all that is seen is nearer, or farther, than the target by the margin; not if nothing is seen."""
        if not len(self.depths):
            return False
        return bool(self.depths.max() < 1.0 - MARGIN if in_front else self.depths.min() > 1.0 + MARGIN)


@dataclass(frozen=True, eq=False)
class SceneView:
    """Camera and target of an instance that is being drawn."""

    T_base_cam: FloatArray
    target: TargetSpec
    depth: float
    rise: float = 0.0
    """Height of the stand under the target, m; 0 for none."""
    forward: float = 0.0
    """How far the camera moves ahead, m."""

    def point(self, x: float, y: float, depth: float) -> FloatArray:
        """Point in base at normalised image coordinates and some depth, shape (3,), m."""
        return self.T_base_cam[:3, 3] + depth * (self.T_base_cam[:3, :3] @ np.array([x, y, 1.0]))

    def row(self, depth: float, height: float) -> float:
        """Normalised vertical image coordinate at which points of some depth are at a height over the table, m.

        The camera is level, so the column does not matter.
        """
        rotation, eye = self.T_base_cam[:3, :3], self.T_base_cam[:3, 3]
        return float(((ROBOT.workspace.table_height + height - eye[2]) / depth - rotation[2, 2]) / rotation[2, 1])

    def sight(self, obstacle: ObstacleSpec) -> Sight:
        """What is seen of an obstacle, by lines of sight through the boxes around its parts."""
        depths = self._meet(_RAYS, obstacle.boxes)
        hit = np.isfinite(depths)
        low = plane_front(self.T_base_cam, _EYES, ROBOT.workspace.table_height, 1.0 / self.depth).ravel()[hit]
        return Sight(depths[hit] / self.depth, _RAYS[hit, :2], hit, float(low.mean()) if low.size else 0.0)

    def is_across(self, obstacle: ObstacleSpec) -> bool:
        """Whether the line of sight to the target passes through an obstacle's box."""
        return bool(self._meet(np.array([[0.0, 0.0, 1.0]]), obstacle.boxes)[0] < self.depth)

    def _meet(self, rays: FloatArray, boxes: BoxSet) -> FloatArray:
        """Depth at which each ray, in ``cam``, shape (n, 3), z = 1, meets the first box; inf where it meets none."""
        depths = np.full(len(rays), np.inf)
        directions = rays @ self.T_base_cam[:3, :3].T
        for centre, rotation, half in zip(*boxes, strict=True):
            begin, along = (self.T_base_cam[:3, 3] - centre) @ rotation, directions @ rotation
            along = np.where(np.abs(along) < 1e-12, 1e-12, along)
            near, far = (-half - begin) / along, (half - begin) / along
            enter, leave = np.minimum(near, far).max(axis=1), np.maximum(near, far).min(axis=1)
            depths = np.where((enter < leave) & (enter > 0.0), np.minimum(depths, enter), depths)
        return depths

    def has_room_for_hand(self, boxes: BoxSet) -> bool:
        """Whether a thing keeps clear of the hand at the start and after it moved ahead."""
        near = self.T_base_cam.copy()
        near[:3, 3] += self.forward * near[:3, 2]
        return not any(boxes_meet(hand_boxes(pose), boxes, _HAND_GAP) for pose in (self.T_base_cam, near))

    def facing(self, position: FloatArray) -> float:
        """Yaw of a thing whose x axis points to the camera; its y axis then points to the right in the image."""
        offset = self.T_base_cam[:3, 3] - position
        return math.atan2(offset[1], offset[0])


def sample_view(rng: np.random.Generator, rise: float, forward: float) -> SceneView:
    """Draw target and camera; ``rise`` and ``forward`` as in ``SceneView``."""
    shape = target_shape(str(rng.choice(("box", "cylinder", "ball", "ring", "duck"))))
    scale = float(rng.uniform(0.6, 1.0))
    x, y = (float(rng.uniform(*bounds)) for bounds in ROBOT.workspace.targets)
    position = (x, y, ROBOT.workspace.table_height + rise + shape.half_extent[2] * scale)
    target = TargetSpec(shape.name, (scale, scale, scale), position, float(rng.uniform(-math.pi, math.pi)))
    azimuth = math.atan2(y, x) + math.radians(rng.uniform(25.0, 60.0))
    elevation = math.radians(rng.uniform(32.0, 45.0))
    depth = float(rng.uniform(0.42, 0.52))
    centre = np.array(position)
    eye = centre + depth * approach_directions(np.array([azimuth]), np.array([elevation]))[0]
    return SceneView(look_at(eye, centre, np.array([0.0, 0.0, 1.0])), target, depth, rise, forward)
