"""Environments that the tests of this folder share: one takes seconds to build, a reset does not."""

import gymnasium as gym
import pytest


@pytest.fixture(scope="package")
def env():
    env = gym.make("FixationPick-v0", scenario="opaque", image_size=(64, 80))
    env.reset(seed=0)  # robosuite warns when it is first imported; the checker's warnings are what counts
    yield env
    env.close()


@pytest.fixture(scope="package")
def ideal_env():
    env = gym.make("FixationPick-v0", sensor_noise="ideal")
    yield env
    env.close()
