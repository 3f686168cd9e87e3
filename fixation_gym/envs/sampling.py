"""Sampling of scenes: the free way is drawn first, then obstacles are placed until all other ways are barred.

A way is straight, level and comes from some direction of the arm's reach. The free one may come from anywhere in it,
so no habit can know it; a cone around it stays free with room to spare, whatever moves (``goal.py``). Obstacles are
drawn that leave it, and those are taken that bar the first line of sight, the ways from above and most others
(``barriers.py``). Pure: one generator in, one value out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np

from fixation_gym.control.corridor import free_directions
from fixation_gym.control.reach import sample_direction
from fixation_gym.envs.barriers import View, add_movers, bar_ways, draw_pool, with_some_across
from fixation_gym.envs.config import Scenario
from fixation_gym.envs.drafts import Menu, menu_of
from fixation_gym.envs.goal import Goal, direction_of, sample_goal, sample_target
from fixation_gym.envs.looks import TABLE_TEXTURES, dressed
from fixation_gym.envs.pool_slots import fits_pool
from fixation_gym.envs.room import FREE_ROOM
from fixation_gym.envs.scene import ObstacleSpec, SceneSpec, TargetSpec
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, Vector

_VIEW_DISTANCE = (0.42, 0.49)
"""Range of the distance between camera and target at the start, m."""
_DISTRACTOR_DISTANCE = (0.12, 0.22)
"""Range of the distance between target and distractor, m."""
_ELEVATION_SHAPE = (0.5, 0.65)
"""Beta distribution of the free way's elevation. Evenly drawn, ways in the middle would be free most often, for there
are ways on all sides of them that take them along; so the ends come up more."""
_ELEVATIONS, _AZIMUTHS, _TARGETS = 6, 8, 40
"""Elevations of the free way, azimuths for each and targets for each of those that are tried."""
_VIEWS, _VIEW_DRAWS = 4, 24
"""First views apart from the free way that are tried for each target, and views that are drawn for that."""


def sample_scene(scenario: Scenario, rng: np.random.Generator) -> SceneSpec:
    """Draw a scene with a free way that cannot be guessed.

    Raises:
        RuntimeError: if the scenario leaves no room for such a scene.
    """
    scenario = _with_events_drawn(scenario, rng)
    menu = menu_of(scenario)
    for free in _free_ways(scenario, rng):
        scene = _propose(scenario, menu, free, rng)
        if scene is not None:
            return scene
    raise RuntimeError(
        f"no scene of scenario {scenario.name!r} found for {_ELEVATIONS * _AZIMUTHS} free ways; allow more obstacles, "
        "more kinds of them, or another range of free_elevation_deg"
    )


def _free_ways(scenario: Scenario, rng: np.random.Generator) -> Iterator[tuple[float, float]]:
    """Azimuth and elevation, rad, of the free ways to try.

    The same is tried again and again, or those that are easily left free would come up more often.
    """
    low, high = (math.radians(angle) for angle in scenario.free_elevation_deg)
    for _ in range(_ELEVATIONS):
        elevation = low + (high - low) * float(rng.beta(*_ELEVATION_SHAPE))
        for _ in range(_AZIMUTHS):
            free = sample_direction(rng, elevation, scenario.free_azimuth_shape)
            for _ in range(_TARGETS):
                yield free


def _with_events_drawn(scenario: Scenario, rng: np.random.Generator) -> Scenario:
    """The scenario with chances and counts drawn once: drawn with every try, what has room easily would win."""
    moving = int(rng.integers(scenario.moving_count[0], scenario.moving_count[1] + 1))
    return replace(
        scenario,
        target_moves=float(rng.random() < scenario.target_moves),
        distractor=float(rng.random() < scenario.distractor),
        moving_count=(moving, moving),
    )


def _propose(scenario: Scenario, menu: Menu, free: tuple[float, float], rng: np.random.Generator) -> SceneSpec | None:
    goal = sample_goal(scenario, free, rng)
    pool = draw_pool(scenario, menu, goal, rng) if scenario.has_obstacles else None
    views = (_sample_view(scenario, goal, rng) for _ in range(_VIEW_DRAWS))
    if not scenario.has_obstacles:
        view = next((view for view in views if view), None)
        return None if view is None else _scene(scenario, goal, view, (), rng)
    if pool is None:
        return None
    for view in islice((view for view in views if view and view.is_apart(goal)), _VIEWS):
        within = with_some_across(menu, goal, view, pool, rng) if scenario.through_sight else pool
        barriers = bar_ways(scenario, goal, view, within, rng)
        placed = None if barriers is None else add_movers(scenario, goal, view, barriers, rng)
        if placed is not None and fits_pool(placed):
            return _scene(scenario, goal, view, tuple(placed), rng)
    return None


def _scene(
    scenario: Scenario, goal: Goal, view: View, obstacles: tuple[ObstacleSpec, ...], rng: np.random.Generator
) -> SceneSpec:
    light = scenario.light_slant * rng.uniform(-0.5, 0.5, 2)
    scene = SceneSpec(
        target=goal.target,
        obstacles=obstacles,
        camera_position=_vector(view.camera),
        gaze_point=_vector(view.gaze),
        light_direction=(float(light[0]), float(light[1]), -1.0),
        table_texture=str(rng.choice(TABLE_TEXTURES)),
        distractor=view.distractor,
        free_way=(goal.free.azimuth, goal.free.elevation) if obstacles else None,
    )
    return dressed(scenario, scene, rng)


def _sample_view(scenario: Scenario, goal: Goal, rng: np.random.Generator) -> View | None:
    """Draw the first view, and another red thing if there is to be one; None if that does not fit."""
    x, y, z = goal.target.position
    reach = ROBOT.arm.reach
    lowest, highest = (math.radians(angle) for angle in reach.start_deg)
    low, high = (math.radians(angle) for angle in scenario.view_elevation_deg)
    azimuth, elevation = rng.uniform(lowest, highest), rng.uniform(low, high)
    direction = direction_of(math.atan2(y, x) + azimuth, elevation)
    camera = goal.target.position + rng.uniform(*_VIEW_DISTANCE) * direction
    if math.hypot(camera[0], camera[1]) < reach.folded:
        return None
    aside = rng.uniform(-0.06, 0.06, 3)
    gaze = np.array([x + aside[0], y + aside[1], z])
    distractor = None
    if scenario.distractor:
        distractor = _sample_distractor(scenario, goal.target, rng)
        if not _told_apart(goal.target, distractor, camera, gaze):
            return None
        way = goal.free.direction[None]
        if not all(free_directions(end, [distractor.box], way, FREE_ROOM)[0] for end in goal.room.ends):
            return None
    return View(camera, gaze, int(np.argmax(goal.ways @ direction)), distractor)


def _sample_distractor(scenario: Scenario, target: TargetSpec, rng: np.random.Generator) -> TargetSpec:
    """Another red object, not farther from the target than the hand is wide."""
    red = sample_target(scenario, rng)
    angle, distance = rng.uniform(-math.pi, math.pi), rng.uniform(*_DISTRACTOR_DISTANCE)
    x, y = target.position[0] + distance * math.cos(angle), target.position[1] + distance * math.sin(angle)
    return replace(red, position=(float(x), float(y), red.position[2]))


def _told_apart(target: TargetSpec, distractor: TargetSpec, camera: FloatArray, gaze: FloatArray) -> bool:
    """Whether the target is clearly the one nearer to the image centre."""
    if np.linalg.norm(target.places - distractor.position, axis=1).min() < 0.10:
        return False
    axis = (gaze - camera) / np.linalg.norm(gaze - camera)
    offsets = []
    for red in (target, distractor):
        ray = np.array(red.position) - camera
        offsets.append(float(np.linalg.norm(ray - (ray @ axis) * axis)) / float(ray @ axis))
    return offsets[1] >= 1.5 * offsets[0] + 0.05


def _vector(values: FloatArray) -> Vector:
    return (float(values[0]), float(values[1]), float(values[2]))
