"""SAC and PPO of sbx (JAX); its policies take one vector."""

import gymnasium as gym
from sbx import PPO, SAC

import fixation_gym  # noqa: F401

if __name__ == "__main__":
    env = gym.make("FixationPickZFC-v0", image_size=(64, 80), max_episode_steps=20)
    env = gym.wrappers.FlattenObservation(env)
    assert SAC("MlpPolicy", env, learning_starts=8).learn(24).num_timesteps == 24
    assert PPO("MlpPolicy", env, n_steps=16, batch_size=16).learn(32).num_timesteps == 32
    env.close()
