"""The paper's dot product rule, votes of regions, and the check of the distance by the target's own motion."""

from functools import partial
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from pinhole_scene import Scene, noise_texture, upright
from test_pipeline_and_zero_flow import CAMERA, POSTERS, TARGET, circling, frames, on_grid, poster_scene, run

from fixation_gym.geometry.interaction import fixation_coupling, image_flow
from fixation_gym.geometry.twist import mean_twist
from fixation_gym.perception.distance import estimator
from fixation_gym.perception.distance.target_motion import contradiction, target_inverse_depth
from fixation_gym.perception.zero_flow.dot_product_rule import dot_product_front
from fixation_gym.perception.zero_flow.region_vote import Side, VoteSettings, decide, region_votes
from fixation_gym.perception.zero_flow.zero_flow import Gaze, ZeroFlowSettings, zero_flow_test


@pytest.mark.parametrize("v_z", [0.0, 0.05])
@pytest.mark.parametrize("x", [-0.5, -0.3, 0.0, 0.3, 0.5])
def test_the_papers_rule_changes_sides_on_the_circle_and_not_on_the_plane(x, v_z):
    v, fixated = np.array([0.1, 0.0, v_z]), 0.5
    twist = np.array([*v, *fixation_coupling(v, 1 / fixated), 0.0])
    switch = fixated * (1 - x * v_z / v[0]) / (1 + x**2)  # theory of Raviv's circle, tilted by the heading
    for factor, front in ((0.98, True), (1.02, False)):
        flow = np.stack(image_flow(np.full((1, 1), x), np.zeros((1, 1)), 1 / (factor * switch), twist), -1)
        assert dot_product_front(SimpleNamespace(flow=flow), v)[0, 0] == front  # pyright: ignore


def test_the_papers_rule_says_nothing_without_flow():
    flow = SimpleNamespace(flow=np.full((2, 2, 2), np.nan))
    assert not dot_product_front(flow, np.array([0.1, 0.0, 0.0])).any()  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("front", "behind", "side"),
    [
        (0, 0, Side.UNKNOWN),
        (5, 0, Side.UNKNOWN),
        (20, 0, Side.FRONT),
        (20, 100, Side.FRONT),  # a rim around what is seen through
        (8, 100, Side.UNKNOWN),
        (2, 100, Side.BEHIND),
        (0, 5, Side.UNKNOWN),
    ],
)
def test_a_small_solid_share_in_front_decides(front, behind, side):
    assert decide(front, behind, VoteSettings()) is side


def test_regions_of_the_poster_scene_are_voted_right():
    _, percept, _, (_, index, _) = run(POSTERS, 18)
    sides = {2: Side.FRONT, 3: Side.FRONT, 4: Side.BEHIND, 5: Side.BEHIND}
    for number, side in sides.items():
        votes = region_votes(percept.zfc, on_grid(index == number, percept) > 0, VoteSettings())
        assert decide(*votes, VoteSettings()) is side


def test_outlines_next_to_something_behind_have_no_evidence_and_lie_at_depth_edges():
    _, percept, _, (depth, _, pose) = run(POSTERS, 18)
    fixated = pose[:3, 2] @ (TARGET - pose[:3, 3])
    zfc, depth = percept.zfc, on_grid(depth, percept)
    assert 0.01 < zfc.outline.mean() < 0.2
    assert not (zfc.supported & zfc.outline).any()
    assert (zfc.p_nearer[zfc.outline] == 0.5).all()
    front = zfc.supported & (zfc.inverse_depth > zfc.fixated_inverse_depth)
    assert (front & (depth > 1.1 * fixated)).sum() < 0.05 * front.sum()
    inner = cv2.erode((depth < 0.9 * fixated).astype(np.uint8), np.ones((7, 7)))
    assert (zfc.outline & (inner > 0)).sum() < 0.1 * front.sum()


def test_the_target_says_its_distance_by_its_own_motion():
    perception, percept, _, (_, index, pose) = run(POSTERS, 18)
    first, _, last = perception._frames
    twist = mean_twist(first.T_base_cam, last.T_base_cam, last.time - first.time)
    found = target_inverse_depth(percept.flow, twist, on_grid(index == 1, percept) > 0)
    assert found is not None
    value, std = found
    true = 1 / (pose[:3, 2] @ (TARGET - pose[:3, 3]))
    assert value == pytest.approx(true, rel=0.06)
    assert abs(value - true) < 3 * std
    assert target_inverse_depth(percept.flow, twist, np.zeros(index.shape, bool)[:80, :107]) is None


