"""The simulated robot moves as it is told, and its time passes only while somebody waits."""

import numpy as np
import pytest

from fixation_gym.envs.simulated_robot import SimulatedRobot
from fixation_gym.fixator import action_of
from fixation_gym.geometry.rigid import inverse, pose_to_matrix
from fixation_gym.robot_loop import REST
from fixation_gym.types import Command

pytestmark = pytest.mark.sim


def test_the_camera_moves_by_its_twist_until_the_next_command(ideal_env):
    robot = SimulatedRobot(ideal_env, seed=0)
    start = robot.observe()
    robot.command(Command(np.array([0.05, 0.0, 0.0, 0.0, 0.0, 0.0]), -1.0))
    assert robot.observe().time == start.time == robot.now() == 0.0
    robot.wait_until(0.8)
    assert robot.now() == pytest.approx(0.8)
    moved = inverse(pose_to_matrix(start.camera_pose)) @ pose_to_matrix(robot.observe().camera_pose)
    np.testing.assert_allclose(moved[:3, 3], [0.04, 0.0, 0.0], atol=3e-3)
    robot.command(REST)
    robot.wait_until(1.2)
    resting = robot.observe().camera_pose
    robot.wait_until(1.6)
    np.testing.assert_allclose(robot.observe().camera_pose, resting, atol=1e-4)
    robot.wait_until(1.0)  # is over
    assert robot.now() == pytest.approx(1.6)


def test_it_is_the_environment_step_for_step(ideal_env):
    command = Command(np.array([0.02, -0.01, 0.03, 0.1, 0.0, 0.05]), -1.0)
    robot = SimulatedRobot(ideal_env, seed=3)
    robot.command(command)
    robot.wait_until(10 / ideal_env.unwrapped.control_frequency)
    ideal_env.reset(seed=3)
    for _ in range(10):
        sensed, *_, info = ideal_env.step(action_of(command))
    observation = robot.observe()
    np.testing.assert_array_equal(observation.rgb, sensed["rgb"])
    np.testing.assert_array_equal(observation.camera_pose, sensed["camera_pose"].astype(np.float64))
    assert robot.info["distance_true_m"] == info["distance_true_m"]
