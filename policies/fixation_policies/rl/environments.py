"""The environments of a training run, in processes of their own."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import SubprocVecEnv

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.starter import end_with
from fixation_policies.rl.config import TRAIN_SEEDS, VALIDATION_SEEDS, TrainConfig
from fixation_policies.rl.decisions import DecisionEnv, FixedEpisodes

_DEATHS = (EOFError, BrokenPipeError, ConnectionResetError)
"""What a pipe says when the process at its other end is gone."""


def make_learner_env(config: TrainConfig, rank: int) -> gym.Env[Any, Any]:
    """The environment of worker ``rank`` as the learner sees it; its share of the validation is built in."""
    import cv2

    import fixation_gym  # noqa: F401  (a spawned process has not registered the ids)
    from fixation_gym.gl import select_backend

    select_backend()
    cv2.setNumThreads(1)
    arguments: dict[str, Any] = {
        "scenario": config.scenario,
        "image_size": config.image_size,
        "sensor_noise": config.sensor_noise,
    }
    learner = config.learner
    if learner.residual:
        from fixation_policies.rl.residual import ResidualEnv

        env: gym.Env[Any, Any] = ResidualEnv(gym.make("FixationPick-v0", **arguments))
    else:
        env = gym.make("FixationPickZFC-v0", observation=learner.observation, **arguments)
    seeds = [VALIDATION_SEEDS + index for index in range(config.eval_episodes)][rank :: config.workers]
    fixed = FixedEpisodes(DecisionEnv(env, learner), seeds or [VALIDATION_SEEDS])
    return Monitor(fixed, info_keywords=("is_success", "collision"))


def start_workers(config: TrainConfig) -> SubprocVecEnv:
    """Environments to learn in, and to validate in between: each takes nearly a gigabyte."""
    return _spawn([partial(_make_in_worker, config, rank, os.getpid()) for rank in range(config.workers)])


def _make_in_worker(config: TrainConfig, rank: int, starter: int) -> gym.Env[Any, Any]:
    end_with(starter)
    return make_learner_env(config, rank)


def draw_new_scenes(envs: SubprocVecEnv, config: TrainConfig, decisions: int) -> None:
    """Let the environments draw scenes that no other part of any run meets.

    Args:
        envs: from ``start_workers``.
        config: of the run.
        decisions: that the run has made so far.
    """
    rng = np.random.default_rng([config.seed, decisions])
    for rank, seed in enumerate(rng.integers(TRAIN_SEEDS, 2 * TRAIN_SEEDS, envs.num_envs)):
        envs.env_method("release", int(seed), indices=rank)


def _spawn(makers: list[Callable[[], gym.Env[Any, Any]]]) -> SubprocVecEnv:
    # Inherited by the workers. More threads than cores only get into each other's way.
    for variable in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    from fixation_gym.gl import select_backend

    select_backend()  # once, and not in every worker
    return SubprocVecEnv(makers, start_method="spawn")


@contextlib.contextmanager
def closing(envs: SubprocVecEnv) -> Iterator[SubprocVecEnv]:
    """Close the worker processes at the end, also those that are during a step or lost their siblings."""
    try:
        yield envs
    finally:
        for remote in envs.remotes:
            with contextlib.suppress(OSError):
                remote.send(("close", None))
        for process in envs.processes:
            process.join(timeout=2.0)
            if process.is_alive():
                process.terminate()
                process.join()
        envs.closed = True


@contextlib.contextmanager
def worker_deaths(advice: Callable[[], str]) -> Iterator[None]:
    """Report the death of a worker process as an error of use.

    Args:
        advice: what can be done about it, asked for when it happens.

    Raises:
        UsageError: if one died.
    """
    try:
        yield
    except _DEATHS as error:
        raise UsageError(
            f"a worker process ended: what it said is above, and if it said nothing memory may be short; {advice()}"
        ) from error
