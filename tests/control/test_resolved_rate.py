import numpy as np
import pytest

from fixation_gym.control.resolved_rate import JointLimits, joint_velocities

LIMITS = JointLimits(np.full(7, -2.0), np.full(7, 2.0), np.full(7, 2.0))


@pytest.fixture
def jacobian():
    return np.random.default_rng(0).normal(size=(6, 7))


def test_joint_velocities_produce_the_twist(jacobian):
    twist = np.array([0.05, -0.02, 0.1, 0.2, -0.1, 0.3])
    velocities = joint_velocities(jacobian, twist, np.zeros(7), np.zeros(7), LIMITS, damping=1e-6)
    assert jacobian @ velocities == pytest.approx(twist, abs=1e-9)


def test_posture_moves_only_in_the_null_space(jacobian):
    velocities = joint_velocities(jacobian, np.zeros(6), np.zeros(7), np.full(7, 0.5), LIMITS, damping=1e-6)
    assert np.linalg.norm(velocities) > 1e-3
    assert jacobian @ velocities == pytest.approx(np.zeros(6), abs=1e-9)


def test_speed_limits_keep_the_direction_of_the_twist(jacobian):
    twist = np.array([3.0, -1.0, 2.0, 0.5, 0.0, 1.0])
    velocities = joint_velocities(jacobian, twist, np.zeros(7), np.zeros(7), LIMITS, damping=1e-6)
    assert np.max(np.abs(velocities)) == pytest.approx(2.0)
    reached = jacobian @ velocities
    assert reached / np.linalg.norm(reached) == pytest.approx(twist / np.linalg.norm(twist))


def test_damping_bounds_joint_speeds_at_a_singular_posture():
    singular = np.zeros((6, 7))
    singular[0, 0] = 1e-9
    velocities = joint_velocities(singular, np.ones(6), np.zeros(7), np.zeros(7), LIMITS)
    assert np.max(np.abs(velocities)) < 1e-3


def test_a_joint_at_its_limit_does_not_go_further(jacobian):
    at_limit = np.array([2.0, -2.0, 0, 0, 0, 0, 0])
    velocities = joint_velocities(jacobian, np.ones(6), at_limit, np.zeros(7), LIMITS)
    assert velocities[0] <= 0.0
    assert velocities[1] >= 0.0


def test_the_other_joints_make_up_for_one_at_its_limit(jacobian):
    free = joint_velocities(jacobian, np.ones(6) * 0.1, np.zeros(7), np.zeros(7), LIMITS, damping=1e-6)
    at_limit = 2.0 * np.sign(free) * (np.arange(7) == 3)
    velocities = joint_velocities(jacobian, np.ones(6) * 0.1, at_limit, at_limit, LIMITS, damping=1e-6)
    assert velocities[3] == 0.0
    assert jacobian @ velocities == pytest.approx(np.ones(6) * 0.1, abs=1e-6)
