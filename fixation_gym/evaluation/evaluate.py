"""Evaluation of a policy over scenarios and seeds, resumable, and its summary."""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from fixation_gym.doctor import installed_versions
from fixation_gym.evaluation import workers
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.evaluation.files import write_json
from fixation_gym.evaluation.missing_cells import run_missing
from fixation_gym.evaluation.report import summarise
from fixation_gym.evaluation.rollout import EpisodeKey, EpisodeResult
from fixation_gym.evaluation.source import source_commit
from fixation_gym.evaluation.storage import SUMMARY_FILE, EpisodeStore


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
        workers.close_kept()
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
        "image_size": list(config.needed_environment.image_size),
        "versions": installed_versions(),
        "commit": source_commit(),
        "gl": os.environ.get("MUJOCO_GL"),
        "wall_s": wall_s,
    }


def _successes(finished: Mapping[EpisodeKey, EpisodeResult], keys: Sequence[EpisodeKey]) -> str:
    """Successes so far among the episodes that are asked for, as k/n."""
    done = [finished[key] for key in keys if key in finished]
    return f"{sum(result.success for result in done)}/{len(done)}"
