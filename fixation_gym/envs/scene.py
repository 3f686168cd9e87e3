"""Sampling of scenes: what stands where and from where the robot first looks. Pure: one generator in, one value out."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fixation_gym.control.corridor import Box, approach_directions, free_directions
from fixation_gym.envs.config import Scenario
from fixation_gym.envs.object_pool import OBSTACLE_SHAPES, Shape, Vector, obstacle_shape, target_shape
from fixation_gym.types import FloatArray

TABLE_HEIGHT = -0.112
"""Height of the table top in the robot base frame, m."""
TARGET_REGION = ((0.50, 0.62), (-0.14, 0.14))
"""Ranges of x and y in which the target is placed, in base, m."""
APPROACH_AZIMUTHS = np.radians(np.linspace(0.0, 75.0, 6))
APPROACH_ELEVATIONS = np.radians(np.linspace(45.0, 83.0, 5))
"""Directions, relative to the bearing of the target, from which the arm can reach it; one must be free of obstacles."""
OBSTACLE_TEXTURES = ("wood_light", "wood_dark", "wood_plain", "bricks", "metal")
_CLEARANCE = 0.015
_LEAST_FREE = 0.3
"""Least share of the reachable directions that must be free with ``_CLEARANCE`` m to spare."""
_ATTEMPTS = 500


@dataclass(frozen=True)
class TargetSpec:
    """The red object: shape, scale per axis, centre in base in m, rotation about the vertical in rad."""

    shape: str
    scale: Vector
    position: Vector
    yaw: float


@dataclass(frozen=True)
class ObstacleSpec:
    """One obstacle, centre in base in m; ``texture`` dresses solid parts, ``rgba`` the see-through ones."""

    kind: str
    shape: str
    scale: float
    position: Vector
    yaw: float
    rgba: tuple[float, float, float, float]
    texture: str
    has_label: bool

    @property
    def box(self) -> Box:
        """Upright box around the obstacle, in base."""
        half = np.array(obstacle_shape(self.kind, self.shape).half_extent) * self.scale
        return Box(np.array(self.position), half, self.yaw)


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


def sample_scene(scenario: Scenario, rng: np.random.Generator) -> SceneSpec:
    """Draw a scene in which something hinders the straight approach, yet some approach is free.

    Raises:
        RuntimeError: if the scenario's sizes leave no room for such a scene.
    """
    for _ in range(_ATTEMPTS):
        scene = _propose(scenario, rng)
        if scene is not None:
            return scene
    raise RuntimeError(
        f"no solvable scene found in {_ATTEMPTS} draws for scenario {scenario.name!r}; use fewer obstacles"
    )


def reachable_directions(target: FloatArray) -> FloatArray:
    """Unit vectors from the target to the camera that the arm can take up, shape (n, 3), in base."""
    bearing = math.atan2(target[1], target[0])
    return approach_directions(bearing + APPROACH_AZIMUTHS, APPROACH_ELEVATIONS)


def _propose(scenario: Scenario, rng: np.random.Generator) -> SceneSpec | None:
    target = _sample_target(scenario, rng)
    centre = np.array(target.position)
    camera, gaze = _sample_view(centre, rng)
    count = int(rng.integers(scenario.obstacle_count[0], scenario.obstacle_count[1] + 1))
    obstacles: list[ObstacleSpec] = []
    for index in range(count):
        kind = str(rng.choice(scenario.obstacle_kinds))
        if kind == "mirror" and any(obstacle.kind == "mirror" for obstacle in obstacles):
            return None
        across = index == 0
        obstacle = _sample_obstacle(scenario, kind, centre, camera, across, rng)
        if not _has_room(obstacle, centre, obstacles):
            return None
        obstacles.append(obstacle)
    boxes = [obstacle.box for obstacle in obstacles]
    if free_directions(centre, boxes, reachable_directions(centre), _CLEARANCE).mean() < _LEAST_FREE:
        return None
    start = (camera - centre) / np.linalg.norm(camera - centre)
    if boxes and free_directions(centre, boxes, start[None], 0.0)[0]:
        return None
    light = rng.uniform(-0.5, 0.5, 2)
    return SceneSpec(
        target=target,
        obstacles=tuple(obstacles),
        camera_position=_vector(camera),
        gaze_point=_vector(gaze),
        light_direction=(float(light[0]), float(light[1]), -1.0),
        table_texture=str(rng.choice(("table_wood", "table_plank", "table_felt"))),
    )


def _sample_target(scenario: Scenario, rng: np.random.Generator) -> TargetSpec:
    shape = target_shape(str(rng.choice(scenario.target_shapes)))
    width = rng.uniform(*scenario.grasp_width)
    ratio = width / (2.0 * shape.half_extent[1])
    # Thin boxes and cylinders are taller than wide, so that oblique fingers reach them above the table.
    slender = shape.name in ("box", "cylinder")
    height_ratio = min(1.0, ratio * rng.uniform(1.0, 1.6)) if slender else ratio
    length_ratio = min(1.0, ratio * rng.uniform(1.0, 1.3)) if shape.name == "box" else ratio
    scale = (float(length_ratio), float(ratio), float(height_ratio))
    x, y = (rng.uniform(*bounds) for bounds in TARGET_REGION)
    z = TABLE_HEIGHT + shape.half_extent[2] * height_ratio
    return TargetSpec(shape.name, scale, (float(x), float(y), float(z)), float(rng.uniform(-math.pi, math.pi)))


def _sample_view(centre: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Camera position and the point it looks at, both in base."""
    bearing = math.atan2(centre[1], centre[0])
    azimuth = bearing + math.radians(rng.uniform(35.0, 60.0))
    elevation = math.radians(rng.uniform(40.0, 52.0))
    distance = rng.uniform(0.42, 0.50)
    direction = approach_directions(np.array([azimuth]), np.array([elevation]))[0]
    gaze_error = rng.uniform(-0.06, 0.06, 3) * [1.0, 1.0, 0.0]
    return centre + distance * direction, centre + gaze_error


