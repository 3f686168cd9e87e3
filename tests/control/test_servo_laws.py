import math

import numpy as np
import pytest

from fixation_gym.control.servo_laws import approach_speed, gaze_rotation, lateral_velocity, pose_twist
from fixation_gym.geometry.interaction import image_flow

NO_MOTION = np.zeros(3)


def test_gaze_law_is_zero_on_a_centred_target():
    assert gaze_rotation(np.zeros(2), 4.0, 2.0, NO_MOTION, 0.0) == pytest.approx([0.0, 0.0])


@pytest.mark.parametrize("centroid", [(0.2, 0.0), (-0.1, 0.25), (0.0, -0.3)])
def test_gaze_law_makes_the_offset_decay_at_its_gain_whatever_the_camera_does(centroid):
    v, roll, distance = np.array([0.05, -0.08, 0.1]), 0.3, 0.4
    w = gaze_rotation(np.array(centroid), 4.0, 1.0 / distance, v, roll)
    x, y = (np.array(c) for c in centroid)
    flow = image_flow(x, y, 1.0 / distance, np.array([*v, *w, roll]))
    assert np.array(flow) == pytest.approx(-4.0 * np.array(centroid), abs=1e-12)


def test_gaze_law_turns_towards_the_target():
    right = gaze_rotation(np.array([0.2, 0.0]), 4.0, 1.0, NO_MOTION, 0.0)
    below = gaze_rotation(np.array([0.0, 0.2]), 4.0, 1.0, NO_MOTION, 0.0)
    assert right[1] > 0.0  # +w_Y turns the optical axis to the right
    assert below[0] < 0.0  # -w_X turns it down


def test_paper_gaze_law_as_printed_turns_away_from_the_target():
    # Eq. 6 read with the camera twist of Eq. 1: w = +lambda B^-1 e makes the offset grow.
    x, y = np.array(0.2), np.array(0.1)
    matrix = np.array([[x * y, -(1 + x**2)], [1 + y**2, -x * y]])
    w = 4.0 * np.linalg.solve(matrix, [x, y])
    flow = image_flow(x, y, 0.0, np.array([0.0, 0.0, 0.0, *w, 0.0]))
    assert float(flow[0] * x + flow[1] * y) > 0.0


def test_approach_law_is_zero_at_the_desired_distance_and_right_signed_off_it():
    assert approach_speed(0.2, 0.2, 0.1) == 0.0
    assert approach_speed(0.4, 0.2, 0.1) == pytest.approx(0.1 * math.log(2.0))
    assert approach_speed(0.1, 0.2, 0.1) == pytest.approx(-0.1 * math.log(2.0))


@pytest.mark.parametrize("distances", [(0.0, 0.2), (0.2, -1.0), (math.nan, 0.2)])
def test_approach_law_refuses_impossible_distances(distances):
    with pytest.raises(ValueError, match="must be positive"):
        approach_speed(*distances, gain=0.1)


def test_lateral_law_describes_a_circle_of_the_given_radius_when_nothing_else_acts():
    times = np.linspace(0.0, 2.0 * math.pi / 3.0, 2001)
    velocity = [lateral_velocity(0.2, 0.2, np.zeros(2), t, 0.03, 3.0, 0.1, np.zeros(2)) for t in times]
    path = np.cumsum(velocity, axis=0) * (times[1] - times[0])
    assert np.ptp(path, axis=0) == pytest.approx([0.06, 0.06], rel=1e-2)


def test_lateral_law_moves_away_from_obstacles_and_climbs_while_far():
    still = lateral_velocity(0.4, 0.2, np.array([0.0, -0.15]), 0.0, 0.0, 2.0, 0.1, np.array([1.0, 0.0]))
    assert still == pytest.approx([-0.1, -0.03])


def test_pose_twist_goes_straight_to_the_goal_without_turning():
    pose = np.eye(4)
    pose[:3, :3] = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    goal = np.array([0.3, -0.4, 0.0])
    twist = pose_twist(pose, goal, gain=4.0, speed_limit=0.1)
    assert pose[:3, :3] @ twist[:3] == pytest.approx(0.1 * goal / 0.5)
    assert not twist[3:].any()
    assert not pose_twist(pose, pose[:3, 3], 4.0, 0.1).any()
