"""What every sampled scene promises."""

import colorsys
import json
from dataclasses import asdict, replace
from functools import cache

import numpy as np
import pytest

from fixation_gym.control.box_tests import any_meets, boxes_meet
from fixation_gym.control.corridor import free_directions, hand_axes, hand_boxes, swept_hand
from fixation_gym.control.reach import REACH_GRID, reachable_directions
from fixation_gym.envs.config import SCENARIOS, Scenario
from fixation_gym.envs.goal import Way
from fixation_gym.envs.object_pool import target_shape
from fixation_gym.envs.pool_slots import fits_pool
from fixation_gym.envs.sampling import sample_scene
from fixation_gym.envs.shapes import PLAIN_MATERIALS
from fixation_gym.envs.visibility import visible_share
from fixation_gym.geometry.boxes import box_set, joined
from fixation_gym.geometry.rigid import look_at
from fixation_gym.robots import ROBOT

CROWDED = [name for name, scenario in SCENARIOS.items() if scenario.obstacle_materials]


@cache
def scenes(name, count=5):
    rng = np.random.default_rng(1)
    return [sample_scene(SCENARIOS[name], rng) for _ in range(count)]


def still_boxes(scene):
    return joined([obstacle.boxes for obstacle in scene.obstacles if obstacle.motion is None])


@pytest.mark.parametrize("name", SCENARIOS)
def test_scenes_stand_on_the_table_apart_from_each_other(name):
    for scene in scenes(name):
        target = scene.target
        low = target.position[2] - target_shape(target.shape).half_extent[2] * target.scale[2]
        assert low == pytest.approx(ROBOT.workspace.table_height)
        assert 0.025 <= 2 * target_shape(target.shape).half_extent[1] * target.scale[1] <= 0.07 + 1e-9
        assert max(target.scale) <= 1.0
        assert fits_pool(scene.obstacles)
        still = [obstacle for obstacle in scene.obstacles if obstacle.motion is None]
        least, most = SCENARIOS[name].obstacle_count
        assert least <= len(still) <= most
        for index, obstacle in enumerate(scene.obstacles):
            boxes = obstacle.boxes
            lowest = boxes.centres[:, 2] - np.einsum("nj,nj->n", np.abs(boxes.rotations[:, 2]), boxes.halves)
            assert lowest.min() == pytest.approx(ROBOT.workspace.table_height, abs=1e-9)
            assert not boxes_meet(boxes, box_set([target.box]), 0.01)
            others = [other.boxes for other in scene.obstacles[:index]]
            assert not others or not boxes_meet(boxes, joined(others), 0.005)


@pytest.mark.parametrize("name", CROWDED)
def test_the_free_way_is_free_with_room_wherever_the_target_is_and_whatever_moves(name):
    for scene in scenes(name):
        boxes = joined([obstacle.boxes for obstacle in scene.obstacles])
        way = Way(*scene.free_way).direction[None]
        for place in scene.target.places[[0, -1]]:
            assert free_directions(place, boxes, way, 0.01).all()


@pytest.mark.parametrize("name", CROWDED)
def test_the_first_line_of_sight_and_most_other_ways_are_barred(name):
    for scene in scenes(name):
        end = scene.target.places[-1]
        smaller = swept_hand(-0.01, wrist=False)  # a way is barred if even a hand that is smaller by 1 cm touches
        free = ~any_meets(end, hand_axes(reachable_directions(end)), still_boxes(scene), smaller)
        assert free.mean() <= 0.33
        steep = REACH_GRID[:, 1] > np.radians(75.0)
        near_free = reachable_directions(end) @ Way(*scene.free_way).direction > np.cos(np.radians(12.0))
        if (steep & ~near_free).any():
            assert free[steep & ~near_free].mean() <= 0.35
        sight = np.array(scene.camera_position) - scene.target.position
        nearest = int(np.argmax(reachable_directions(end) @ sight))
        assert not free[nearest]


