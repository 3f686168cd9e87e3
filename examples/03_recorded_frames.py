"""Perception on recorded frames, without simulator: what your own robot has to log, and what comes out."""

import tempfile
from pathlib import Path

import gymnasium as gym
import numpy as np

import fixation_gym  # noqa: F401
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.pipeline import Perception
from fixation_gym.robots import ROBOT
from fixation_gym.types import Observation
from fixation_policies.catalogue import make_policy


def record(path: Path, steps: int = 60) -> None:
    """Stand-in for a robot: save two seconds of observations while it fixates."""
    env = gym.make("FixationPick-v0", scenario="clear")
    policy = make_policy("servo", env)
    obs, _ = env.reset(seed=1)
    policy.reset(1)
    frames = []
    for _ in range(steps):
        frames.append(obs)
        obs, *_ = env.step(policy.act(obs))
    env.close()
    arrays = {key: np.stack([frame[key] for frame in frames]) for key in frames[0]}
    np.savez_compressed(path, allow_pickle=False, **arrays)


def replay(path: Path) -> float:
    """Run perception on the recording; returns the last distance in m."""
    recording = np.load(path)
    height, width = recording["rgb"].shape[1:3]
    perception = Perception(Intrinsics.from_fovy(height, width, ROBOT.camera.fovy))
    distance = float("nan")
    for k in range(len(recording["time"])):
        percept = perception.update(Observation.from_dict({key: recording[key][k] for key in recording.files}))
        fixation = percept.fixation
        distance = fixation.distance_m
        if k % 10 == 9:
            print(f"{percept.time:.2f} s: {1000 * distance:.0f} +- {1000 * fixation.distance_std_m:.0f} mm")
    return distance


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        record(Path(folder) / "recording.npz")
        replay(Path(folder) / "recording.npz")