def _sample_obstacle(
    scenario: Scenario, kind: str, centre: FloatArray, camera: FloatArray, across: bool, rng: np.random.Generator
) -> ObstacleSpec:
    shapes = OBSTACLE_SHAPES[kind]
    shape = shapes[int(rng.integers(len(shapes)))]
    scale = float(rng.uniform(0.8, 1.0))
    to_camera = math.atan2(camera[1] - centre[1], camera[0] - centre[0])
    if across:
        angle, radius = to_camera, rng.uniform(0.13, 0.20)
        side = _sideways_offset(kind, shape, scale, rng)
    else:
        angle, radius = to_camera + rng.uniform(-2.8, 2.8), rng.uniform(0.17, 0.28)
        side = 0.0
    radial, lateral = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    x, y = centre[:2] + radius * radial + side * lateral
    yaw = to_camera + rng.uniform(-0.35, 0.35) if kind in ("mirror", "translucent") else rng.uniform(-math.pi, math.pi)
    tint = rng.uniform(0.55, 0.95, 3) * [0.75, 1.0, 1.0]
    return ObstacleSpec(
        kind=kind,
        shape=shape.name,
        scale=scale,
        position=(float(x), float(y), float(TABLE_HEIGHT + shape.half_extent[2] * scale)),
        yaw=float(yaw),
        rgba=(float(tint[0]), float(tint[1]), float(tint[2]), float(rng.uniform(*scenario.alpha))),
        texture=str(rng.choice(OBSTACLE_TEXTURES)),
        has_label=bool(rng.random() < 0.7),
    )


def _sideways_offset(kind: str, shape: Shape, scale: float, rng: np.random.Generator) -> float:
    """Distance of the obstacle's axis from the line of sight, m.

    What can be seen through stands right across it. What cannot stands beside it, close enough to be hit by the
    hand, so that the target is in view from the start.
    """
    if kind in ("translucent", "wire"):
        return float(rng.uniform(-0.03, 0.03))
    half_width = max(shape.half_extent[:2]) * scale
    return float(rng.choice((-1.0, 1.0)) * (half_width + rng.uniform(0.0, 0.035)))


def _has_room(obstacle: ObstacleSpec, centre: FloatArray, others: list[ObstacleSpec]) -> bool:
    """Whether the footprint is on the table, apart from the target and from the other obstacles."""
    position, radius = np.array(obstacle.position[:2]), _footprint_radius(obstacle)
    if not (0.24 < position[0] < 0.90 and abs(position[1]) < 0.35):
        return False
    if np.linalg.norm(position - centre[:2]) < radius + 0.055:
        return False
    return all(
        np.linalg.norm(position - other.position[:2]) > radius + _footprint_radius(other) + 0.01 for other in others
    )


def _footprint_radius(obstacle: ObstacleSpec) -> float:
    half = obstacle_shape(obstacle.kind, obstacle.shape).half_extent
    return math.hypot(half[0], half[1]) * obstacle.scale


def _vector(values: FloatArray) -> Vector:
    return (float(values[0]), float(values[1]), float(values[2]))