def test_the_free_way_is_anywhere_in_the_reach():
    drawn = [scene.free_way for name in ("opaque", "translucent", "screen", "clutter") for scene in scenes(name, 5)]
    elevations = np.degrees([elevation for _, elevation in drawn])
    assert elevations.min() < 52.0
    assert elevations.max() > 68.0
    assert np.ptp(np.degrees([azimuth for azimuth, _ in drawn])) > 60.0
    assert all(elevation > np.radians(45.0) for elevation in (scene.free_way[1] for scene in scenes("bin", 3)))
    assert all(elevation < np.radians(71.0) for elevation in (scene.free_way[1] for scene in scenes("shelf", 3)))


@pytest.mark.parametrize("name", CROWDED)
def test_no_habit_is_worth_having(name):
    """A way counts as open unless a hand that is 1 cm smaller, and has no wrist, would touch something on it."""
    smaller, found = swept_hand(-0.01, wrist=False), scenes(name, 16)
    opened = np.zeros(len(REACH_GRID), int)
    for scene in found:
        end = scene.target.places[-1]
        boxes = still_boxes(scene)
        opened += ~any_meets(end, hand_axes(reachable_directions(end)), boxes, smaller)
    assert opened.max() <= 12, f"way {np.degrees(REACH_GRID[opened.argmax()])} is open in {opened.max()} of 16 scenes"


@pytest.mark.parametrize("name", CROWDED)
def test_at_the_start_the_target_is_in_view_and_the_hand_has_room(name):
    for scene in scenes(name):
        camera = np.array(scene.camera_position)
        assert visible_share(camera, scene.target, list(scene.obstacles)) >= 0.5
        pose = look_at(camera, np.array(scene.gaze_point), np.array([0.0, 0.0, 1.0]))
        boxes = joined([obstacle.boxes for obstacle in scene.obstacles])
        assert not boxes_meet(hand_boxes(pose), boxes, 0.03)


def test_the_same_generator_state_gives_the_same_scene_and_another_another():
    first, again, other = (sample_scene(SCENARIOS["opaque"], np.random.default_rng(s)) for s in (3, 3, 4))
    assert first == again
    assert first != other


def test_scenarios_are_of_their_material_and_show_one_mirror_at_most():
    for name in ("opaque", "translucent", "mirror", "clutter", "mixed"):
        for scene in scenes(name):
            kinds = [obstacle.kind for obstacle in scene.obstacles]
            assert kinds[0] == SCENARIOS[name].obstacle_materials[0]
            assert set(kinds) <= set(SCENARIOS[name].obstacle_materials)
            mirrors = [part for item in scene.obstacles for part in item.shape.parts if part.finish == "mirror"]
            assert len(mirrors) <= 1


def test_a_scenario_without_room_says_so_at_once():
    crammed = Scenario("custom", ("opaque",), obstacle_kinds=("roof",), obstacle_count=(9, 9))
    with pytest.raises(RuntimeError, match="allow more obstacles"):
        sample_scene(crammed, np.random.default_rng(0))


def test_coloured_frames_change_nothing_else_and_are_never_red():
    colours = []
    for seed in range(8):
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
        local = (points - first.box.centre) @ first.box.rotation
        assert np.any(np.all(np.abs(local) < first.box.half_extent, axis=1))


def test_moving_obstacles_are_driven_or_pushed_within_the_stated_limits_apart_from_all_else():
    kinds = set()
    for scene in scenes("moving_obstacle"):
        moving = [obstacle for obstacle in scene.obstacles if obstacle.motion is not None]
        assert 1 <= len(moving) <= 2
        for obstacle in moving:
            motion = obstacle.motion
            kinds.add(motion.to_and_fro)
            if motion.to_and_fro:
                assert 0.03 <= motion.speed <= 0.10
            else:
                assert 0.04 <= motion.length <= 0.10
                assert 2.0 <= motion.start_s <= 6.0
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
    drawn = scenes("mixed", 16)
    obstacles = [obstacle for scene in drawn for obstacle in scene.obstacles]
    assert {obstacle.kind for obstacle in obstacles} == set(PLAIN_MATERIALS)
    motions = [obstacle.motion for obstacle in obstacles]
    assert {motion if motion is None else motion.to_and_fro for motion in motions} == {None, True, False}
    assert {scene.distractor is None for scene in drawn} == {True, False}
    assert {scene.target.motion is None for scene in drawn} == {True, False}
    assert max(len(scene.obstacles) for scene in drawn) > 2
    json.dumps([asdict(scene) for scene in drawn])
