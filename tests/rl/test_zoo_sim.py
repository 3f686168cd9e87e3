"""rl-zoo3's configurations against what they have to agree with: Stable-Baselines3, the environment, our own runs."""

import importlib
import inspect

import gymnasium as gym
import pytest
from stable_baselines3 import PPO, SAC

import fixation_gym  # noqa: F401  (registers the ids)
from policies.rl.config import TrainConfig
from policies.rl.inputs import input_space
from policies.rl.zoo import ppo, sac

pytestmark = pytest.mark.sim
ZOO_KEYS = {"policy", "env_wrapper", "env_kwargs", "n_timesteps", "n_envs"}
"""What rl-zoo3 itself reads; it hands on the rest."""


@pytest.mark.parametrize(("module", "kind"), [(sac, SAC), (ppo, PPO)], ids=["sac", "ppo"])
def test_a_configuration_is_of_settings_that_exist_and_builds_what_train_learns_in(module, kind):
    (env_id, settings), *others = module.hyperparams.items()
    assert not others
    assert set(settings) - ZOO_KEYS <= set(inspect.signature(kind).parameters)
    module_name, _, wrapper = settings["env_wrapper"].rpartition(".")
    env = getattr(importlib.import_module(module_name), wrapper)(gym.make(env_id, **settings["env_kwargs"]))
    assert env.observation_space == input_space("zfc")
    assert settings["env_kwargs"]["image_size"] == TrainConfig().image_size
    env.close()


def test_sac_learns_as_often_and_as_late_as_in_train():
    settings, ours = sac.hyperparams["FixationPickZFC-v0"], TrainConfig()
    for name in ("buffer_size", "learning_starts"):
        assert settings[name] == getattr(ours, name)
    assert (settings["n_timesteps"], settings["n_envs"]) == (ours.steps, ours.workers)
    # -1 is as many gradient steps as environment steps, in which every environment takes one.
    assert (settings["gradient_steps"], ours.gradient_steps) == (-1, 1)
