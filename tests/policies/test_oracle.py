"""What the oracle knows of its ways: whether the whole arm passes, and whether a box fits between the fingers."""

import itertools
import math

import numpy as np
import pytest
from gymnasium.utils.seeding import np_random

from fixation_gym.control.corridor import approach_directions, free_directions, hand_axes
from fixation_gym.envs.config import CONTROL_FREQUENCY, SCENARIOS
from fixation_gym.envs.pick_sim import PickSim
from fixation_gym.envs.sampling import sample_scene
from fixation_gym.experiments.necessity.episodes import World, play
from fixation_gym.geometry.boxes import Box
from fixation_policies.grips import rolls, widths
from fixation_policies.oracle import OraclePolicy, _GivenWay, _rehearsed_room


def test_the_width_of_a_box_is_that_of_its_corners_along_the_closing_fingers():
    box = Box(np.zeros(3), np.array([0.035, 0.03, 0.05]), yaw=0.4)
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3))) * box.half_extent @ box.rotation.T
    directions = approach_directions(np.radians([-40.0, 10.0, 80.0]), np.radians([42.0, 75.0]))
    for grip in (0, 1):
        grips = np.full(len(directions), grip)
        closing = hand_axes(directions, rolls(directions, grips, box.rotation))[:, 0]
        np.testing.assert_allclose(
            widths(directions, grips, box.rotation, box.half_extent), np.ptp(closing @ corners.T, axis=1), atol=1e-9
        )


def test_seen_along_its_face_a_box_is_as_wide_as_it_is():
    half = np.array([0.035, 0.03, 0.05])
    along = approach_directions(np.array([0.0]), np.array([0.8]))
    assert widths(along, np.array([1]), np.eye(3), half)[0] == pytest.approx(0.06)


@pytest.fixture(scope="module")
def barred():
    """A scene in which the arm's elbow meets an obstacle on a way that is free for the hand, and that way."""
    scene = sample_scene(SCENARIOS["mirror"], np_random(87_000_044)[0])
    azimuth, elevation = math.radians(31.95), math.radians(40.0)
    return World(PickSim(CONTROL_FREQUENCY), scene), approach_directions(np.array([azimuth]), np.array([elevation]))[0]


@pytest.mark.sim
def test_a_rehearsal_foresees_that_the_elbow_will_touch_where_the_hand_passes(barred):
    world, direction = barred
    world.sim.reset(world.scene)
    policy = OraclePolicy(world)
    assert free_directions(np.array(world.scene.target.position), policy._boxes(0.0), direction[None], 0.0)[0]
    assert _rehearsed_room(world, world.scene, (direction, -1), 0.0, 0.0) < 0.002
    assert play(world, _GivenWay(world, (direction, -1))).collision


@pytest.mark.sim
def test_the_oracle_takes_another_way_then(barred):
    world, direction = barred
    policy = OraclePolicy(world)
    assert play(world, policy).success
    assert policy._direction @ direction < math.cos(math.radians(3.0))
