"""The residual learner's environment in the simulator."""

import numpy as np
import pytest

from policies.rl.config import TrainConfig
from policies.rl.environments import make_learner_env

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
