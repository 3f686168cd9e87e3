"""``FixationPickZFC-v0`` without learning: a few lines on the zero-flow map steer around what is in front."""

import math
from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np

import fixation_gym  # noqa: F401

UNKNOWN = 128 / 255
COLUMNS, ROWS = np.meshgrid(np.linspace(-1.0, 1.0, 32), np.linspace(-1.0, 1.0, 32))
IN_THE_WAY = (np.abs(COLUMNS) < 0.6) & (ROWS > -0.3)  # roughly what the hand, below the camera, will sweep


def act(obs: Mapping[str, Any], step: int) -> np.ndarray:
    """Circle to see, approach what is fixated, keep away from what is in front, grasp when near and sure."""
    x, y, _, distance, std = obs["fixation"]
    front = IN_THE_WAY * np.clip((obs["zfc_map"][0] - UNKNOWN) / (1.0 - UNKNOWN), 0.0, 1.0)
    blocked = front.sum() > 8.0
    velocity = 0.25 * np.array([math.sin(0.08 * step), math.cos(0.08 * step), 0.0])
    if blocked:
        centre = np.array([(front * COLUMNS).sum(), (front * ROWS).sum()]) / front.sum()
        away = -centre - [0.0, 1.0]  # obstacles stand on the table: over them, if in doubt
        velocity[:2] += 0.35 * away / np.linalg.norm(away)
    elif step > 40:
        velocity += [0.0, -0.8 * (distance - 0.17), 0.8 * math.log(distance / 0.17)]
    grasp = distance < 0.19 and std < 0.006 and math.hypot(x, y) < 0.06
    return np.array([*velocity, 1.0 if grasp else -1.0], np.float32)


def main(scenario: str = "opaque", seed: int = 2) -> bool:
    """Run one episode; returns whether the object was lifted."""
    env = gym.make("FixationPickZFC-v0", scenario=scenario)
    obs, info = env.reset(seed=seed)
    done, step = False, 0
    while not done:
        if step % 25 == 0:
            front = np.mean(obs["zfc_map"] > UNKNOWN + 1e-3)
            print(f"{step / 25:4.0f} s  distance {obs['fixation'][3]:.3f} m  {100 * front:3.0f} % of the map in front")
        obs, _, terminated, truncated, info = env.step(act(obs, step))
        done, step = terminated or truncated, step + 1
    print("lifted" if info["is_success"] else "not lifted", "- with a collision" if info["collision"] else "")
    env.close()
    return info["is_success"]


if __name__ == "__main__":
    main()
