"""The residual learner's environment in the simulator."""

import gymnasium as gym
import numpy as np
import pytest

from fixation_policies.catalogue import make_policy
from fixation_policies.rl.config import TrainConfig
from fixation_policies.rl.environments import make_learner_env
from fixation_policies.rl.residual import ResidualEnv

pytestmark = pytest.mark.sim


def test_without_a_residual_the_servo_picks_although_no_image_is_rendered_in_its_grasp():
    env = make_learner_env(TrainConfig(config="residual", scenario="clear"), 0)
    env.reset(seed=0)
    ended, cameras, info = False, [], {}
    while not ended:
        _, _, terminated, truncated, info = env.step(np.zeros(2, np.float32))
        cameras.append(env.unwrapped.camera_on)
        ended = terminated or truncated
    env.close()
    assert info["is_success"]
    assert not cameras[-1]  # the grasp, the last decision, went on blindly
    assert all(cameras[:-1])


def test_without_a_residual_the_servo_acts_and_with_one_the_camera_moves_to_that_side():
    plain, helped, turned = (gym.make("FixationPick-v0", scenario="clear", image_size=(96, 128)) for _ in range(3))
    servo, helped, turned = make_policy("servo", plain), ResidualEnv(helped), ResidualEnv(turned)
    obs, _ = plain.reset(seed=3)
    helped.reset(seed=3)
    turned.reset(seed=3)
    for _ in range(50):
        obs, *_ = plain.step(servo.act(obs))
        shown, *_ = helped.step(np.zeros(2, np.float32))
        seen, *_ = turned.step(np.array([-1.0, 0.0], np.float32))
    np.testing.assert_array_equal(helped.unwrapped.sensed["camera_pose"], obs["camera_pose"])
    aside = turned.unwrapped.sensed["camera_pose"][:3] - obs["camera_pose"][:3]
    right = np.cross(shown["proprio"][10:13], [0.0, 0.0, 1.0])
    assert aside @ right < -0.04
    assert np.hypot(*seen["fixation"][:2]) < 0.05  # the gaze is held all the same


def test_a_residual_does_not_lead_out_of_reach():
    env = ResidualEnv(gym.make("FixationPick-v0", scenario="clear", image_size=(96, 128)))
    env.reset(seed=3)
    heights = []
    for _ in range(150):
        shown, *_ = env.step(np.array([0.0, -1.0], np.float32))
        heights.append(np.degrees(np.arcsin(-shown["proprio"][12])))
    assert 80.0 < max(heights) < 88.0  # elevation of the gaze: the servo stops rising at 84 degrees
