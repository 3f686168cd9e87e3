import math
from dataclasses import replace

import numpy as np
import pytest

from fixation_gym.control import gaze
from fixation_gym.control.gaze import GazeGains
from fixation_gym.geometry.rigid import look_at
from fixation_gym.geometry.twist import exp_twist
from fixation_gym.robots import ROBOT

GAINS = GazeGains()
TARGET = np.array([0.55, 0.1, -0.08])
UP = np.array([0.0, 0.0, 1.0])


def camera(azimuth_deg, elevation_deg, distance=0.4):
    """Level camera on the target, seen from the given direction against the bearing of the target."""
    azimuth = math.atan2(TARGET[1], TARGET[0]) + math.radians(azimuth_deg)
    flat = math.cos(math.radians(elevation_deg))
    away = [-flat * math.cos(azimuth), -flat * math.sin(azimuth), math.sin(math.radians(elevation_deg))]
    return look_at(TARGET + distance * np.array(away), TARGET, UP)


def turned(pose, angle):
    return pose @ exp_twist(np.array([0, 0, 0, 0, 0, angle]), 1.0)


def test_elevation_and_roll_are_those_of_the_pose():
    pose = turned(camera(30, 50), 0.2)
    assert gaze.elevation(pose) == pytest.approx(math.radians(50))
    assert gaze.roll(pose) == pytest.approx(0.2)


def test_levelling_undoes_the_roll_and_fades_straight_down():
    assert gaze.levelling(turned(camera(30, 50), 0.2), GAINS) == pytest.approx(-0.2)
    assert abs(gaze.levelling(turned(camera(30, 89), 0.2), GAINS)) < 0.03


@pytest.mark.parametrize("lateral", [(0.1, -0.1), (-0.1, 0.1)])
def test_within_reach_every_direction_is_free(lateral):
    np.testing.assert_array_equal(gaze.within_reach(np.array(lateral), camera(40, 50), TARGET, GAINS), lateral)


@pytest.mark.parametrize(
    ("view", "outward", "inward"),
    [
        ((106, 50), (0.1, 0.0), (-0.1, 0.0)),
        ((10, 50), (-0.1, 0.0), (0.1, 0.0)),
        ((40, 87), (0.0, -0.1), (0.0, 0.1)),
        ((60, 36), (0.0, 0.1), (0.0, -0.1)),
    ],
)
def test_at_the_limits_only_the_way_out_is_barred(view, outward, inward):
    pose = camera(*view)
    np.testing.assert_array_equal(gaze.within_reach(np.array(outward), pose, TARGET, GAINS), 0.0)
    np.testing.assert_array_equal(gaze.within_reach(np.array(inward), pose, TARGET, GAINS), inward)


def test_the_target_stays_in_the_centre_whatever_the_translation():
    pose = turned(camera(30, 50), 0.3)
    for step in range(50):
        point = pose[:3, :3].T @ (TARGET - pose[:3, 3])
        centroid = point[:2] / point[2]
        assert np.linalg.norm(centroid) < 0.01
        v = 0.1 * np.array([math.cos(0.2 * step), math.sin(0.1 * step), 0.5])
        twist = gaze.fixating_twist(v, centroid, point[2], gaze.levelling(pose, GAINS), GAINS)
        np.testing.assert_array_equal(twist[:3], v)
        pose = pose @ exp_twist(twist, 0.04)
    assert abs(gaze.roll(pose)) < 0.1


def test_without_feed_forward_the_rotation_depends_on_the_offset_alone():
    gains = replace(GAINS, feed_forward=False)
    fast, slow = (gaze.fixating_twist(np.array([v, 0.0, v]), np.zeros(2), 0.4, 0.0, gains) for v in (0.1, 0.0))
    np.testing.assert_array_equal(fast[3:], slow[3:])
    off = gaze.fixating_twist(np.zeros(3), np.array([0.1, 0.05]), 0.4, 0.0, gains)
    np.testing.assert_array_equal(off, gaze.fixating_twist(np.zeros(3), np.array([0.1, 0.05]), 0.4, 0.0, GAINS))


def test_the_search_turns_at_its_rate_and_moves_nowhere():
    twist = gaze.searching_twist(2.0, GAINS)
    np.testing.assert_array_equal(twist[[0, 1, 2, 5]], 0.0)
    assert np.linalg.norm(twist[3:5]) == pytest.approx(GAINS.search_rate)


def test_fast_twists_are_slowed_down_as_a_whole():
    twist = np.array([0.3, 0.0, 0.15, 0.0, 0.4, 0.0])
    np.testing.assert_allclose(gaze.within_speed(twist), 0.5 * twist)
    np.testing.assert_array_equal(gaze.within_speed(0.1 * ROBOT.arm.twist_limits), 0.1 * ROBOT.arm.twist_limits)
