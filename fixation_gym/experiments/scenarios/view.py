"""From where an instance of a hard scene is looked at, and what stands where in that view. Knows no simulator."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np

from fixation_gym.control.corridor import approach_directions
from fixation_gym.envs.object_pool import target_shape
from fixation_gym.envs.scene import TABLE_HEIGHT, TARGET_REGION, ObstacleSpec, TargetSpec
from fixation_gym.geometry.rigid import inverse, look_at, transform
from fixation_gym.types import FloatArray

MARGIN = 0.12
"""What is clearly nearer or farther than the target differs by this share of its depth."""
_VISIBLE_Y = 0.36
"""Vertical image position of things, normalised; the image ends at 0.39."""


@dataclass(frozen=True, eq=False)
class SceneView:
    """Camera and target of an instance that is being drawn."""

    T_base_cam: FloatArray
    target: TargetSpec
    depth: float

    def standing(self, x: float, depth: float, half_height: float) -> FloatArray | None:
        """Centre in base of a thing on the table at image column x and some depth; None if out of sight."""
        rotation, eye = self.T_base_cam[:3, :3], self.T_base_cam[:3, 3]
        height = TABLE_HEIGHT + half_height - eye[2]
        y = (height / depth - rotation[2, 2]) / rotation[2, 1]
        if abs(y) > _VISIBLE_Y:
            return None
        return eye + depth * (rotation @ np.array([x, y, 1.0]))

    def depths(self, obstacle: ObstacleSpec) -> FloatArray:
        """Depth of the corners of an obstacle's box, relative to the target's."""
        half = np.array(obstacle.shape.half_extent)
        corners = np.array(list(product((-1.0, 1.0), repeat=3))) * half
        c, s = math.cos(obstacle.yaw), math.sin(obstacle.yaw)
        turned = corners @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        return transform(inverse(self.T_base_cam), turned + obstacle.position)[:, 2] / self.depth

    def is_clearly(self, obstacle: ObstacleSpec, in_front: bool) -> bool:
        """Whether all of an obstacle is nearer, or farther, than the target by the margin."""
        depths = self.depths(obstacle)
        return bool(depths.max() < 1.0 - MARGIN if in_front else depths.min() > 1.0 + MARGIN)

    def is_across(self, obstacle: ObstacleSpec) -> bool:
        """Whether the line of sight to the target passes through an obstacle's box."""
        box, eye = obstacle.box, self.T_base_cam[:3, 3]
        line = np.linspace(eye, np.array(self.target.position), 200)[:-20] - box.centre
        c, s = math.cos(box.yaw), math.sin(box.yaw)
        along = line @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return bool(np.any(np.all(np.abs(along) < box.half_extent, axis=1)))

    def facing(self, position: FloatArray) -> float:
        """Yaw of a thing whose x axis points to the camera."""
        offset = self.T_base_cam[:3, 3] - position
        return math.atan2(offset[1], offset[0])


def sample_view(rng: np.random.Generator) -> SceneView:
    """Draw target and camera."""
    shape = target_shape(str(rng.choice(("box", "cylinder", "ball", "ring", "duck"))))
    scale = float(rng.uniform(0.6, 1.0))
    x, y = (float(rng.uniform(*bounds)) for bounds in TARGET_REGION)
    position = (x, y, TABLE_HEIGHT + shape.half_extent[2] * scale)
    target = TargetSpec(shape.name, (scale, scale, scale), position, float(rng.uniform(-math.pi, math.pi)))
    azimuth = math.atan2(y, x) + math.radians(rng.uniform(25.0, 60.0))
    elevation = math.radians(rng.uniform(32.0, 45.0))
    depth = float(rng.uniform(0.42, 0.52))
    centre = np.array(position)
    eye = centre + depth * approach_directions(np.array([azimuth]), np.array([elevation]))[0]
    return SceneView(look_at(eye, centre, np.array([0.0, 0.0, 1.0])), target, depth)
