"""Minari collects a data set, and reads one that `fixation-gym export` recorded."""

import os
import subprocess
import sys
import tempfile

import gymnasium as gym
import minari

import fixation_gym  # noqa: F401

if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        os.environ["MINARI_DATASETS_PATH"] = folder
        env = minari.DataCollector(gym.make("FixationPickZFC-v0", image_size=(64, 80), max_episode_steps=5))
        for seed in range(2):
            env.reset(seed=seed)
            done = False
            while not done:
                *_, terminated, truncated, _ = env.step(env.action_space.sample())
                done = terminated or truncated
        env.create_dataset("test/random-v0")
        assert minari.load_dataset("test/random-v0").total_steps == 10

        picks = f"{folder}/picks"
        options = ["--policy", "servo", "--scenario", "clear", "--episodes", "1", "--image-size", "64", "80"]
        command = [sys.executable, "-m", "fixation_gym", "export", "--format", "minari", *options, "--out", picks]
        subprocess.run(command, check=True)
        os.environ["MINARI_DATASETS_PATH"] = f"{picks}/minari"
        dataset = minari.load_dataset("fixation/pick-v0")
        assert dataset[0].terminations[-1]  # the servo picked
        assert dataset.recover_environment().observation_space == dataset.observation_space
