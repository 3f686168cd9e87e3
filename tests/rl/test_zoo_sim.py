"""rl-zoo3's configurations against what they have to agree with: Stable-Baselines3, the environments, our own runs."""

import importlib
import inspect

import gymnasium as gym
import numpy as np
import pytest
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.vec_env import DummyVecEnv

import fixation_gym  # noqa: F401  (registers the ids)
from fixation_policies.rl.config import CONFIGS, TrainConfig
from fixation_policies.rl.inputs import input_space
from fixation_policies.rl.zoo import ppo, sac

pytestmark = pytest.mark.sim
KINDS = {"sac": (sac, SAC), "ppo": (ppo, PPO)}
ZOO_KEYS = {"policy", "env_wrapper", "env_kwargs", "n_timesteps", "n_envs"}
"""What rl-zoo3 itself reads; it hands on the rest."""


def made(env_id, settings):
    env = gym.make(env_id, **settings["env_kwargs"])
    if "env_wrapper" not in settings:
        return env
    module, _, wrapper = settings["env_wrapper"].rpartition(".")
    return getattr(importlib.import_module(module), wrapper)(env)


@pytest.mark.parametrize("env_id", ["FixationPickZFC-v0", "FixationPick-v0"])
@pytest.mark.parametrize("algorithm", KINDS)
def test_a_configuration_is_of_settings_that_exist_and_makes_a_model_that_acts(algorithm, env_id):
    module, kind = KINDS[algorithm]
    settings = module.hyperparams[env_id]
    ours = {name: value for name, value in settings.items() if name not in ZOO_KEYS}
    assert set(ours) <= set(inspect.signature(kind).parameters)
    envs = DummyVecEnv([lambda: made(env_id, settings)])
    model = kind(settings["policy"], envs, **{**ours, **({"buffer_size": 10} if kind is SAC else {})})
    actions, _ = model.predict(envs.reset())
    assert actions.shape == (1, *envs.action_space.shape)
    assert np.all(np.abs(actions) <= 1.0)
    if env_id == "FixationPickZFC-v0":  # what 'train' learns in
        assert envs.observation_space == input_space(CONFIGS["zfc"])
        assert settings["env_kwargs"]["image_size"] == TrainConfig().image_size
    envs.close()


def test_sac_learns_as_often_and_as_late_as_in_train():
    settings, ours = sac.hyperparams["FixationPickZFC-v0"], TrainConfig()
    for name in ("buffer_size", "learning_starts"):
        assert settings[name] == getattr(ours, name)
    assert (settings["n_timesteps"], settings["n_envs"]) == (ours.steps, ours.workers)
    # -1 is as many gradient steps as environment steps, in which every environment takes one.
    assert (settings["gradient_steps"], ours.gradient_steps) == (-1, 1)
