import numpy as np
import pytest

from fixation_gym.control.corridor import approach_directions, free_directions, in_corridor
from fixation_gym.control.obstacle_term import obstacle_term
from fixation_gym.geometry.boxes import Box

ABOVE = np.array([[0.0, 1e-6, 1.0]])
TARGET = np.array([0.5, 0.0, 0.0])


def test_free_directions_agree_with_points_spread_through_the_boxes():
    rng = np.random.default_rng(0)
    directions = approach_directions(np.radians(np.linspace(-60, 60, 7)), np.radians([30.0, 50.0, 70.0]))
    for _ in range(8):
        box = Box(TARGET + rng.uniform(-0.2, 0.2, 3), rng.uniform(0.02, 0.1, 3), rng.uniform(-np.pi, np.pi))
        local = rng.uniform(-1, 1, (3000, 3)) * box.half_extent
        c, s = np.cos(box.yaw), np.sin(box.yaw)
        points = local @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + box.centre - TARGET
        touched = []
        for direction in directions:
            right = np.cross(-direction, [0, 0, 1]) / np.linalg.norm(np.cross(-direction, [0, 0, 1]))
            axes = np.stack([right, np.cross(-direction, right), -direction])
            touched.append(in_corridor(points @ axes.T, 0.0).any())
        touched = np.array(touched)
        # Points may miss a corner: with some margin more or less, boxes and points must agree.
        assert not np.any(touched & free_directions(TARGET, [box], directions, 0.0))
        assert not np.any(~touched & ~free_directions(TARGET, [box], directions, -0.01))


def test_directions_are_unit_vectors_that_rise_with_elevation():
    directions = approach_directions(np.radians([-30.0, 0.0, 30.0]), np.radians([40.0, 80.0]))
    assert np.linalg.norm(directions, axis=-1) == pytest.approx(np.ones(6))
    assert sorted(set(np.round(directions[:, 2], 6))) == pytest.approx([np.sin(np.radians(40)), np.sin(np.radians(80))])


def test_everything_is_free_without_obstacles():
    assert free_directions(TARGET, [], approach_directions(np.zeros(1), np.ones(1)), 0.0).all()


def test_a_post_between_camera_and_target_blocks_that_direction_only():
    post = Box(TARGET - np.array([0.15, 0.0, 0.0]), np.array([0.02, 0.02, 0.15]), 0.0)
    from_robot, from_side = approach_directions(np.radians([0.0, 90.0]), np.radians([45.0]))
    free = free_directions(TARGET, [post], np.stack([from_robot, from_side]), 0.0)
    assert free.tolist() == [False, True]


def test_the_corridor_is_as_wide_as_the_hand_and_ends_at_the_finger_tips():
    points = np.array([[0.10, 0.0, -0.10], [0.13, 0.0, -0.10], [0.10, 0.0, 0.0], [0.0, 0.0, 0.03]])
    assert in_corridor(points, 0.0).tolist() == [True, False, False, False]
    assert in_corridor(points, 0.03).tolist() == [True, True, False, True]


def test_far_from_the_target_the_hand_comes_below_the_optical_axis():
    above_and_below = np.array([[0.10, -0.05, -0.26], [0.10, 0.09, -0.26]])
    assert in_corridor(above_and_below, 0.0).tolist() == [False, True]


def test_obstacle_term_counts_what_is_in_the_way_and_ignores_the_rest():
    points = np.array([[0.08, 0.05, 0.20], [0.30, 0.05, 0.20], [0.0, 0.0, 0.60]])
    term = obstacle_term(points, np.array([3.0, 5.0, 7.0]), distance=0.4, tool_depth=0.06, margin=0.01)
    assert term.evidence == 3.0
    assert term.gap == pytest.approx(0.14)


def test_obstacle_term_is_zero_when_the_way_is_free():
    term = obstacle_term(np.zeros((0, 3)), np.zeros(0), 0.4, 0.06, 0.01)
    assert term.evidence == 0.0
    assert term.gap == np.inf
