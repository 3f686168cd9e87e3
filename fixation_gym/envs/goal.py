"""What a scene begins with: the target, and the way to it that will stay free."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from fixation_gym.control.box_tests import BOX_COLUMNS, packed_hand
from fixation_gym.control.corridor import hand_axes, level_axes, swept_hand
from fixation_gym.control.reach import REACH_GRID, reachable_directions
from fixation_gym.envs.config import Scenario
from fixation_gym.envs.object_pool import target_shape
from fixation_gym.envs.placement import sample_push
from fixation_gym.envs.room import FREE_ROOM, Room
from fixation_gym.envs.scene import TargetSpec
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, MaskArray

_CONE = math.radians(5.0)
"""Half angle of the cone of free ways, rad."""
_AROUND = [(math.cos(angle), math.sin(angle)) for angle in np.radians(range(0, 360, 60))]
_FREE_CONE = np.array(
    [(0.0, 0.0, -1.0), *((math.sin(_CONE) * x, math.sin(_CONE) * y, -math.cos(_CONE)) for x, y in _AROUND)]
)
"""Axis and rim of the cone in the axes of a camera on the free way, shape (n, 3)."""
_NEAR_FREE = math.radians(12.0)
"""Ways this near to the free one need not be barred, rad."""
_LARGEST_ROLL, _LOW_ROLL = math.radians(45.0), math.radians(20.0)
"""Largest turn of the hand that a grasp may need on a steep free way and on a low one, rad."""
_SIDED = ("box", "duck")
"""Targets that the fingers can close on from some sides only."""
_TABLE, _SWEPT = np.array(ROBOT.workspace.table), packed_hand(swept_hand(FREE_ROOM))


def direction_of(azimuth: float, elevation: float) -> FloatArray:
    """Unit vector from the target to a camera on a way, as in ``Way``, shape (3,), in base."""
    flat = -math.cos(elevation)
    return np.array([flat * math.cos(azimuth), flat * math.sin(azimuth), math.sin(elevation)])


@dataclass(frozen=True)
class Way:
    """A straight way of the hand to the target: from where it comes."""

    azimuth: float
    """In base, rad: 0 comes from the robot's side along +x."""
    elevation: float
    """Above the table, rad."""

    @cached_property
    def direction(self) -> FloatArray:
        """Unit vector from the target to a camera on that way, shape (3,), in base."""
        return direction_of(self.azimuth, self.elevation)


@dataclass(frozen=True, eq=False)
class Goal:
    """Target and free way."""

    target: TargetSpec
    free: Way
    room: Room
    ways: FloatArray
    """Directions from the target, in the end, to cameras all over the reach, shape (n, 3)."""
    near_free: MaskArray
    """Those near the free way, shape (n,)."""
    drawn_among: MaskArray
    """Those from which the free way is drawn, shape (n,)."""


def sample_goal(scenario: Scenario, free_angles: tuple[float, float], rng: np.random.Generator) -> Goal:
    """Draw the target for a free way, given by its azimuth against the target's bearing and its elevation, rad."""
    target = sample_target(scenario, rng)
    if scenario.target_moves:
        target = _pushed(target, scenario, rng)
    free = Way(math.atan2(target.position[1], target.position[0]) + free_angles[0], free_angles[1])
    if target.shape in _SIDED:
        target = replace(target, yaw=_grasped_yaw(target, free, rng))
    room = _room(target, free)
    ways = reachable_directions(room.ends[-1])
    near_free = ways @ free.direction > math.cos(_NEAR_FREE)
    return Goal(target, free, room, ways, near_free, _elevations_within(scenario.free_elevation_deg))


@cache
def _elevations_within(bounds_deg: tuple[float, float]) -> MaskArray:
    """Which ways of the reach's grid are of an elevation within these bounds, or nearest to it."""
    low, high = np.radians(bounds_deg)
    beyond = np.maximum(np.maximum(low - REACH_GRID[:, 1], REACH_GRID[:, 1] - high), 0.0)
    return beyond <= beyond.min() + 1e-6


