"""Evaluation of a policy over scenarios and seeds, resumable, and its summary."""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fixation_gym.doctor import installed_versions
from fixation_gym.errors import UsageError, check_names
from fixation_gym.evaluation import workers
from fixation_gym.evaluation.files import write_json
from fixation_gym.evaluation.missing_cells import run_missing
from fixation_gym.evaluation.report import summarise
from fixation_gym.evaluation.rollout import EpisodeResult
from fixation_gym.evaluation.source import source_commit
from fixation_gym.evaluation.storage import SUMMARY_FILE, EpisodeKey, EpisodeStore

SEED_BLOCK = 100_000
"""Episode i of ``--seed S`` has seed S * SEED_BLOCK + i, in every scenario: policies meet the same scenes."""

_IMAGE_SIZES = (32, 2048)


@dataclass(frozen=True)
class EvaluationConfig:
    """What to evaluate, and with how many processes."""

    policy: str = "servo"
    scenarios: tuple[str, ...] = ("clear",)
    episodes: int = 20
    """Episodes per scenario."""
    seed: int = 0
    sensor_noise: str = "nominal"
    image_size: tuple[int, int] = (240, 320)
    """Height and width of the wrist image, px."""
    env_id: str | None = None
    """None: the environment in which the policy acts."""
    detector: str | None = None
    """Finds the target for a policy that looks: a name, or ``module:Class``; None for the default."""
    workers: int = 1
    backend: str = "loky"

    def check(self) -> None:
        """Check everything that can be checked without building an environment.

        Raises:
            UsageError: naming the first bad value and what is allowed.
        """
        from fixation_gym.envs.config import SCENARIO_NAMES, SENSOR_NOISE
        from policies.catalogue import check_detector, check_policy

        check_policy(self.policy)
        check_detector(self.detector, self.policy)
        check_names(self.scenarios, SCENARIO_NAMES, "scenario")
        check_names([self.sensor_noise], SENSOR_NOISE, "sensor noise")
        if not self.scenarios or len(set(self.scenarios)) < len(self.scenarios):
            raise UsageError(f"--scenario must name one or more different scenarios, got {','.join(self.scenarios)!r}")
        if not 1 <= self.episodes <= SEED_BLOCK:
            raise UsageError(f"--episodes must be within 1..{SEED_BLOCK}, got {self.episodes}")
        if self.seed < 0:
            raise UsageError(f"--seed must be 0 or more, got {self.seed}")
        if not all(_IMAGE_SIZES[0] <= size <= _IMAGE_SIZES[1] for size in self.image_size):
            raise UsageError(f"--image-size must be within {_IMAGE_SIZES[0]}..{_IMAGE_SIZES[1]}, got {self.image_size}")
        workers.check_backend(self.backend, self.workers)

    @property
    def environment(self) -> str:
        """Id of the environment."""
        from policies.catalogue import surroundings

        return self.env_id or surroundings(self.policy).env_id

    def run_description(self) -> dict[str, Any]:
        """Everything the result of one episode depends on, apart from its scenario and seed."""
        from policies.catalogue import source_hashes

        return {
            "policy": self.policy,
            "seed": self.seed,
            "sensor_noise": self.sensor_noise,
            "image_size": list(self.image_size),
            "env_id": self.environment,
            **({} if self.detector is None else {"detector": self.detector}),
            **source_hashes(self.policy, self.detector),
            "gl": os.environ.get("MUJOCO_GL"),
            "versions": installed_versions(),
        }

    def episode_keys(self) -> list[EpisodeKey]:
        """(scenario, seed) of every episode, in order."""
        return [(scenario, seed) for scenario in self.scenarios for seed in episode_seeds(self.seed, self.episodes)]

    def cell(self, key: EpisodeKey) -> workers.Cell:
        """The episode with this key, as ``workers.run_cell`` takes it."""
        scenario, seed = key
        return {
            "env_id": self.environment,
            "scenario": scenario,
            "policy": self.policy,
            "detector": self.detector,
            "seed": seed,
            "sensor_noise": self.sensor_noise,
            "image_size": list(self.image_size),
        }


def episode_seeds(seed: int, episodes: int) -> list[int]:
    """Seeds of the episodes of one scenario; blocks of different ``seed`` never overlap."""
    return [seed * SEED_BLOCK + index for index in range(episodes)]


def seed_hash(keys: Sequence[EpisodeKey]) -> str:
    """SHA-256 over the list of (scenario, seed), as compact JSON: equal hashes mean the same episodes."""
    return hashlib.sha256(json.dumps([list(key) for key in keys], separators=(",", ":")).encode()).hexdigest()


def evaluate(
    config: EvaluationConfig, out: Path, run: Callable[[workers.Cell], dict[str, Any]] = workers.run_cell
) -> dict[str, Any]:
    """Run the episodes that a folder does not have yet, and write its summary.

    Args:
        config: must have passed ``check``.
        out: folder; made if needed.
        run: runs one cell; tests replace it.

    Returns:
        The summary, as in ``summary.json``.

    Raises:
        UsageError: if the folder cannot be used.
    """
    started = time.monotonic()
    keys = config.episode_keys()
    with EpisodeStore(out, {"command": "evaluate", **config.run_description()}) as store:
        finished = store.finished
        resumed = run_missing(
            store,
            {key: config.cell(key) for key in keys},
            run,
            parse=EpisodeResult.from_json,
            note=lambda result: f"{result.scenario}, success {_successes(finished, keys)}",
            unit="episode",
            processes=config.workers,
            backend=config.backend,
        )
        workers.close_worlds()
        summary = summary_of(config, [store.finished[key] for key in keys], time.monotonic() - started)
        summary["episodes_resumed"] = resumed
        write_json(out / SUMMARY_FILE, summary)
    return summary


def summary_of(config: EvaluationConfig, results: Sequence[EpisodeResult], wall_s: float) -> dict[str, Any]:
    """The content of ``summary.json``; ``wall_s`` is the time of this call, without earlier, interrupted ones."""
    return {
        "policy": config.policy,
        "scenarios": summarise(results),
        "seed_sha256": seed_hash(config.episode_keys()),
        "seed": config.seed,
        "sensor_noise": config.sensor_noise,
        "image_size": list(config.image_size),
        "versions": installed_versions(),
        "commit": source_commit(),
        "gl": os.environ.get("MUJOCO_GL"),
        "wall_s": wall_s,
    }


def _successes(finished: Mapping[EpisodeKey, EpisodeResult], keys: Sequence[EpisodeKey]) -> str:
    """Successes so far among the episodes that are asked for, as k/n."""
    done = [finished[key] for key in keys if key in finished]
    return f"{sum(result.success for result in done)}/{len(done)}"
