"""Sampling of scenes: something hinders the straight approach, or that from above, yet some approach is free.

Pure: one generator in, one value out. A scene is proposed part by part and rejected as a whole, so every part is drawn
as if the others were not there.
"""

from __future__ import annotations

import colorsys
import math
from dataclasses import replace

import numpy as np

from fixation_gym.control.corridor import Box, approach_directions, free_directions
from fixation_gym.envs.config import Scenario
from fixation_gym.envs.object_pool import Vector, target_shape
from fixation_gym.envs.placement import has_room, sample_obstacle, sample_push, sample_screen
from fixation_gym.envs.scene import (
    APPROACH_AZIMUTHS,
    TABLE_HEIGHT,
    TARGET_REGION,
    ObstacleSpec,
    SceneSpec,
    TargetSpec,
    reachable_directions,
)
from fixation_gym.geometry.rigid import look_at
from fixation_gym.robot import TOOL_IN_CAMERA
from fixation_gym.types import FloatArray

_PUSHED_REGION = ((0.46, 0.66), (-0.18, 0.18))
"""Ranges of x and y in which a push may leave it, in base, m."""
_CLEARANCE = 0.015
_LEAST_FREE = 0.2
"""Least share of the reachable directions that must be free with ``_CLEARANCE`` m to spare; with a screen, of those of
the kind that it does not bar, with nothing to spare."""
_CLIMBS = np.radians([0.0, 5.0, 10.0, 15.0])
"""Rises of the hand on its way, as servo policies climb, along all of which the straight approach must be hindered."""
_LOW, _STEEP = np.radians([45.0, 50.0, 55.0]), np.radians([75.0, 79.0, 83.0])
"""Elevations of low ways and of those from above: a screen must bar all of one kind and leave some of the other."""
_DISTRACTOR_DISTANCE = (0.12, 0.22)
"""Range of the distance between target and distractor, m."""
_FRAME_HUES = (1.0 / 8.0, 7.0 / 8.0)
"""Range of the hue of coloured frames, 0..1: anything but the target's red."""
_START_ROOM = 0.10
"""Least distance between the point between the finger tips and obstacles at the start, m; half the hand is 5 cm."""
_ATTEMPTS = 1000


def sample_scene(scenario: Scenario, rng: np.random.Generator) -> SceneSpec:
    """Draw a scene in which something hinders the straight approach, yet some approach is free all the time.

    With a high screen it is the approach from above that is hindered.

    Raises:
        RuntimeError: if the scenario's sizes leave no room for such a scene.
    """
    screen = str(rng.choice(("low", "high"))) if scenario.screen else None
    for _ in range(_ATTEMPTS):
        scene = _propose(scenario, screen, rng)
        if scene is not None:
            return scene
    raise RuntimeError(
        f"no solvable scene found in {_ATTEMPTS} draws for scenario {scenario.name!r}; use fewer obstacles"
    )


def _propose(scenario: Scenario, screen: str | None, rng: np.random.Generator) -> SceneSpec | None:
    target = _sample_target(scenario, rng)
    centre = np.array(target.position)
    camera, gaze = _sample_view(scenario, centre, rng)
    if scenario.target_moves > 0.0 and rng.random() < scenario.target_moves:
        target = _pushed(target, scenario, rng)
    distractor = None
    if scenario.distractor > 0.0 and rng.random() < scenario.distractor:
        distractor = _sample_distractor(scenario, target, rng)
        if not _told_apart(target, distractor, camera, gaze):
            return None
    obstacles = _sample_obstacles(scenario, target, distractor, camera, screen, rng)
    if obstacles is None:
        return None
    boxes = _boxes(obstacles, distractor)
    if not (_decides(target, boxes, screen) if screen else _is_solvable(target, boxes)):
        return None
    if obstacles and not _has_start_room(obstacles, camera, gaze):
        return None
    if obstacles and not (screen or _hinders(target, obstacles, camera)):
        return None
    light = rng.uniform(-0.5, 0.5, 2)
    scene = SceneSpec(
        target=target,
        obstacles=obstacles,
        camera_position=_vector(camera),
        gaze_point=_vector(gaze),
        light_direction=(float(light[0]), float(light[1]), -1.0),
        table_texture=str(rng.choice(("table_wood", "table_plank", "table_felt"))),
        distractor=distractor,
    )
    # From a generator of their own: nothing else of the episode, its sensor noise included, depends on the colours.
    return _with_coloured_frames(scene, rng.spawn(1)[0]) if scenario.coloured_frames else scene


