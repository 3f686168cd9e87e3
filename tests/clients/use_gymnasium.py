"""Gymnasium's own wrappers, checker and vector environments on both ids."""

import tempfile

import gymnasium as gym
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import FlattenObservation, RecordEpisodeStatistics, RecordVideo

import fixation_gym  # noqa: F401

SMALL = {"image_size": (64, 80)}

if __name__ == "__main__":
    for name in ("FixationPick-v0", "FixationPickZFC-v0"):
        env = gym.make(name, **SMALL)
        check_env(env.unwrapped, skip_render_check=True)
        env.close()
        for mode, vector in (("sync", {}), ("async", {"context": "spawn"})):
            envs = gym.make_vec(name, 2, mode, vector_kwargs=vector, **SMALL)
            envs.reset(seed=0)
            envs.step(envs.action_space.sample())
            envs.close()

    with tempfile.TemporaryDirectory() as folder:
        env = gym.make("FixationPickZFC-v0", render_mode="rgb_array", max_episode_steps=5, **SMALL)
        env = RecordVideo(RecordEpisodeStatistics(FlattenObservation(env)), folder)
        env.reset(seed=0)
        info = {}
        while "episode" not in info:
            *_, info = env.step(env.action_space.sample())
        env.close()
        assert info["episode"]["l"] == 5
