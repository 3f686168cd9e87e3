"""TQC and recurrent PPO of sb3-contrib on the map."""

import gymnasium as gym
from sb3_contrib import TQC, RecurrentPPO

import fixation_gym  # noqa: F401

if __name__ == "__main__":
    env = gym.make("FixationPickZFC-v0", image_size=(64, 80), max_episode_steps=20)
    assert TQC("MultiInputPolicy", env, learning_starts=8).learn(24).num_timesteps == 24
    assert RecurrentPPO("MultiInputLstmPolicy", env, n_steps=16, batch_size=16).learn(32).num_timesteps == 32
    env.close()
