"""The learner's view of the ways against the geometry of the camera's motion."""

import math

import numpy as np
import pytest

from fixation_gym.control.reach import REACH_GRID, directions
from fixation_gym.control.ways import SeenSpace, Ways, known_ways, lateral_direction
from fixation_gym.envs.way_view import ways_in_view
from fixation_gym.geometry.rigid import look_at

TARGET = np.array([0.55, 0.08, -0.08])
ALL = directions(REACH_GRID, TARGET)
CELL = math.radians(150.0 / 32)


def camera_at(azimuth_deg, elevation_deg, distance=0.4):
    present = directions(np.radians([[azimuth_deg, elevation_deg]]), TARGET)[0]
    return look_at(TARGET + distance * present, TARGET, np.array([0.0, 0.0, 1.0])), present


@pytest.mark.parametrize("way", range(0, len(ALL), 7))
def test_what_bars_a_way_is_where_the_camera_would_have_to_go(way):
    camera, present = camera_at(60, 60)
    evidence = np.zeros(len(ALL))
    evidence[way] = 1000.0
    within = ways_in_view(Ways(ALL, np.zeros(len(ALL)), np.zeros(len(ALL))), camera, TARGET)[0] < 0.5
    barred = (ways_in_view(Ways(ALL, evidence, np.zeros(len(ALL))), camera, TARGET)[0] > 0.9) & within
    direction, angle = lateral_direction(camera, present, ALL[way])
    rows, columns = np.nonzero(barred)
    seen_at = CELL * (np.array([columns.mean(), rows.mean()]) - 15.5)
    assert np.linalg.norm(seen_at - angle * direction) < 1.5 * CELL


def test_beyond_the_arms_reach_all_is_barred_and_within_it_what_was_not_seen_is_said_so():
    camera, _ = camera_at(60, 60)
    barred, unseen = ways_in_view(Ways(ALL, np.zeros(len(ALL)), np.ones(len(ALL))), camera, TARGET)
    assert barred[31].min() == 1.0  # below the table
    assert barred[16, 16] == 0.0
    assert unseen.min() == 1.0


def test_the_middle_says_what_was_not_seen_of_the_present_way():
    camera, present = camera_at(60, 60)
    space = SeenSpace.empty(math.atan2(TARGET[1], TARGET[0]))
    beyond = (space.places(TARGET) - TARGET) @ present > 0.2
    ways = known_ways(np.zeros((0, 3)), np.zeros(0), TARGET, space.with_seen(beyond), 0.01)
    unseen = ways_in_view(ways, camera, TARGET)[1]
    assert unseen[15:17, 15:17] == pytest.approx(ways.unseen[ways.nearest(present)], abs=0.1)
    assert unseen.min() == pytest.approx(ways.unseen.min())
