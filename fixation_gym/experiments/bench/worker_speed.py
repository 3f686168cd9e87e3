"""Vectors of environments: ours beside SB3's ``SubprocVecEnv``, both alive and stepped in turn."""

from __future__ import annotations

import importlib.util
import os
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np

from fixation_gym.experiments.bench.cases import ENDLESS

_ROUNDS, _ROUND_S = 7, 3.0
"""Rounds, and the time of one kind in each, s."""
_ARGUMENTS: dict[str, Any] = {"scenario": "opaque", "image_size": (128, 128), "max_episode_steps": ENDLESS}


def worker_rows(numbers: Sequence[int]) -> list[dict[str, Any]]:
    """Steps of all environments together per second, and memory, for each number of workers.

    Memory is the proportional set size of the workers: what they share is divided among them.

    Returns:
        A row per kind of vector and number, SB3's only where that is installed.
    """
    kinds: dict[str, Callable[[int], Any]] = {"gym.make_vec": _ours}
    if importlib.util.find_spec("stable_baselines3"):
        kinds["SubprocVecEnv"] = _sb3
    rows = []
    for number in numbers:
        with ExitStack() as stack:
            vectors = {}
            for name, make in kinds.items():
                vectors[name] = make(number)
                stack.callback(vectors[name].close)
                vectors[name].reset()
            speeds: dict[str, list[float]] = {name: [] for name in vectors}
            for _ in range(_ROUNDS):
                for name, vector in vectors.items():
                    speeds[name].append(number * _rounds_per_second(vector, number))
            rows += [
                {
                    "kind": name,
                    "workers": number,
                    "steps_per_s": float(np.median(speeds[name])),
                    "mb_each": sum(_proportional_mb(process.pid) for process in vector.processes) / number,
                }
                for name, vector in vectors.items()
            ]
    return rows


def _ours(number: int) -> Any:
    return gym.make_vec("FixationPick-v0", num_envs=number, **_ARGUMENTS)


def _sb3(number: int) -> Any:
    """As its users make it, with one thread per worker: more only get into each other's way."""
    from stable_baselines3.common.vec_env import SubprocVecEnv

    os.environ |= {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
    return SubprocVecEnv(
        [partial(gym.make, "fixation_gym:FixationPick-v0", **_ARGUMENTS)] * number, start_method="spawn"
    )


def _rounds_per_second(vector: Any, number: int) -> float:
    """How often all environments step in a second."""
    actions = np.zeros((number, 7), np.float32)
    begin, calls = time.perf_counter(), 0
    while time.perf_counter() - begin < _ROUND_S:
        actions[:, 0], actions[:, 1] = 0.3 * np.cos(0.1 * calls), 0.3 * np.sin(0.1 * calls)
        vector.step(actions)
        calls += 1
    return calls / (time.perf_counter() - begin)


def _proportional_mb(pid: int) -> float:
    """Proportional set size of a process, MB."""
    with open(f"/proc/{pid}/smaps_rollup") as file:
        return next(int(line.split()[1]) / 1024 for line in file if line.startswith("Pss:"))
