"""Rehearsals against the simulation that they are copies of."""

from dataclasses import replace

import numpy as np
import pytest

from fixation_gym.envs.config import CONTROL_FREQUENCY, SCENARIOS
from fixation_gym.envs.motion import Motion
from fixation_gym.envs.pick_sim import PickSim
from fixation_gym.envs.rehearsal import Rehearsal
from fixation_gym.envs.sampling import sample_scene

pytestmark = pytest.mark.sim
UP = np.array([0.02, -0.03, -0.05, 0.1, -0.1, 0.2])


@pytest.fixture(scope="module")
def sim():
    return PickSim(CONTROL_FREQUENCY)


@pytest.fixture
def scene():
    """One with an obstacle that is driven to and fro."""
    scene = sample_scene(SCENARIOS["opaque"], np.random.default_rng(5))
    driven = replace(scene.obstacles[-1], motion=Motion(0.2, (0.0, 0.05), 0.02, to_and_fro=True))
    return replace(scene, obstacles=(*scene.obstacles[:-1], driven))


def test_the_arm_and_what_moves_come_where_the_simulation_takes_them(sim, scene):
    sim.reset(scene)
    rehearsal = Rehearsal(sim)
    for _ in range(2 * CONTROL_FREQUENCY):
        sim.step(UP, -1.0)
        rehearsal.step(UP, -1.0)
    assert np.linalg.norm(sim.arm_state().camera_pose[:3, 3] - rehearsal.arm_state().camera_pose[:3, 3]) < 0.003
    np.testing.assert_allclose(sim.arm_state().joint_pos, rehearsal.arm_state().joint_pos, atol=0.02)
    moving = f"obstacle{len(scene.obstacles) - 1}"
    for body in sim.obstacles:
        np.testing.assert_allclose(sim.body_position(body), rehearsal.body_position(body), atol=0.003)
    assert np.linalg.norm(rehearsal.body_position(moving) - scene.obstacles[-1].position) > 0.01
    assert sim.clearance() == pytest.approx(rehearsal.clearance(), abs=0.004)


def test_the_original_goes_on_as_if_nothing_had_been_rehearsed(sim, scene):
    ends = []
    for rehearses in (False, True):
        sim.reset(scene)
        for _ in range(10):
            sim.step(UP, -1.0)
            if rehearses:
                rehearsal = Rehearsal(sim)
                rehearsal.step(-UP, 1.0)
        ends.append(sim.data.qpos.copy())
    np.testing.assert_array_equal(*ends)


def test_closing_fingers_take_the_target_along_and_open_ones_do_not(sim, scene):
    sim.reset(scene)
    rehearsal = Rehearsal(sim)
    target, tool = rehearsal.body_position("target").copy(), rehearsal.tool_position()
    rehearsal.step(UP, -1.0)
    np.testing.assert_array_equal(rehearsal.body_position("target"), target)
    before = rehearsal.tool_position()
    rehearsal.step(UP, 1.0)
    np.testing.assert_allclose(rehearsal.body_position("target") - target, rehearsal.tool_position() - before)
    assert not np.allclose(tool, rehearsal.tool_position(), atol=1e-3)