def sample_target(scenario: Scenario, rng: np.random.Generator) -> TargetSpec:
    """Draw a red object somewhere in the target region."""
    shape = target_shape(scenario.target_shapes[int(rng.integers(len(scenario.target_shapes)))])
    width = rng.uniform(*scenario.grasp_width)
    ratio = width / (2.0 * shape.half_extent[1])
    # Thin boxes and cylinders are taller than wide, so that oblique fingers reach them above the table.
    slender = shape.name in ("box", "cylinder")
    height_ratio = min(1.0, ratio * rng.uniform(1.0, 1.6)) if slender else ratio
    length_ratio = min(1.0, ratio * rng.uniform(1.0, 1.3)) if shape.name == "box" else ratio
    scale = (float(length_ratio), float(ratio), float(height_ratio))
    x, y = (rng.uniform(*bounds) for bounds in ROBOT.workspace.targets)
    z = ROBOT.workspace.table_height + shape.half_extent[2] * height_ratio
    return TargetSpec(shape.name, scale, (float(x), float(y), float(z)), float(rng.uniform(-math.pi, math.pi)))


def _pushed(target: TargetSpec, scenario: Scenario, rng: np.random.Generator) -> TargetSpec:
    """The target with a push that leaves it within reach."""
    region = ROBOT.workspace.pushed_targets
    while True:
        motion = sample_push(scenario.target_push, scenario.push_time, rng.uniform(-math.pi, math.pi), rng)
        end = np.add(target.position[:2], motion.displacement)
        if all(low < value < high for value, (low, high) in zip(end, region, strict=True)):
            return replace(target, motion=motion)


def _grasped_yaw(target: TargetSpec, free: Way, rng: np.random.Generator) -> float:
    """A yaw at which the fingers can close on a target with sides from the free way.

    Flat fingers that are turned far would touch the table, so the lower the way the less the hand may turn.
    """
    steepness = (free.elevation - math.radians(45.0)) / math.radians(25.0)
    most = _LOW_ROLL + (_LARGEST_ROLL - _LOW_ROLL) * min(max(steepness, 0.0), 1.0)
    # The fingers open along the image's x axis, which lies across the way, as does the target's y axis at this yaw.
    quarters = int(rng.integers(4)) if target.shape == "box" else 2 * int(rng.integers(2))
    yaw = free.azimuth + quarters * math.pi / 2 + rng.uniform(-most, most)
    return float((yaw + math.pi) % (2.0 * math.pi) - math.pi)


def _room(target: TargetSpec, free: Way) -> Room:
    """What obstacles must keep clear of: the target and a cone of free ways, its axis also for a turned hand."""
    level, places = level_axes(free.direction[None])[0], target.places
    turn = _grasp_turn(target, free)
    ways = np.empty((len(_FREE_CONE) + (turn is not None), 3, 3))
    ways[: len(_FREE_CONE)] = level_axes(_FREE_CONE @ level)
    if turn is not None:
        ways[-1] = hand_axes(free.direction[None], np.array([turn]))[0]
    ends = places[[0, -1]] if target.motion else places[:1]
    c, s = math.cos(target.yaw), math.sin(target.yaw)
    reds = np.empty((len(places), BOX_COLUMNS))
    reds[:, :3] = places
    reds[:, 3:6] = target.half_extent
    reds[:, 6:] = c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0
    return Room(ROBOT.workspace.table_height, _TABLE, reds, ends, ways, _SWEPT)


def _grasp_turn(target: TargetSpec, free: Way) -> float | None:
    """Turn of the hand about its axis that the grasp of a target with sides needs, rad; None for what is round."""
    if target.shape not in _SIDED:
        return None
    period = math.pi / 2 if target.shape == "box" else math.pi
    return (free.azimuth - target.yaw + period / 2) % period - period / 2
