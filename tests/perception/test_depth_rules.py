"""Front rules that measure depth: right where their assumption holds, and wrong where it does not."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from pinhole_scene import noise_texture, upright
from test_pipeline_and_zero_flow import (
    CAMERA,
    POSTERS,
    POSTERS_APPROACHED,
    frames,
    on_grid,
    over_the_table,
    run,
    sign_scores,
    tabletop,
)

from fixation_gym.perception import Perception, PerceptionSettings, ZeroFlowSettings
from fixation_gym.perception.zero_flow.depth_rules import depth_rule, measured_answers, motion_stereo, plane_parallax
from fixation_gym.perception.zero_flow.front_rule import exact_rule
from fixation_gym.perception.zero_flow.pixel_answers import PixelQuestion


def perception_by(rule, **options):
    return Perception(CAMERA, PerceptionSettings(zero_flow=ZeroFlowSettings(rule=rule)), **options)


def with_depth(frame, measure=lambda depth: depth):
    """The frames with what a depth camera says of the true depth."""

    def measured(k):
        observation, depth, *rest = frame(k)
        return (replace(observation, depth=measure(depth)), depth, *rest)

    return measured


def question(boundary, shape, table=-np.inf, boundary_std=0.0):
    zero = np.float32(0.0)
    return PixelQuestion(
        *np.zeros((2, 1), np.float32), zero, np.float32(boundary), np.float32(boundary_std**2),
        np.full(shape[0], table, np.float32), np.zeros(shape[1], np.float32), np.float32(1.0), zero, zero, zero, zero,
    )  # fmt: skip


def test_side_is_that_of_the_measured_depth_and_holes_have_no_evidence():
    depth = np.array([[2.5, 1.9, 2.0, np.nan, np.inf]], np.float32)
    std, usable = np.full(depth.shape, 0.1, np.float32), np.ones(depth.shape, bool)
    answers = measured_answers(depth, std, usable, question(2.0, depth.shape))
    np.testing.assert_array_equal(answers.supported, [[True, True, True, False, False]])
    np.testing.assert_allclose(answers.p_nearer, [[1.0, 0.1587, 0.5, 0.5, 0.5]], atol=1e-4)
    assert not answers.moving.any()


def test_what_is_not_above_the_table_is_not_in_front():
    depth = np.array([[2.9, 3.6]], np.float32)
    std, usable = np.full(depth.shape, 0.1, np.float32), np.ones(depth.shape, bool)
    answers = measured_answers(depth, std, usable, question(2.0, depth.shape, table=3.2))
    np.testing.assert_allclose(answers.p_nearer, [[0.0013, 1.0]], atol=1e-3)


@pytest.mark.parametrize("frame", [POSTERS, POSTERS_APPROACHED], ids=["circling", "approaching"])
def test_motion_stereo_tells_the_sides_and_the_depth(frame):
    _, percept, _, truth = run(frame, 18, perception=perception_by(motion_stereo))
    accuracy, recall, share = sign_scores(percept, truth)
    assert accuracy > 0.95
    assert recall > 0.8
    assert share > 0.5
    used = percept.zfc.supported
    error = percept.zfc.inverse_depth - 1 / on_grid(truth[0], percept)
    assert np.median(np.abs(error[used] / percept.zfc.inverse_depth_std[used])) < 1.0


def test_depth_camera_tells_the_sides():
    _, percept, _, truth = run(with_depth(POSTERS), 18, perception=perception_by(depth_rule))
    accuracy, recall, share = sign_scores(percept, truth)
    assert accuracy > 0.99
    assert recall > 0.9
    assert share > 0.7


def test_depth_camera_knows_nothing_where_it_has_a_hole():
    def measure(depth):
        return np.where(depth < 0.3, np.nan, depth)

    _, percept, _, (depth, _, _) = run(with_depth(POSTERS, measure), 18, perception=perception_by(depth_rule))
    hole = cv2.erode((on_grid(depth, percept) < 0.3).astype(np.uint8), np.ones((3, 3))) > 0
    assert not percept.zfc.supported[hole].any()
    assert hole.mean() > 0.02


def test_depth_camera_of_another_resolution_sees_the_same():
    full, half = (
        run(with_depth(POSTERS, measure), 18, perception=perception_by(depth_rule))[1].zfc
        for measure in (np.copy, lambda depth: depth[1::2, 1::2])
    )
    np.testing.assert_array_equal(full.inverse_depth, half.inverse_depth)


def test_without_a_depth_camera_the_rule_says_what_to_do():
    with pytest.raises(ValueError, match="depth_camera=True"):
        run(POSTERS, 6, perception=perception_by(depth_rule))


def test_all_of_them_leave_the_table_in_peace_and_find_the_post():
    table = frames(tabletop(), over_the_table)
    for rule, frame in ((depth_rule, with_depth(table)), (motion_stereo, table), (plane_parallax, table)):
        perception = perception_by(rule, support_height_m=0.0)
        _, percept, _, (_, index, _) = run(frame, 18, perception=perception)
        front = percept.zfc.p_nearer > 0.9
        table_front, post_front = (front[on_grid(index == number, percept) > 0].mean() for number in (0, 2))
        assert table_front < 0.03, rule
        assert post_front > 0.4, rule


def test_plane_parallax_calls_what_is_behind_the_target_an_obstacle_too():
    scene = tabletop()
    scene.rectangles[2] = upright([0.6, 0.06, 0.1], 0.03, 0.1, noise_texture(3, (0.4, 0.6, 0.4)))
    frame = frames(scene, lambda t: over_the_table(3.0 * t))
    called = {}
    for rule in (motion_stereo, plane_parallax):
        perception = perception_by(rule, support_height_m=0.0)
        _, percept, _, (_, index, _) = run(frame, 18, perception=perception)
        called[rule] = (percept.zfc.p_nearer > 0.9)[on_grid(index == 2, percept) > 0].mean()
    assert called[motion_stereo] < 0.05
    assert called[plane_parallax] > 0.3


def test_plane_parallax_knows_nothing_without_a_table():
    _, percept, _, _ = run(POSTERS, 8, perception=perception_by(plane_parallax))
    assert not percept.zfc.supported.any()


def nothing_for_the_pixels(asked):
    return exact_rule(asked)._replace(p_nearer=np.zeros(3, np.float32))


def broken(asked):
    raise ZeroDivisionError("my own fault")


@pytest.mark.parametrize(
    ("rule", "error", "message"),
    [
        (nothing_for_the_pixels, ValueError, "nothing_for_the_pixels must return PixelAnswers with arrays of shape"),
        (broken, RuntimeError, r"the front rule .*broken failed: ZeroDivisionError: my own fault"),
    ],
)
def test_a_rule_of_somebody_else_that_is_wrong_is_named(rule, error, message):
    with pytest.raises(error, match=message) as raised:
        run(POSTERS, 6, perception=perception_by(rule))
    assert (raised.value.__cause__ is not None) == (rule is broken)
