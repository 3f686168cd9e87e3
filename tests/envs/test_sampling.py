"""What every sampled scene promises."""

import colorsys
import json
from dataclasses import asdict, replace

import numpy as np
import pytest

from fixation_gym.control.corridor import approach_directions, free_directions
from fixation_gym.envs.config import OBSTACLE_KINDS, SCENARIOS
from fixation_gym.envs.object_pool import obstacle_shape, target_shape
from fixation_gym.envs.sampling import sample_scene
from fixation_gym.envs.scene import TABLE_HEIGHT, reachable_directions


def scenes(name, count=20):
    rng = np.random.default_rng(1)
    return [sample_scene(SCENARIOS[name], rng) for _ in range(count)]


def azimuths(target):
    """Azimuths that the arm can take up around a target, and some beyond, rad."""
    return np.arctan2(target[1], target[0]) + np.radians(np.linspace(0.0, 85.0, 8))


@pytest.mark.parametrize("name", SCENARIOS)
def test_scenes_stand_on_the_table_apart_from_each_other(name):
    for scene in scenes(name):
        target = scene.target
        low = target.position[2] - target_shape(target.shape).half_extent[2] * target.scale[2]
        assert low == pytest.approx(TABLE_HEIGHT)
        assert 0.025 <= 2 * target_shape(target.shape).half_extent[1] * target.scale[1] <= 0.07 + 1e-9
        assert max(target.scale) <= 1.0
        count_low, count_high = SCENARIOS[name].obstacle_count
        if not SCENARIOS[name].screen:
            assert count_low <= len(scene.obstacles) <= count_high
        for obstacle in scene.obstacles:
            half = obstacle_shape(obstacle.kind, obstacle.shape).half_extent[2] * obstacle.scale
            assert obstacle.position[2] - half == pytest.approx(TABLE_HEIGHT)
            assert np.linalg.norm(np.subtract(obstacle.position, target.position)[:2]) > 0.07


def test_the_same_generator_state_gives_the_same_scene_and_another_another():
    first, again, other = (sample_scene(SCENARIOS["opaque"], np.random.default_rng(s)) for s in (3, 3, 4))
    assert first == again
    assert first != other


def test_reachable_directions_look_down_on_the_target():
    directions = reachable_directions(np.array([0.5, 0.1, -0.08]))
    assert np.all(directions[:, 2] > 0.5)


@pytest.mark.parametrize("name", [name for name, scenario in SCENARIOS.items() if scenario.obstacle_kinds])
def test_the_first_way_is_blocked_and_others_stay_free_whatever_moves(name):
    for scene in scenes(name):
        for end in (scene.target.places[0], scene.target.places[-1]):
            boxes = [box for obstacle in scene.obstacles for box in obstacle.boxes]
            assert free_directions(end, boxes, reachable_directions(end), 0.01).mean() >= 0.2
        start = np.array(scene.camera_position) - scene.target.places[-1]
        assert not free_directions(scene.target.places[-1], boxes, start[None] / np.linalg.norm(start), 0.0)[0]


def test_a_screen_stands_alone_close_to_the_target_low_in_front_or_high_behind():
    sides = {"low": 0, "high": 0}
    for scene in scenes("screen", 40):
        (screen,) = scene.obstacles
        sides[screen.shape] += 1
        offset = np.subtract(screen.position, scene.target.position)[:2]
        pane = offset + (screen.box.half_extent[0] - 0.006) * np.array([np.cos(screen.yaw), np.sin(screen.yaw)])
        assert np.linalg.norm(pane) < 0.13
        to_arm = np.radians(225.0) + np.arctan2(scene.target.position[1], scene.target.position[0])
        in_front = offset @ [np.cos(to_arm), np.sin(to_arm)] > 0.0
        assert in_front == (screen.shape == "low")
    assert min(sides.values()) >= 12


def test_coloured_frames_change_nothing_else_and_are_never_red():
    colours = []
    for seed in range(40):
        plain, coloured = (
            sample_scene(SCENARIOS[name], np.random.default_rng(seed)) for name in ("screen", "screen_coloured")
        )
        assert replace(coloured, obstacles=plain.obstacles) == plain
        for dark, bright in zip(plain.obstacles, coloured.obstacles, strict=True):
            assert replace(bright, frame_rgba=dark.frame_rgba) == dark
            colours.append(bright.frame_rgba[:3])
    hues, _, values = np.array([colorsys.rgb_to_hsv(*colour) for colour in colours]).T
    assert np.all((hues > 0.12) & (hues < 0.88) | (np.ptp(colours, axis=1) == 0.0))
    assert values.min() < 0.3
    assert values.max() > 0.8


