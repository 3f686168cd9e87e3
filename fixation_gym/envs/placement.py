"""Where obstacles stand and how they move: what ``sampling`` draws, and the room they need."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fixation_gym.envs.config import Scenario
from fixation_gym.envs.motion import Motion
from fixation_gym.envs.object_pool import OBSTACLE_SHAPES, Shape, obstacle_shape
from fixation_gym.envs.scene import TABLE_HEIGHT, ObstacleSpec
from fixation_gym.types import FloatArray

OBSTACLE_TEXTURES = ("wood_light", "wood_dark", "wood_plain", "bricks", "metal")
_PUSH_SPEED = 0.15
"""Speed of pushes, m/s."""
_SCREEN_GAPS = {"low": (0.100, 0.115), "high": (0.060, 0.075)}
"""Ranges of the distance between the target's centre and a low screen in front, or a high one behind it, m."""
_SCREEN_AZIMUTH = math.radians(45.0)
"""Of the middle of the directions from which the arm comes, against the direction from base to target, rad."""
_SCREEN_TURN = 0.2
"""Largest angle between that direction and the normal of the screen, rad."""
_DRIVE_LENGTH = (0.08, 0.16)
"""Range of the length of a driven obstacle's way, m."""
_TURN = 0.5
"""Largest angle between the way of an obstacle across the line of sight and the normal to that line, rad."""


def sample_obstacle(
    scenario: Scenario, kind: str, centre: FloatArray, camera: FloatArray, across: bool, rng: np.random.Generator
) -> ObstacleSpec | None:
    """Draw one obstacle of that kind.

    Args:
        scenario: with the ranges.
        kind: one of ``OBSTACLE_KINDS``.
        centre: of the target, shape (3,), in base, m.
        camera: its first position, shape (3,), in base, m.
        across: place it at the first line of sight instead of anywhere around the target.
        rng: generator.

    Returns:
        None if it had to stand in the line of sight and does not.
    """
    shapes = OBSTACLE_SHAPES[kind]
    shape = shapes[int(rng.integers(len(shapes)))]
    scale = float(rng.uniform(0.8, 1.0))
    to_camera = math.atan2(camera[1] - centre[1], camera[0] - centre[0])
    if across:
        angle, radius = to_camera, rng.uniform(*((0.17, 0.24) if scenario.through_sight else (0.13, 0.20)))
        side = _sideways_offset(kind, shape, scale, rng)
    else:
        angle, radius = to_camera + rng.uniform(-2.8, 2.8), rng.uniform(0.17, 0.28)
        side = 0.0
    radial, lateral = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    x, y = centre[:2] + radius * radial + side * lateral
    yaw = to_camera + rng.uniform(-0.35, 0.35) if kind in ("mirror", "translucent") else rng.uniform(-math.pi, math.pi)
    tint = rng.uniform(0.55, 0.95, 3) * [0.75, 1.0, 1.0]
    obstacle = ObstacleSpec(
        kind=kind,
        shape=shape.name,
        scale=scale,
        position=(float(x), float(y), float(TABLE_HEIGHT + shape.half_extent[2] * scale)),
        yaw=float(yaw),
        rgba=(float(tint[0]), float(tint[1]), float(tint[2]), float(rng.uniform(*scenario.alpha))),
        texture=str(rng.choice(OBSTACLE_TEXTURES)),
        has_label=bool(rng.random() < 0.7),
    )
    if across and scenario.through_sight and not _passes_through(obstacle, camera, centre):
        return None
    if scenario.obstacle_motions:
        obstacle = _set_moving(obstacle, scenario, angle, across, rng)
    return obstacle


def sample_screen(scenario: Scenario, name: str, centre: FloatArray, rng: np.random.Generator) -> ObstacleSpec:
    """Draw a screen close to the target, as seen from where the arm comes.

    Args:
        scenario: with the range of the opacity.
        name: "low", in front of the target, or "high", behind it.
        centre: of the target, shape (3,), in base, m.
        rng: generator.
    """
    shape = obstacle_shape("screen", name)
    beyond = math.atan2(centre[1], centre[0]) + _SCREEN_AZIMUTH + rng.uniform(-_SCREEN_TURN, _SCREEN_TURN)
    bearing = beyond if name == "high" else beyond + math.pi
    radius, side = rng.uniform(*_SCREEN_GAPS[name]) + shape.half_extent[0], rng.uniform(-0.03, 0.03)
    x = centre[0] + radius * math.cos(bearing) - side * math.sin(bearing)
    y = centre[1] + radius * math.sin(bearing) + side * math.cos(bearing)
    tint = rng.uniform(0.55, 0.95, 3) * [0.75, 1.0, 1.0]
    return ObstacleSpec(
        kind="screen",
        shape=name,
        scale=1.0,
        position=(float(x), float(y), TABLE_HEIGHT + shape.half_extent[2]),
        yaw=float(bearing + math.pi),
        rgba=(float(tint[0]), float(tint[1]), float(tint[2]), float(rng.uniform(*scenario.alpha))),
        texture=OBSTACLE_TEXTURES[0],
        has_label=False,
    )