# -- what a scene must be ------------------------------------------------------------------------------------------


def _boxes(obstacles: tuple[ObstacleSpec, ...], distractor: TargetSpec | None) -> list[Box]:
    """Boxes around all that may be hit, at all places where it ever is."""
    boxes = [box for obstacle in obstacles for box in obstacle.boxes]
    return boxes if distractor is None else [*boxes, distractor.box]


def _is_solvable(target: TargetSpec, boxes: list[Box]) -> bool:
    """Whether enough directions are free, wherever the target is."""
    ends = target.places[[0, -1]] if target.motion else target.places[:1]
    return all(free_directions(end, boxes, reachable_directions(end), _CLEARANCE).mean() >= _LEAST_FREE for end in ends)


def _hinders(target: TargetSpec, obstacles: tuple[ObstacleSpec, ...], camera: FloatArray) -> bool:
    """Whether the way along the first line of sight is blocked in the end, also for a hand that rises on its way.

    What is driven counts at the middle of its way.
    """
    boxes = [_lasting_box(obstacle) for obstacle in obstacles]
    centre = target.places[-1]
    start = camera - centre
    azimuth, elevation = math.atan2(-start[1], -start[0]), math.atan2(start[2], math.hypot(start[0], start[1]))
    ways = approach_directions(np.array([azimuth]), np.minimum(elevation + _CLIMBS, math.radians(80.0)))
    return not free_directions(centre, boxes, ways, 0.0).any()


def _decides(target: TargetSpec, boxes: list[Box], screen: str) -> bool:
    """Whether a low screen bars all low ways and leaves some from above, or a high one the other way round."""
    bearing = math.atan2(target.position[1], target.position[0])
    barred, left = (_LOW, _STEEP) if screen == "low" else (_STEEP, _LOW)
    for place in target.places[[0, -1]]:
        if free_directions(place, boxes, approach_directions(bearing + APPROACH_AZIMUTHS, barred), 0.0).any():
            return False
        ways = approach_directions(bearing + APPROACH_AZIMUTHS, left)
        if free_directions(place, boxes, ways, 0.0).mean() < _LEAST_FREE:
            return False
    return True


def _has_start_room(obstacles: tuple[ObstacleSpec, ...], camera: FloatArray, gaze: FloatArray) -> bool:
    """Whether the finger tips, while the hand looks around where it starts, are apart from all places of obstacles."""
    pose = look_at(camera, gaze, np.array([0.0, 0.0, 1.0]))
    tool = pose[:3, 3] + pose[:3, :3] @ TOOL_IN_CAMERA
    for box in (box for obstacle in obstacles for box in obstacle.boxes):
        c, s = math.cos(box.yaw), math.sin(box.yaw)
        x, y, z = tool - box.centre
        outside = np.abs([c * x + s * y, c * y - s * x, z]) - box.half_extent
        if np.linalg.norm(np.maximum(outside, 0.0)) < _START_ROOM:
            return False
    return True