def test_the_distance_from_the_centroid_holds_unless_the_motion_contradicts_it_or_is_much_surer():
    assert contradiction((2.0, 0.02), [], True) is None
    assert contradiction((2.0, 0.02), [(2.05, 0.05)] * 5, True) is None
    assert contradiction((3.0, 0.02), [(2.0, 0.05)] * 5, False) == (2.0, 0.05)
    assert contradiction((3.0, 0.02), [(2.0, 0.05)] * 2, True) is None
    assert contradiction((3.0, 0.02), [(2.0, 2.0)] * 5, True) is None
    assert contradiction((2.0, 0.2), [(2.05, 0.05)] * 5, True) == (2.05, 0.05)
    assert contradiction((2.0, 0.2), [(2.05, 0.05)] * 5, False) is None  # an uncovered centroid is left to converge


@pytest.mark.parametrize("v_z", [0.0, 0.05])
def test_a_target_that_nothing_covers_never_restarts_the_distance(v_z, monkeypatch):
    restarts = []
    monkeypatch.setattr(estimator, "begun_again", lambda *given: restarts.append(given))
    scene = Scene([r for number, r in enumerate(poster_scene().rectangles) if number < 2])
    run(frames(scene, partial(circling, v_z=v_z)), 40)
    assert not restarts


@pytest.mark.parametrize("half_width", [0.003, 0.006])
def test_a_thin_post_keeps_its_evidence(half_width):
    scene = poster_scene()
    scene.rectangles[2:] = [upright([0.26, 0.05, 0.0], half_width, 0.08, noise_texture(3, (0.3, 0.3, 0.3)))]
    _, percept, _, (_, index, _) = run(frames(scene, circling), 18)
    post = on_grid(index == 2, percept) > 0
    assert (percept.zfc.supported & (percept.zfc.p_nearer > 0.95))[post].mean() > 0.5


def test_with_the_focus_of_expansion_inside_the_image_its_surroundings_are_unknown_and_nothing_breaks():
    from test_pipeline_and_zero_flow import fixating_pose, frames, poster_scene

    _, percept, _, _ = run(frames(poster_scene(), lambda t: fixating_pose([0.1 * t, 0.0, 0.0], TARGET)), 8)
    grid = percept.flow.intrinsics
    x, y = grid.grid
    focus = np.hypot(x, y) < 0.06
    assert not percept.zfc.supported[focus].any()
    assert np.isfinite(percept.zfc.p_nearer).all()
    assert CAMERA.width == 2 * grid.width


def test_while_the_distance_is_hardly_known_only_what_is_far_off_it_is_decided():
    perception, percept, _, (_, index, pose) = run(POSTERS, 18)
    first, _, last = perception._frames
    twist = mean_twist(first.T_base_cam, last.T_base_cam, last.time - first.time)
    shares = {}
    for std in (0.02, 0.2, 0.6):
        test = zero_flow_test(percept.flow, Gaze(twist, 2.5, std * 2.5, index == 1, pose), ZeroFlowSettings())
        near, alike = (on_grid(index == number, percept) > 0 for number in (2, 4))  # at 0.24 and 0.46 m; target 0.4 m
        shares[std] = [test.supported[patch].mean() for patch in (near, alike)]
        assert (np.abs(test.p_nearer[test.supported] - 0.5) > 0.45).all() or std == 0.02
    assert shares[0.2][0] > 0.8 * shares[0.02][0] > 0.2
    assert shares[0.2][1] < 0.2 < shares[0.02][1]
    assert max(shares[0.6]) < 0.1


def spread_over(front: np.ndarray, behind: np.ndarray) -> SimpleNamespace:
    """A test's answers, sure of both sides, nothing moves by itself."""
    p = np.full(front.shape, 0.5, np.float32)
    p[front], p[behind] = 1.0, 0.0
    return SimpleNamespace(p_nearer=p, moving=np.zeros(front.shape, np.bool_))


def test_what_an_outline_spreads_over_its_neighbour_is_no_vote_about_the_neighbour():
    left, right = np.zeros((2, 30, 40), np.bool_)
    left[:, 8:20], right[:, 20:30] = True, True  # something plain and far, hidden in part by something near
    front, behind = np.zeros((2, 30, 40), np.bool_)
    front[:, 18:30], behind[:, 8:12] = True, True  # the near one's outline reaches 2 px into the far one
    answers = spread_over(front, behind)
    far, near = (region_votes(answers, region, VoteSettings()) for region in (left, right))  # pyright: ignore
    assert far == (0.0, 120.0)
    assert decide(*far, VoteSettings()) is Side.BEHIND
    assert decide(*near, VoteSettings()) is Side.FRONT


def test_something_near_beside_something_near_is_still_in_front():
    left, right = np.zeros((2, 30, 40), np.bool_)
    left[:, 8:20], right[:, 20:30] = True, True
    answers = spread_over(left | right, np.zeros((30, 40), np.bool_))
    for region in (left, right):
        assert decide(*region_votes(answers, region, VoteSettings()), VoteSettings()) is Side.FRONT  # pyright: ignore
