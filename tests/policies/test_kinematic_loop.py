"""The servo in closed loop on an ideal kinematic camera: perception and laws without a simulator."""

import numpy as np
import pytest

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import look_at, matrix_to_pose
from fixation_gym.geometry.twist import exp_twist
from fixation_gym.perception.pipeline import Perception
from fixation_gym.robots import ROBOT
from fixation_gym.types import Observation
from fixation_policies.servo.gains import ServoGains
from fixation_policies.servo.servo_policy import ServoPolicy

INTRINSICS = Intrinsics.from_fovy(120, 160, ROBOT.camera.fovy)
TARGET = np.array([0.55, 0.0, 0.0])
RADIUS = 0.025
UP = np.array([0.0, 0.0, 1.0])
PERIOD = 0.04
RAYS = np.stack([*INTRINSICS.grid, np.ones((120, 160))], -1)
RAYS /= np.linalg.norm(RAYS, axis=-1, keepdims=True)


def picture(T_base_cam):
    """A red ball before a grey wall, exactly projected: a pixel is red if its ray meets the ball."""
    offset = T_base_cam[:3, :3].T @ (TARGET - T_base_cam[:3, 3])
    along = RAYS @ offset
    hit = (along > 0) & (offset @ offset - along**2 < RADIUS**2)
    return np.where(hit[..., None], np.array([200, 10, 10]), 128).astype(np.uint8)


def run(policy, T_base_cam, seconds, visible=lambda time: True):
    twist, trail = np.zeros(6), []
    for k in range(round(seconds / PERIOD)):
        time = k * PERIOD
        image = picture(T_base_cam) if visible(time) else np.full((120, 160, 3), 128, np.uint8)
        observation = Observation(
            time=time,
            rgb=image,
            joint_pos=np.zeros(7),
            joint_vel=np.zeros(7),
            camera_pose=matrix_to_pose(T_base_cam),
            camera_twist=twist,
            gripper_width=0.08 if policy.estimate is None or policy.estimate.phase != "lift" else 0.05,
        )
        twist = policy.respond(observation).camera_twist
        trail.append((time, policy.estimate, T_base_cam, twist))
        T_base_cam = T_base_cam @ exp_twist(twist, PERIOD)
    return trail


START = look_at(np.array([0.30, -0.20, 0.30]), TARGET + np.array([0.03, 0.02, 0.0]), UP)


def phases(trail):
    return [estimate.phase for _, estimate, _, _ in trail]


@pytest.fixture(scope="module")
def pick():
    """One undisturbed pick, shared: it takes seconds."""
    return run(ServoPolicy(Perception(INTRINSICS)), START, 14.0)


def test_the_gaze_reaches_and_holds_the_target(pick):
    for time, estimate, T_base_cam, _ in pick:
        point = T_base_cam[:3, :3].T @ (TARGET - T_base_cam[:3, 3])
        if time > 2.0 and estimate.phase in ("fixate", "approach"):
            assert np.linalg.norm(point[:2] / point[2]) < 0.02


def test_the_distance_is_known_within_two_percent_before_the_approach(pick):
    _, estimate, T_base_cam, _ = next(item for item in pick if item[1].phase == "approach")
    true = T_base_cam[:3, 2] @ (TARGET - T_base_cam[:3, 3])
    assert estimate.distance_m == pytest.approx(true, rel=0.02)


def test_the_tool_ends_at_the_target(pick):
    T_base_cam = next(pose for _, estimate, pose, _ in pick if estimate.phase == "close")
    tool = T_base_cam[:3, :3] @ ROBOT.tool_in_camera + T_base_cam[:3, 3]
    assert np.linalg.norm(tool - TARGET) < 0.012


def test_commands_stay_within_the_limits_and_use_them(pick):
    twists = np.abs([twist for *_, twist in pick])
    assert np.all(twists <= ROBOT.arm.twist_limits * (1 + 1e-9))
    assert np.all(twists.max(axis=0)[:5] > 0.1 * ROBOT.arm.twist_limits[:5])


def test_a_lost_target_is_recovered():
    policy = ServoPolicy(Perception(INTRINSICS))
    trail = run(policy, START, 4.5, visible=lambda time: not 1.0 < time < 2.5)
    assert set(phases(trail)[round(1.9 / PERIOD) : round(2.4 / PERIOD)]) <= {"recover", "search"}
    assert phases(trail)[-1] in ("fixate", "approach")


def test_without_a_sure_distance_it_looks_from_farther_up():
    gains = ServoGains(fixate_relative_std=0.0)
    trail = run(ServoPolicy(Perception(INTRINSICS), gains), START, gains.fixate_patience + 2.0)
    assert phases(trail)[-1] == "fixate"
    heights = [T_base_cam[2, 3] for *_, T_base_cam, _ in trail]
    patient = round(gains.fixate_patience / PERIOD)
    assert abs(heights[patient] - heights[0]) < 0.04
    assert heights[-1] - heights[patient] > 0.05


def test_a_reset_policy_repeats_itself():
    policy = ServoPolicy(Perception(INTRINSICS))
    first = [twist for *_, twist in run(policy, START, 1.0)]
    policy.reset()
    np.testing.assert_array_equal(first, [twist for *_, twist in run(policy, START, 1.0)])