def _lasting_box(obstacle: ObstacleSpec) -> Box:
    boxes, motion = obstacle.boxes, obstacle.motion
    return boxes[len(boxes) // 2] if motion is not None and motion.to_and_fro else boxes[-1]


def _told_apart(target: TargetSpec, distractor: TargetSpec, camera: FloatArray, gaze: FloatArray) -> bool:
    """Whether the target is clearly the one nearer to the image centre, and the straight way to it is free."""
    axis = (gaze - camera) / np.linalg.norm(gaze - camera)
    offsets = []
    for red in (target, distractor):
        ray = np.array(red.position) - camera
        offsets.append(float(np.linalg.norm(ray - (ray @ axis) * axis)) / float(ray @ axis))
    if offsets[1] < 1.5 * offsets[0] + 0.05:
        return False
    start = camera - target.position
    return bool(
        free_directions(np.array(target.position), [distractor.box], start[None] / np.linalg.norm(start), 0.0)[0]
    )


# -- parts of a scene ----------------------------------------------------------------------------------------------


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


def _sample_view(scenario: Scenario, centre: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Camera position and the point it looks at, both in base."""
    bearing = math.atan2(centre[1], centre[0])
    azimuth = bearing + math.radians(rng.uniform(35.0, 60.0))
    elevation = math.radians(rng.uniform(*scenario.view_elevation_deg))
    distance = rng.uniform(0.42, 0.50)
    direction = approach_directions(np.array([azimuth]), np.array([elevation]))[0]
    gaze_error = rng.uniform(-0.06, 0.06, 3) * [1.0, 1.0, 0.0]
    return centre + distance * direction, centre + gaze_error


def _pushed(target: TargetSpec, scenario: Scenario, rng: np.random.Generator) -> TargetSpec:
    """The target with a push that leaves it within reach."""
    while True:
        motion = sample_push(scenario.target_push, scenario.push_time, rng.uniform(-math.pi, math.pi), rng)
        end = np.add(target.position[:2], motion.displacement)
        if all(low < value < high for value, (low, high) in zip(end, _PUSHED_REGION, strict=True)):
            return replace(target, motion=motion)


def _sample_distractor(scenario: Scenario, target: TargetSpec, rng: np.random.Generator) -> TargetSpec:
    """Another red object, not farther from the target than the hand is wide."""
    red = _sample_target(scenario, rng)
    angle, distance = rng.uniform(-math.pi, math.pi), rng.uniform(*_DISTRACTOR_DISTANCE)
    x, y = target.position[0] + distance * math.cos(angle), target.position[1] + distance * math.sin(angle)
    return replace(red, position=(float(x), float(y), red.position[2]))


def _sample_obstacles(
    scenario: Scenario,
    target: TargetSpec,
    distractor: TargetSpec | None,
    camera: FloatArray,
    screen: str | None,
    rng: np.random.Generator,
) -> tuple[ObstacleSpec, ...] | None:
    """Obstacles with room for each, or a screen alone; None if there is no room."""
    count = int(rng.integers(scenario.obstacle_count[0], scenario.obstacle_count[1] + 1))
    reds = target.places if distractor is None else np.concatenate([target.places, distractor.places])
    if distractor is not None and np.linalg.norm(target.places - distractor.position, axis=1).min() < 0.10:
        return None
    if screen is not None:
        alone = sample_screen(scenario, screen, np.array(target.position), rng)
        return (alone,) if has_room(alone, reds, []) else None
    obstacles: list[ObstacleSpec] = []
    for index in range(count):
        kind = str(rng.choice(scenario.obstacle_kinds))
        if kind == "mirror" and any(obstacle.kind == "mirror" for obstacle in obstacles):
            return None
        obstacle = sample_obstacle(scenario, kind, np.array(target.position), camera, index == 0, rng)
        if obstacle is None or not has_room(obstacle, reds, obstacles):
            return None
        obstacles.append(obstacle)
    return tuple(obstacles)


def _with_coloured_frames(scene: SceneSpec, rng: np.random.Generator) -> SceneSpec:
    obstacles = []
    for obstacle in scene.obstacles:
        red, green, blue = colorsys.hsv_to_rgb(rng.uniform(*_FRAME_HUES), rng.uniform(0.0, 1.0), rng.uniform(0.1, 1.0))
        obstacles.append(replace(obstacle, frame_rgba=(red, green, blue, 1.0)))
    return replace(scene, obstacles=tuple(obstacles))


def _vector(values: FloatArray) -> Vector:
    return (float(values[0]), float(values[1]), float(values[2]))
