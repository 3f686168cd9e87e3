from dataclasses import replace

import numpy as np
import pytest

from fixation_gym.control.open_loop import (
    CLOSE,
    OPEN,
    Manoeuvre,
    OpenLoopGains,
    Stage,
    Target,
    advance,
    begin_grasp,
    begin_recovery,
    gripper_command,
    manoeuvre_twist,
    reaimed,
)
from fixation_gym.geometry.rigid import look_at
from fixation_gym.geometry.twist import exp_twist
from fixation_gym.robots import ROBOT

GAINS = OpenLoopGains(hold_seconds=3.0)
POINT = np.array([0.55, 0.0, -0.08])
TARGET = Target(POINT, None, None)
POSE = look_at(np.array([0.45, -0.05, 0.06]), POINT, np.array([0.0, 0.0, 1.0]))
FAR, HERE = POSE[:3, 3] + [0.0, 0.0, 0.1], POSE[:3, 3]


@pytest.mark.parametrize(
    ("stage", "goal", "seconds", "width", "expected"),
    [
        (Stage.GRASP, FAR, 1.0, 0.08, Stage.GRASP),
        (Stage.GRASP, HERE, 1.0, 0.08, Stage.CLOSE),
        (Stage.GRASP, FAR, 9.0, 0.08, Stage.RECOVER),
        (Stage.CLOSE, HERE, 0.2, 0.0, Stage.CLOSE),
        (Stage.CLOSE, HERE, 9.0, 0.03, Stage.LIFT),
        (Stage.CLOSE, HERE, 9.0, 0.0, Stage.RECOVER),
        (Stage.LIFT, FAR, 1.0, 0.03, Stage.LIFT),
        (Stage.LIFT, FAR, 1.0, 0.0, Stage.RECOVER),
        (Stage.LIFT, HERE, 9.0, 0.03, Stage.RECOVER),
        (Stage.RECOVER, FAR, 0.5, 0.08, Stage.RECOVER),
        (Stage.RECOVER, HERE, 0.5, 0.08, None),
        (Stage.RECOVER, FAR, 9.0, 0.08, None),
    ],
)
def test_every_transition_has_its_condition(stage, goal, seconds, width, expected):
    after = advance(Manoeuvre(stage, 2.0, goal), POSE, width, 2.0 + seconds, GAINS)
    assert (after and after.stage) is expected
    if after is not None:
        assert after.started == (2.0 if expected is stage else 2.0 + seconds)


def test_a_policy_that_nobody_stops_holds_on_to_what_it_lifted():
    assert advance(Manoeuvre(Stage.LIFT, 0.0, FAR), POSE, 0.03, 1e6, OpenLoopGains()) is not None


def test_the_grasp_brings_the_tool_to_the_point_without_turning_and_never_backwards():
    grasp, pose = begin_grasp(POSE, TARGET, 0.0, GAINS), POSE
    for step in range(100):
        if advance(grasp, pose, 0.08, 0.04 * step, GAINS).stage is Stage.CLOSE:
            break
        twist = manoeuvre_twist(grasp, pose, GAINS)
        assert np.linalg.norm(twist) <= GAINS.tool_speed + 1e-9
        assert twist[2] > -1e-9
        np.testing.assert_array_equal(twist[3:], 0.0)
        pose = pose @ exp_twist(twist, 0.04)
    assert np.linalg.norm(pose[:3, :3] @ ROBOT.tool_in_camera + pose[:3, 3] - POINT) < GAINS.tool_tolerance


def tool_of(grasp):
    """Where the tool is at the end of a grasp, in base, shape (3,), m."""
    return grasp.goal + POSE[:3, :3] @ ROBOT.tool_in_camera


def test_fingers_keep_off_the_table():
    low = POINT - [0.0, 0.0, 0.03]
    tool = tool_of(begin_grasp(POSE, Target(low, None, -0.112), 0.0, GAINS))
    np.testing.assert_allclose(tool, [*low[:2], -0.112 + GAINS.finger_room], atol=1e-12)
    assert low[2] == pytest.approx(-0.11)  # the point itself is left alone


def test_a_body_is_grasped_below_its_middle_and_a_surface_where_it_is():
    table = POINT[2] - 0.04
    below = POINT - [0.0, 0.0, (1.0 - GAINS.grasp_height) * 0.04]
    np.testing.assert_allclose(tool_of(begin_grasp(POSE, Target(POINT, 0.02, table), 0.0, GAINS)), below, atol=1e-12)
    np.testing.assert_allclose(tool_of(begin_grasp(POSE, Target(POINT, None, table), 0.0, GAINS)), POINT, atol=1e-12)


def test_a_body_that_is_too_deep_is_held_nearer_to_its_front():
    deepest = ROBOT.hand.palm + GAINS.past_palm
    reach = deepest + 0.01
    tool = tool_of(begin_grasp(POSE, Target(POINT, reach, POINT[2] - 0.04), 0.0, GAINS))
    touching = POINT - reach * POSE[:3, 2]
    assert POSE[:3, 2] @ (tool - touching) == pytest.approx(deepest)


def test_a_grasp_follows_a_pushed_target_and_nothing_less():
    grasp = begin_grasp(POSE, TARGET, 0.0, GAINS)
    for shift, follows in ((0.5 * GAINS.reaim_distance, False), (2.0 * GAINS.reaim_distance, True)):
        moved = reaimed(grasp, POSE, replace(TARGET, point=POINT + np.array([shift, 0.0, 0.0])), GAINS)
        np.testing.assert_allclose(moved.goal - grasp.goal, [shift if follows else 0.0, 0.0, 0.0], atol=1e-12)
        assert (moved.stage, moved.started) == (grasp.stage, grasp.started)
    lift = Manoeuvre(Stage.LIFT, 1.0, np.zeros(3))
    assert reaimed(lift, POSE, TARGET, GAINS) is lift


def test_recovery_goes_straight_back():
    twist = manoeuvre_twist(begin_recovery(POSE, 0.0, GAINS), POSE, GAINS)
    np.testing.assert_allclose(twist, [0.0, 0.0, -GAINS.tool_speed, 0.0, 0.0, 0.0], atol=1e-12)


def test_the_hand_is_closed_while_it_closes_and_lifts_and_rests_while_it_closes():
    commands = {stage: gripper_command(Manoeuvre(stage, 0.0, FAR)) for stage in Stage}
    assert commands == {Stage.GRASP: OPEN, Stage.CLOSE: CLOSE, Stage.LIFT: CLOSE, Stage.RECOVER: OPEN}
    assert gripper_command(None) == OPEN
    np.testing.assert_array_equal(manoeuvre_twist(Manoeuvre(Stage.CLOSE, 0.0, FAR), POSE, GAINS), 0.0)


def test_gains_are_values():
    assert replace(GAINS, hold_seconds=np.inf) == OpenLoopGains()
