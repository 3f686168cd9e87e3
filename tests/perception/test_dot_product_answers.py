"""The paper's dot-product rule in place of the exact test: sides, depths, table, and where it is worse."""

from functools import partial

import cv2
import numpy as np
from test_pipeline_and_zero_flow import (
    CAMERA,
    POSTERS,
    circling,
    frames,
    on_grid,
    over_the_table,
    poster_scene,
    run,
    sign_scores,
    tabletop,
)

from fixation_gym.geometry.rigid import inverse, transform
from fixation_gym.geometry.twist import mean_twist
from fixation_gym.perception import Perception, PerceptionSettings, ZeroFlowSettings
from fixation_gym.perception.zero_flow.dot_product_rule import dot_product_front, rule_answers
from fixation_gym.perception.zero_flow.front_rule import dot_product_rule
from fixation_gym.perception.zero_flow.obstacle_memory import MemorySettings, ObstacleMemory, believed_points, remember
from fixation_gym.perception.zero_flow.pixel_answers import PixelAnswers

RULE = PerceptionSettings(zero_flow=ZeroFlowSettings(rule=dot_product_rule))
MARGIN = RULE.zero_flow.depth_margin


def test_the_side_is_the_rules_and_the_depth_lies_on_it():
    depth = np.array([[3.0, 1.5, 3.0, 1.5, 3.0, np.nan]], np.float32)
    above = np.array([[1.0, 1.0, 1.0, 1.0, 0.01, 0.5]], np.float32)
    front = np.array([[True, True, False, False, True, True]])
    known = np.isfinite(depth)
    nothing = np.zeros(depth.shape, bool)
    answers = rule_answers(PixelAnswers(depth, 0.1 * depth, above, known, nothing), front, 2.0, MARGIN)
    np.testing.assert_allclose(answers.p_nearer, [[1, 1, 0, 0, 0.01, 0.5]])
    np.testing.assert_allclose(answers.inverse_depth, [[3, 2 * (1 + MARGIN), 2, 1.5, 3, np.nan]])
    np.testing.assert_array_equal(answers.inverse_depth_std, 0.1 * depth)


def test_without_a_table_every_pixel_with_evidence_is_what_the_rule_says():
    perception, percept, _, _ = run(POSTERS, 8, perception=Perception(CAMERA, RULE))
    first, _, last = perception._frames
    front = dot_product_front(percept.flow, mean_twist(first.T_base_cam, last.T_base_cam, last.time - first.time))
    used = percept.zfc.supported
    assert used.mean() > 0.5
    np.testing.assert_array_equal(percept.zfc.p_nearer[used], front[used])
    np.testing.assert_array_equal(percept.zfc.inverse_depth[used] > percept.zfc.fixated_inverse_depth, front[used])


def test_circling_it_tells_the_posters_apart():
    _, percept, _, truth = run(POSTERS, 18, perception=Perception(CAMERA, RULE))
    accuracy, recall, _ = sign_scores(percept, truth)
    assert accuracy > 0.95
    assert recall > 0.85


def test_approaching_it_misses_what_the_exact_test_finds():
    frame = frames(poster_scene(), partial(circling, v_z=0.1))
    recalls = []
    for settings in (RULE, None):
        _, percept, _, truth = run(frame, 14, perception=Perception(CAMERA, settings))
        recalls.append(sign_scores(percept, truth)[1])
    assert recalls[0] < recalls[1] - 0.05


def test_the_table_is_known_by_its_height_still():
    perception = Perception(CAMERA, RULE, support_height_m=0.0)
    _, percept, _, (_, index, _) = run(frames(tabletop(), over_the_table), 18, perception=perception)
    front = percept.zfc.p_nearer > 0.9
    table, post = (front[on_grid(index == number, percept) > 0].mean() for number in (0, 2))
    assert table < 0.01
    assert post > 0.4


def test_the_memory_keeps_points_in_front_of_the_target_only():
    perception, settings = Perception(CAMERA, RULE), MemorySettings()
    memory = ObstacleMemory.empty()
    for k in range(18):
        observation, _, index, pose = POSTERS(k)
        percept = perception.update(observation)
        if k > 8:
            time, grid = percept.flow.time, percept.flow.intrinsics
            memory = remember(memory, percept.zfc, grid, percept.T_base_flow, time, settings)
    points, _ = believed_points(memory, settings)
    assert len(points) > 10
    pixels = np.rint(CAMERA.project(transform(inverse(pose), points))).astype(int)
    seen = np.all((pixels >= 0) & (pixels < [CAMERA.width, CAMERA.height]), axis=1)
    columns, rows = pixels[seen].T
    near = cv2.dilate(np.isin(index, (2, 3)).astype(np.uint8), np.ones((15, 15), np.uint8))
    assert near[rows, columns].mean() > 0.9
    assert (points[:, 0] < 0.4).mean() > 0.95