def test_no_single_way_is_free_in_front_of_a_high_and_behind_a_low_screen():
    free = {"low": [], "high": []}
    for scene in scenes("screen", 80):
        target = np.array(scene.target.position)
        ways = approach_directions(azimuths(target), np.radians(np.linspace(40.0, 85.0, 10)))
        (screen,) = scene.obstacles
        free[screen.shape].append(free_directions(target, [screen.box], ways, 0.0))
    share_low, share_high = np.mean(free["low"], axis=0), np.mean(free["high"], axis=0)
    assert np.minimum(share_low, share_high).max() < 0.2
    low, steep = np.arange(80) % 10 < 4, np.arange(80) % 10 > 6  # to 55 degrees, from 75 on
    assert min(mask[steep].mean() for mask in free["low"]) > 0.1
    assert min(mask[low].mean() for mask in free["high"]) > 0.1


@pytest.mark.parametrize("name", ["clear", "opaque", "translucent", "mirror", "line_of_sight"])
def test_nothing_moves_unless_the_scenario_says_so(name):
    for scene in scenes(name, 5):
        assert scene.distractor is None
        assert scene.target.motion is None
        assert all(obstacle.motion is None for obstacle in scene.obstacles)


def test_the_first_line_of_sight_passes_through_something_see_through():
    for scene in scenes("line_of_sight"):
        first = scene.obstacles[0]
        assert first.kind in ("translucent", "wire")
        camera, target = np.array(scene.camera_position), np.array(scene.target.position)
        points = camera + np.linspace(0.0, 1.0, 400)[:, None] * (target - camera)
        c, s = np.cos(first.yaw), np.sin(first.yaw)
        local = (points - first.box.centre) @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        assert np.any(np.all(np.abs(local) < first.box.half_extent, axis=1))


def test_moving_obstacles_are_driven_or_pushed_within_the_stated_limits_apart_from_all_else():
    kinds = set()
    for scene in scenes("moving_obstacle"):
        for obstacle in scene.obstacles:
            motion = obstacle.motion
            kinds.add(motion.to_and_fro)
            if motion.to_and_fro:
                assert 0.03 <= motion.speed <= 0.10
            else:
                assert 0.04 <= motion.length <= 0.10
                assert 2.0 <= motion.start_s <= 6.0
            for box in obstacle.boxes:
                assert np.linalg.norm(box.centre[:2] - scene.target.position[:2]) > 0.07
    assert kinds == {True, False}


def test_a_pushed_target_stays_within_reach():
    for scene in scenes("moving_target"):
        motion = scene.target.motion
        assert not motion.to_and_fro
        assert 0.03 <= motion.length <= 0.08
        assert 2.0 <= motion.start_s <= 6.0
        x, y, _ = scene.target.places[-1]
        assert 0.46 < x < 0.66
        assert abs(y) < 0.18


def test_the_target_is_the_red_object_nearer_to_the_first_image_centre():
    for scene in scenes("distractor"):
        camera = np.array(scene.camera_position)
        axis = np.array(scene.gaze_point) - camera
        angles = []
        for red in (scene.target, scene.distractor):
            ray = np.array(red.position) - camera
            angles.append(np.arccos(ray @ axis / np.linalg.norm(ray) / np.linalg.norm(axis)))
        assert angles[1] > 1.3 * angles[0]
        assert np.linalg.norm(np.subtract(scene.target.position, scene.distractor.position)) > 0.1


def test_mixed_draws_from_everything_and_survives_json():
    drawn = scenes("mixed", 60)
    obstacles = [obstacle for scene in drawn for obstacle in scene.obstacles]
    assert {obstacle.kind for obstacle in obstacles} == set(OBSTACLE_KINDS)
    motions = [obstacle.motion for obstacle in obstacles]
    assert {motion if motion is None else motion.to_and_fro for motion in motions} == {None, True, False}
    assert {scene.distractor is None for scene in drawn} == {True, False}
    assert {scene.target.motion is None for scene in drawn} == {True, False}
    assert max(len(scene.obstacles) for scene in drawn) > 2
    json.dumps([asdict(scene) for scene in drawn])
