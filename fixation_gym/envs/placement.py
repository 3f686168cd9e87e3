"""One obstacle at a time: how it looks where it stands, and how it moves."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fixation_gym.envs.config import Scenario
from fixation_gym.envs.drafts import Drafts
from fixation_gym.envs.motion import Motion
from fixation_gym.envs.obstacle_kinds import KIND_NAMES
from fixation_gym.envs.obstacle_parts import draw_parts
from fixation_gym.envs.part_rows import parts_of
from fixation_gym.envs.scene import ObstacleSpec
from fixation_gym.envs.shapes import MATERIALS, Part, Shape, centred
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, Vector

OBSTACLE_TEXTURES = ("wood_light", "wood_dark", "wood_plain", "bricks", "metal")
_PUSH_SPEED = 0.15
"""Speed of pushes, m/s."""
_DRIVE_LENGTH = (0.08, 0.16)
"""Range of the length of a driven obstacle's way, m."""
_MOVER_DISTANCE = (0.15, 0.27)
"""Range of the distance between the target and a moving obstacle, m."""
_DENSITY = 250.0
"""Of what obstacles are made of, kg/m^3; light wood with hollow parts."""
_LEAST_MASS, _LARGEST_MASS = 0.3, 1.5
_MOVING = "thing"
"""Kind of what moves."""


@dataclass(frozen=True)
class Draft:
    """An obstacle: what it is made of and where it stands, but not yet how it looks."""

    kind: str
    material: str
    parts: tuple[Part, ...]
    """In the floor frame of its kind."""
    origin: Vector
    """Of that frame in base, m."""
    facing: float
    """Of that frame about the vertical, rad."""

    def finished(self, scenario: Scenario, rng: np.random.Generator) -> ObstacleSpec:
        """The obstacle, with its colour drawn."""
        shape, position = self._centred()
        volume = sum(part.density * 8.0 * math.prod(part.size) for part in self.parts)
        tint = rng.uniform(0.55, 0.95, 3) * [0.75, 1.0, 1.0]
        return ObstacleSpec(
            kind=self.material,
            shape=replace(shape, mass=min(max(_DENSITY * volume, _LEAST_MASS), _LARGEST_MASS)),
            position=position,
            yaw=self.facing,
            rgba=(float(tint[0]), float(tint[1]), float(tint[2]), float(rng.uniform(*scenario.alpha))),
            texture=str(rng.choice(OBSTACLE_TEXTURES)),
        )

    def _centred(self) -> tuple[Shape, Vector]:
        """The shape, and where its centre is in base."""
        shape, (x, y, _) = centred(self.kind, self.parts, 1.0)
        c, s = math.cos(self.facing), math.sin(self.facing)
        height = ROBOT.workspace.table_height + shape.half_extent[2]
        return shape, (self.origin[0] + c * x - s * y, self.origin[1] + s * x + c * y, height)


def draft_of(drafts: Drafts, index: int) -> Draft:
    """One of many drafts."""
    begin, end = drafts.ends[index], drafts.ends[index + 1]
    kind, material = KIND_NAMES[drafts.kinds[index]], MATERIALS[drafts.materials[index]]
    x, y, z = drafts.origins[index].tolist()
    return Draft(kind, material, parts_of(drafts.rows[begin:end]), (x, y, z), float(drafts.facings[index]))


def draw_mover(scenario: Scenario, material: str, target: FloatArray, rng: np.random.Generator) -> ObstacleSpec:
    """Draw a thing that moves about somewhere near the target's place, shape (3,), in base, m."""
    bearing, distance = float(rng.uniform(-math.pi, math.pi)), rng.uniform(*_MOVER_DISTANCE)
    x, y = float(target[0]) - distance * math.cos(bearing), float(target[1]) - distance * math.sin(bearing)
    facing = bearing + rng.uniform(-0.4, 0.4)
    parts = draw_parts(_MOVING, material, rng)
    still = Draft(_MOVING, material, parts, (x, y, ROBOT.workspace.table_height), facing).finished(scenario, rng)
    heading = float(rng.uniform(-math.pi, math.pi))
    if str(rng.choice(scenario.obstacle_motions)) == "driven":
        length = rng.uniform(*_DRIVE_LENGTH)
        displacement = (float(length * math.cos(heading)), float(length * math.sin(heading)))
        motion = Motion(0.0, displacement, float(rng.uniform(*scenario.drive_speed)), to_and_fro=True)
    else:
        motion = sample_push(scenario.obstacle_push, scenario.push_time, heading, rng)
    x, y = np.array(still.position[:2]) - rng.uniform(0.0, 1.0) * np.array(motion.displacement)
    return replace(still, position=(float(x), float(y), still.position[2]), motion=motion)


def sample_push(
    distance: tuple[float, float], start: tuple[float, float], angle: float, rng: np.random.Generator
) -> Motion:
    """A push in the direction ``angle`` in base, rad, with distance in m and start in s drawn from their ranges."""
    length = float(rng.uniform(*distance))
    displacement = (length * math.cos(angle), length * math.sin(angle))
    return Motion(float(rng.uniform(*start)), displacement, _PUSH_SPEED)