def sample_push(
    distance: tuple[float, float], start: tuple[float, float], angle: float, rng: np.random.Generator
) -> Motion:
    """A push in the direction ``angle`` in base, rad, with distance in m and start in s drawn from their ranges."""
    length = float(rng.uniform(*distance))
    displacement = (length * math.cos(angle), length * math.sin(angle))
    return Motion(float(rng.uniform(*start)), displacement, _PUSH_SPEED)


def has_room(obstacle: ObstacleSpec, reds: FloatArray, others: list[ObstacleSpec]) -> bool:
    """Whether the obstacle always stays on the table, apart from red objects and from the other obstacles.

    Args:
        obstacle: the new one.
        reds: all places of target and distractor, shape (n, 3), in base, m.
        others: obstacles that are there already.
    """
    ways, radius = _discs(obstacle)
    if not np.all((ways[:, 0] > 0.24) & (ways[:, 0] < 0.90) & (np.abs(ways[:, 1]) < 0.35)):
        return False
    if _nearest(ways, reds[:, :2]) < radius + 0.055:
        return False
    taken = [_discs(other) for other in others]
    return all(_nearest(ways, places) > radius + other_radius + 0.01 for places, other_radius in taken)


def _set_moving(
    obstacle: ObstacleSpec, scenario: Scenario, angle: float, across: bool, rng: np.random.Generator
) -> ObstacleSpec:
    """Give the obstacle a motion; ``angle`` is that from the target to it, in base, rad.

    An obstacle across the line of sight moves across it and back again, the drawn place being on the way; others are
    driven anywhere. A pushed one is at the drawn place before or after the push.
    """
    name = str(rng.choice(scenario.obstacle_motions))
    if name == "still":
        return obstacle
    side = float(rng.choice((-1.0, 1.0))) * math.pi / 2.0
    heading = angle + side + rng.uniform(-_TURN, _TURN) if across else rng.uniform(-math.pi, math.pi)
    if name == "driven":
        length = rng.uniform(*_DRIVE_LENGTH)
        displacement = (float(length * math.cos(heading)), float(length * math.sin(heading)))
        motion = Motion(0.0, displacement, float(rng.uniform(*scenario.drive_speed)), to_and_fro=True)
        share = rng.uniform(0.3, 0.7)
    else:
        motion = sample_push(scenario.obstacle_push, scenario.push_time, heading, rng)
        share = float(rng.choice((0.0, 1.0)))
    x, y = np.array(obstacle.position[:2]) - share * np.array(motion.displacement)
    return replace(obstacle, position=(float(x), float(y), obstacle.position[2]), motion=motion)


def _sideways_offset(kind: str, shape: Shape, scale: float, rng: np.random.Generator) -> float:
    """Distance of the obstacle's axis from the line of sight, m.

    What can be seen through stands right across it. What cannot stands beside it, close enough to be hit by the
    hand, so that the target is in view from the start.
    """
    if kind in ("translucent", "wire"):
        return float(rng.uniform(-0.03, 0.03))
    half_width = max(shape.half_extent[:2]) * scale
    return float(rng.choice((-1.0, 1.0)) * (half_width + rng.uniform(0.0, 0.035)))


def _passes_through(obstacle: ObstacleSpec, camera: FloatArray, centre: FloatArray) -> bool:
    """Whether the line from camera to target passes through the inner part of the obstacle's box."""
    box = obstacle.box
    c, s = math.cos(box.yaw), math.sin(box.yaw)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    begin, end = turn @ (camera - box.centre), turn @ (centre - box.centre)
    points = begin + np.linspace(0.0, 1.0, 200)[:, None] * (end - begin)
    return bool(np.any(np.all(np.abs(points) < 0.85 * box.half_extent, axis=1)))


def _discs(obstacle: ObstacleSpec) -> tuple[FloatArray, float]:
    """Discs that cover the footprint at all places on its way: centres in base, shape (n, 2), and radius, m.

    A screen is far wider than deep and takes several; one is enough for everything else.
    """
    centres = np.array([box.centre[:2] for box in obstacle.boxes])
    half_x, half_y, _ = np.array(obstacle_shape(obstacle.kind, obstacle.shape).half_extent) * obstacle.scale
    if obstacle.kind != "screen":
        return centres, math.hypot(half_x, half_y)
    count = 5
    along = np.linspace(-1.0, 1.0, count)[:, None] * half_y * (1.0 - 1.0 / count)
    return centres + along * (-math.sin(obstacle.yaw), math.cos(obstacle.yaw)), math.hypot(half_x, half_y / count)


def _nearest(first: FloatArray, second: FloatArray) -> float:
    """Smallest distance between points, shapes (n, 2) and (m, 2), m."""
    return float(np.min(np.linalg.norm(first[:, None] - second[None], axis=-1)))
