"""What LeRobot's EnvHub calls: a repository there whose ``env.py`` has this ``make_env`` serves the environment."""

from __future__ import annotations

from functools import partial
from typing import Any

import gymnasium as gym

from fixation_gym.lerobot_env.layout import make_pick


def make_env(n_envs: int = 1, use_async_envs: bool = False, cfg: Any = None) -> gym.vector.VectorEnv:
    """Several environments as one.

    Args:
        n_envs: how many.
        use_async_envs: each in a process of its own.
        cfg: LeRobot's configuration of a hub environment, or None; of its fields only ``task``, the name of a scenario,
            counts.
    """
    scenario = getattr(cfg, "task", None) or "clear"
    vector = gym.vector.AsyncVectorEnv if use_async_envs else gym.vector.SyncVectorEnv
    make = partial(make_pick, scenario=scenario, render_mode="rgb_array", render_view="overlay")
    return vector([make] * n_envs, autoreset_mode=gym.vector.AutoresetMode.SAME_STEP)
