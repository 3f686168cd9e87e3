"""The arm really gets where ``ROBOT.arm.reach`` says: kinematics with the joint limits of the simulated Panda."""

import math

import mujoco
import numpy as np
import pytest

from fixation_gym.control import gaze, servo_laws
from fixation_gym.control.gaze import GazeGains
from fixation_gym.control.reach import REACH_GRID, directions
from fixation_gym.control.resolved_rate import joint_velocities
from fixation_gym.control.ways import lateral_direction
from fixation_gym.envs import contacts
from fixation_gym.envs.pick_sim import PickSim
from fixation_gym.geometry.rigid import look_at
from fixation_gym.robots import ROBOT

pytestmark = pytest.mark.sim
PERIOD = 0.04
UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def sim():
    return PickSim(25)


def moved(sim, joints, twist):
    """Joint angles after one period at a camera twist."""
    state = arm(sim, joints)
    speeds = joint_velocities(state.jacobian, twist, joints, sim._posture, sim._limits)
    return np.clip(joints + PERIOD * speeds, sim._limits.lower, sim._limits.upper)


def arm(sim, joints):
    sim.data.qpos[:7] = joints
    mujoco.mj_kinematics(sim.model, sim.data)
    mujoco.mj_comPos(sim.model, sim.data)
    return sim.arm_state()


def error_at_the_target(sim, target, way):
    """How far the tool ends from the target when the hand goes around to a way and in, m; inf if it hits itself."""
    start = directions(np.radians([[50.0, 50.0]]), target)[0]
    joints = sim._inverse_kinematics(look_at(target + 0.45 * start, target, UP))
    gains, owners = GazeGains(), sim._compiled.owners
    for _ in range(260):
        pose = arm(sim, joints).camera_pose
        local = pose[:3, :3].T @ (target - pose[:3, 3])
        present = (pose[:3, 3] - target) / np.linalg.norm(pose[:3, 3] - target)
        direction, angle = lateral_direction(pose, present, way)
        if angle < math.radians(2.0) and local[2] < 0.20:
            break
        forward = 0.1 if angle < math.radians(4.0) else 0.4 * (local[2] - 0.43)
        v = np.array([*direction * min(2.5 * local[2] * angle, 0.13), forward])
        twist = gaze.fixating_twist(v, local[:2] / local[2], local[2], gaze.levelling(pose, gains), gains)
        joints = moved(sim, joints, twist)
    goal = target - pose[:3, :3] @ ROBOT.tool_in_camera
    for _ in range(80):
        joints = moved(sim, joints, servo_laws.pose_twist(arm(sim, joints).camera_pose, goal, 4.0, 0.1))
    error = float(np.linalg.norm(arm(sim, joints).camera_pose[:3, 3] - goal))
    mujoco.mj_collision(sim.model, sim.data)
    touching = [pair for pair in sim.data.contact.geom if np.all(owners[pair] == contacts.ROBOT)]
    return math.inf if touching else error


@pytest.mark.parametrize("place", [(0.50, 0.0), (0.62, 0.14), (0.55, -0.14)])
def test_the_tool_gets_to_the_target_from_all_over_the_reach(sim, place):
    target = np.array([*place, ROBOT.workspace.table_height + 0.035])
    ways = directions(REACH_GRID, target)[::4]
    errors = np.array([error_at_the_target(sim, target, way) for way in ways])
    assert np.mean(errors < 0.005) >= 0.9
