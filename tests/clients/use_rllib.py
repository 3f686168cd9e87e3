"""PPO of RLlib; its networks take no dictionaries, so its own connector flattens them."""

import gymnasium as gym
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.connectors.env_to_module import FlattenObservations
from ray.tune.registry import register_env


def make(_):
    return gym.make("fixation_gym:FixationPickZFC-v0", image_size=(64, 80), max_episode_steps=20)


def flatten(env=None, spaces=None, device=None):
    return FlattenObservations()


if __name__ == "__main__":
    register_env("fixation", make)
    config = PPOConfig().environment("fixation").env_runners(num_env_runners=1, env_to_module_connector=flatten)
    algorithm = config.training(train_batch_size=40, minibatch_size=20, num_epochs=1).build_algo()
    result = algorithm.train()
    algorithm.stop()
    assert result["num_env_steps_sampled_lifetime"] >= 40
