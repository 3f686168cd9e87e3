"""Evaluation of a model during its training: the same episodes every time, the actions without noise."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnv

from fixation_gym.envs.config import CONTROL_FREQUENCY

Predict = Callable[[Any], np.ndarray]
"""Actions for a batch of inputs."""


def validate(predict: Predict, envs: VecEnv, episodes: int) -> dict[str, float]:
    """Run the episodes that the environments have been given.

    Args:
        predict: the policy.
        envs: from ``start_workers``; new scenes have to be drawn afterwards.
        episodes: number of all episodes.

    Returns:
        Rates of success and collision-free success, mean return, and mean simulated time of an episode, s.
    """
    counts = [len(range(rank, episodes, envs.num_envs)) for rank in range(envs.num_envs)]
    envs.env_method("rewind")
    inputs = envs.reset()
    finished: list[list[dict[str, Any]]] = [[] for _ in counts]
    periods = np.zeros(envs.num_envs)
    lengths: list[float] = []
    while any(len(done) < count for done, count in zip(finished, counts, strict=True)):
        inputs, _, dones, infos = envs.step(predict(inputs))
        periods += [info["periods"] for info in infos]
        for rank in np.flatnonzero(dones):
            if len(finished[rank]) < counts[rank]:
                finished[rank].append(infos[rank]["episode"])
                lengths.append(periods[rank])
            periods[rank] = 0
    results = [result for done in finished for result in done]
    return {
        "success": float(np.mean([result["is_success"] for result in results])),
        "collision_free": float(np.mean([result["is_success"] and not result["collision"] for result in results])),
        "return": float(np.mean([result["r"] for result in results])),
        "time_s": float(np.mean(lengths)) / CONTROL_FREQUENCY,
    }
