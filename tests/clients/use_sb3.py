"""PPO and SAC of Stable-Baselines3 on the map, in two processes, evaluated, saved and loaded."""

import math
import tempfile

from stable_baselines3 import PPO, SAC
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import SubprocVecEnv

import fixation_gym  # noqa: F401

SMALL = {"image_size": (64, 80), "max_episode_steps": 20}

if __name__ == "__main__":
    envs = make_vec_env("FixationPickZFC-v0", 2, env_kwargs=SMALL, vec_env_cls=SubprocVecEnv)
    model = PPO("MultiInputPolicy", envs, n_steps=16, batch_size=16).learn(64)
    mean, _ = evaluate_policy(model, envs, n_eval_episodes=2)
    with tempfile.TemporaryDirectory() as folder:
        model.save(f"{folder}/ppo")
        PPO.load(f"{folder}/ppo", envs).learn(32)
    envs.close()
    SAC("MultiInputPolicy", make_vec_env("FixationPickZFC-v0", env_kwargs=SMALL), learning_starts=8).learn(24)
    assert math.isfinite(mean)
