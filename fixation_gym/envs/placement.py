"""One obstacle at a time: where it stands and how it moves, so that it bars a way, and the room it needs."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from fixation_gym.control.corridor import any_meets, any_pair_meets, swept_hand
from fixation_gym.envs.config import Scenario
from fixation_gym.envs.motion import Motion
from fixation_gym.envs.obstacle_kinds import ObstacleKind, kinds_of
from fixation_gym.envs.scene import ObstacleSpec
from fixation_gym.envs.shapes import Part, Shape, centred, placed_boxes
from fixation_gym.geometry.boxes import Box, BoxSet
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
_ORBIT = 0.355
"""What is seen above a slope of ``_FLAT`` from the target stays this near, m: the hand goes around farther out."""
_FLAT = 0.5
_TARGET_GAP, OBSTACLE_GAP = 0.012, 0.006
"""Least room between an obstacle and red things, and between obstacles, m."""
FREE_ROOM = 0.01
"""Room around the hand on the free ways, m."""


def draw_kind(
    scenario: Scenario, first: bool, steepness: float, rng: np.random.Generator
) -> tuple[ObstacleKind, str] | None:
    """Draw a kind and a material for the next obstacle; None if there is none.

    Args:
        scenario: with what may be drawn.
        first: whether it is the first obstacle: it may stand around the target, and shows the scenario's material.
        steepness: sine of the elevation in which it is to be seen from the target, 0..1.
        rng: generator.
    """
    materials = scenario.obstacle_materials
    material = materials[0 if first else int(rng.integers(len(materials)))]
    names = (scenario.first_kinds if first else ()) or scenario.obstacle_kinds
    kinds = [kind for kind in kinds_of(material) if kind.name in names and (first or not kind.around)]
    suitable = [kind for kind in kinds if kind.around or kind.steepness[0] <= steepness <= kind.steepness[1]]
    return (suitable[int(rng.integers(len(suitable)))], material) if suitable else None


@dataclass(frozen=True, eq=False)
class Draft:
    """An obstacle that may come into the scene: what it is made of and where it stands, but not yet how it looks."""

    kind: ObstacleKind
    material: str
    parts: tuple[Part, ...]
    """In the floor frame of its kind."""
    origin: Vector
    """Of that frame in base, m."""
    facing: float
    """Of that frame about the vertical, rad."""
    boxes: BoxSet
    """Around its parts, in base."""

    def moved(self, offset: FloatArray) -> Draft:
        """The same elsewhere; ``offset`` has shape (3,), m."""
        x, y, z = (float(value) for value in np.add(self.origin, offset))
        return replace(self, origin=(x, y, z), boxes=self.boxes.moved(offset))

    @property
    def box(self) -> Box:
        """Box around all parts, in base."""
        shape, position = self._centred()
        return Box(np.array(position), np.array(shape.half_extent), self.facing)

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
        shape, (x, y, _) = centred(self.kind.name, self.parts, 1.0)
        c, s = math.cos(self.facing), math.sin(self.facing)
        height = ROBOT.workspace.table_height + shape.half_extent[2]
        return shape, (self.origin[0] + c * x - s * y, self.origin[1] + s * x + c * y, height)


def draw_obstacle(
    kind: ObstacleKind, material: str, target: FloatArray, bearing: float, distance: float, rng: np.random.Generator
) -> Draft:
    """Draw an obstacle.

    Args:
        kind: what it is.
        material: of it.
        target: centre of the target, shape (3,), in base, m.
        bearing: azimuth of a way of the hand, in base, rad: the obstacle stands below it or, if it stands around the
            target, opens towards it.
        distance: between its place and the target, horizontal, m.
        rng: generator.
    """
    x, y = float(target[0]) - distance * math.cos(bearing), float(target[1]) - distance * math.sin(bearing)
    facing = bearing + rng.uniform(-0.4, 0.4) + (math.pi if kind.around else 0.0)
    parts, origin = kind.draw(material, rng), (x, y, ROBOT.workspace.table_height)
    return Draft(kind, material, parts, origin, facing, placed_boxes(parts, origin, facing))


def draw_mover(
    scenario: Scenario, kind: ObstacleKind, material: str, target: FloatArray, rng: np.random.Generator
) -> ObstacleSpec:
    """Draw a thing that moves about somewhere near the target."""
    bearing = float(rng.uniform(-math.pi, math.pi))
    draft = draw_obstacle(kind, material, target, bearing, rng.uniform(*_MOVER_DISTANCE), rng)
    still = draft.finished(scenario, rng)
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


@dataclass(frozen=True, eq=False)
class Room:
    """What an obstacle must keep clear of."""

    reds: BoxSet
    """Boxes around the target at all its places, the first one first."""
    ends: FloatArray
    """Where the target is at first and in the end, shape (n, 3), in base, m."""
    ways: FloatArray
    """Axes of the hand, as in ``corridor.hand_axes``, on the ways to it that stay free, shape (m, 3, 3)."""

    def first_place(self, boxes: BoxSet, step: FloatArray, most: int) -> int | None:
        """Number of steps after which an obstacle has room; None if it never has.

        Args:
            boxes: of the obstacle's parts at all its places.
            step: by which it is moved, shape (3,), m.
            most: largest number of steps.
        """
        centres, halves = swept_hand(FREE_ROOM)
        table = np.array(ROBOT.workspace.table)
        steps = _first_place(*boxes, step, most, table, self.reds, self.ends, self.ways, centres, halves)
        return None if steps < 0 else int(steps)

    def holds(self, boxes: BoxSet) -> bool:
        """Whether an obstacle has room where it is."""
        return self.first_place(boxes, np.zeros(3), 0) == 0


@njit(cache=True)
def _first_place(
    places: FloatArray,
    turns: FloatArray,
    halves: FloatArray,
    step: FloatArray,
    most: int,
    table: FloatArray,
    reds: BoxSet,
    ends: FloatArray,
    ways: FloatArray,
    swept: FloatArray,
    swept_halves: FloatArray,
) -> int:
    """The compiled part of ``Room.first_place``; -1: none."""
    for count in range(most + 1):
        centres = places + count * step
        if not _within_bounds(centres, turns, halves, table, reds[0][0]):
            continue
        if any_pair_meets(centres, turns, halves + _TARGET_GAP, reds[0], reds[1], reds[2]):
            continue
        free = True
        for end in range(len(ends)):
            if free and np.any(any_meets(ends[end], ways, centres, turns, halves, swept, swept_halves)):
                free = False
        if free:
            return count
    return -1


@njit(cache=True)
def _within_bounds(
    centres: FloatArray, rotations: FloatArray, halves: FloatArray, table: FloatArray, target: FloatArray
) -> bool:
    """Whether boxes are above the table, and within ``_ORBIT`` of the target if the hand might meet them there.

    The table is an argument, (low, high) of x and y: what is compiled keeps the constants that it once saw.
    """
    for i in range(len(centres)):
        low, high = centres[i].copy(), centres[i].copy()
        for axis in range(3):
            reach = 0.0
            for k in range(3):
                reach += abs(rotations[i, axis, k]) * halves[i, k]
            low[axis] -= reach
            high[axis] += reach
        for axis in range(2):
            if low[axis] < table[axis, 0] or high[axis] > table[axis, 1]:
                return False
        x = max(abs(low[0] - target[0]), abs(high[0] - target[0]))
        y = max(abs(low[1] - target[1]), abs(high[1] - target[1]))
        across, rise = math.hypot(x, y), high[2] - target[2]
        if rise > _FLAT * across and math.hypot(across, rise) > _ORBIT:
            return False
    return True
