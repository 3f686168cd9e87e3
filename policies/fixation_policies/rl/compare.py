"""The comparison: configurations x seeds, each trained and tested by one picklable function."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from fixation_gym.doctor import installed_versions
from fixation_gym.errors import UsageError, check_names
from fixation_gym.evaluation import workers
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.evaluation.evaluate import evaluate
from fixation_gym.evaluation.files import write_csv, write_json
from fixation_gym.evaluation.missing_cells import run_missing
from fixation_gym.evaluation.source import source_commit
from fixation_gym.evaluation.storage import RUN_FILE, SUMMARY_FILE, ResultStore
from fixation_policies.catalogue import needed_environment
from fixation_policies.rl.comparison_tables import (
    CURVES_FILE,
    DIFFERENCES_FILE,
    FIGURE_FILE,
    TABLE_FILE,
    curves_of,
    differences_of,
    table_of,
)
from fixation_policies.rl.config import CONFIGS, FINAL_FILE, TrainConfig

RUNS_FOLDER = "runs"
CELLS_FILE = "cells.jsonl"
SERVO = "servo"
TEST_SEED = 5
"""``--seed`` of the tests: a block of its own, that nothing is tuned on."""

CellKey = tuple[str, int]
"""(configuration, seed)"""
QUICK = TrainConfig(steps=600, eval_every=300, eval_episodes=8, learning_starts=200, buffer_size=2000)


@dataclass(frozen=True)
class CompareConfig:
    """What to compare."""

    configs: tuple[str, ...] = ("zfc", "blind", "rgb", "residual")
    seeds: int = 5
    training: TrainConfig = field(default_factory=TrainConfig)
    """Of every run; its configuration and seed are replaced."""
    scenarios: tuple[str, ...] = ("mixed",)
    """What the final agents are tested on."""
    episodes: int = 50
    """Per scenario and agent; the same for all."""
    workers: int = 1
    """Runs at the same time; each has its own worker processes."""
    backend: str = "loky"

    def check(self) -> None:
        """Check everything that can be checked without training.

        Raises:
            UsageError: naming the first bad value and what is allowed.
        """
        check_names(self.configs, CONFIGS, "configuration")
        if len(set(self.configs)) < len(self.configs):
            raise UsageError(f"--config must name one or more different ones, got {','.join(self.configs)!r}")
        if not 1 <= self.seeds <= 1000:
            raise UsageError(f"--seeds must be within 1..1000, got {self.seeds}")
        self.training.check()
        workers.check_backend(self.backend, self.workers)
        EvaluationConfig(SERVO, scenarios=self.scenarios, episodes=self.episodes, seed=TEST_SEED).check()

    def cells(self, out: Path) -> dict[CellKey, workers.Cell]:
        """All runs, and the servo's test."""
        test = {"scenarios": list(self.scenarios), "episodes": self.episodes, "processes": self._test_processes}
        runs = [(config, seed) for seed in range(self.seeds) for config in self.configs]
        cells: dict[CellKey, workers.Cell] = {
            (SERVO, 0): {"config": SERVO, "seed": 0, **test, "folder": str(out.resolve() / RUNS_FOLDER / SERVO)}
        }
        for config, seed in runs:
            training = asdict(replace(self.training, config=config, seed=seed))
            folder = str(out.resolve() / RUNS_FOLDER / f"{config}-{seed}")
            cells[config, seed] = {"config": config, "seed": seed, "training": training, **test, "folder": folder}
        return cells

    @property
    def _test_processes(self) -> int:
        """Several runs at a time keep the cores busy by themselves."""
        return self.training.workers if self.workers == 1 and self.backend == "loky" else 1


def train_cell(cell: workers.Cell) -> dict[str, Any]:
    """Train one agent. It goes on where an earlier call was killed, and returns at once if that had finished.

    Returns:
        The summary of the training, and ``agent``, the path of the final agent.
    """
    from fixation_policies.rl.train import train

    folder = Path(cell["folder"])
    values = {**cell["training"], "image_size": tuple(cell["training"]["image_size"])}
    summary = train(TrainConfig(**values), folder, resume=(folder / RUN_FILE).exists())
    return {**summary, "agent": str(folder / FINAL_FILE)}


def run_cell(cell: workers.Cell) -> dict[str, Any]:
    """Train and test one agent, or test the servo. It goes on where an earlier call was killed.

    Returns:
        JSON-able: ``config``, ``seed``, ``curve``, ``wall_s`` and ``seconds`` of the training, ``scenarios`` as in
        ``evaluate``.
    """
    folder = Path(cell["folder"])
    trained: dict[str, Any] = {"curve": [], "wall_s": 0.0, "seconds": {}}
    policy, image_size = SERVO, needed_environment(SERVO).image_size
    if cell["config"] != SERVO:
        trained = train_cell(cell)
        policy, image_size = trained["agent"], tuple(cell["training"]["image_size"])
    test = EvaluationConfig(
        policy,
        scenarios=tuple(cell["scenarios"]),
        episodes=cell["episodes"],
        seed=TEST_SEED,
        image_size=image_size,
        workers=cell["processes"],
    )
    tested = evaluate(test, folder / "test")
    return {
        "config": cell["config"],
        "seed": cell["seed"],
        "curve": trained["curve"],
        "wall_s": trained["wall_s"],
        "seconds": trained["seconds"],
        "scenarios": tested["scenarios"],
    }


def compare(
    config: CompareConfig, out: Path, run: Callable[[workers.Cell], dict[str, Any]] = run_cell
) -> dict[str, Any]:
    """Run what a folder lacks, then write tables and figure.

    Args:
        config: must have passed ``check``.
        out: folder; made if needed. With a cluster, one that all its machines see.
        run: runs one cell; tests replace it.

    Returns:
        The summary, as in ``summary.json``.

    Raises:
        UsageError: if the folder cannot be used or a run fails for a reason that is the user's to repair.
    """
    started = time.monotonic()
    training = replace(config.training, config="zfc", seed=0, workers=1)
    described = {"command": "compare", "training": asdict(training), "scenarios": list(config.scenarios)}
    described |= {"episodes": config.episodes, "versions": installed_versions()}
    cells = config.cells(out)
    with ResultStore(out, described, CELLS_FILE, key=_key, from_json=_parsed, to_json=dict) as store:
        run_missing(store, cells, run, _parsed, _note, "run", config.workers, config.backend)
        results = [store.finished[key] for key in cells]
        summary = summary_of(config, results, time.monotonic() - started)
        write_csv(out / CURVES_FILE, summary["curves"])
        write_csv(out / TABLE_FILE, summary["table"])
        write_csv(out / DIFFERENCES_FILE, summary["differences"])
        write_json(out / SUMMARY_FILE, summary)
    from fixation_policies.rl.comparison_figure import draw_comparison

    draw_comparison(summary, out / FIGURE_FILE)
    return summary


def summary_of(config: CompareConfig, results: Sequence[dict[str, Any]], wall_s: float) -> dict[str, Any]:
    """The content of ``summary.json``; ``wall_s`` is the time of this call, without earlier, interrupted ones."""
    return {
        "configs": list(config.configs),
        "seeds": config.seeds,
        "training": {**asdict(config.training), "image_size": list(config.training.image_size)},
        "test": {"scenarios": list(config.scenarios), "episodes": config.episodes, "seed": TEST_SEED},
        "table": table_of(results),
        "differences": differences_of(results, config.configs[0]),
        "curves": curves_of(results),
        "runs": list(results),
        "versions": installed_versions(),
        "commit": source_commit(),
        "wall_s": wall_s,
    }


def _key(result: dict[str, Any]) -> CellKey:
    return result["config"], result["seed"]


def _parsed(values: dict[str, Any]) -> dict[str, Any]:
    missing = {"config", "seed", "curve", "wall_s", "scenarios"} - set(values)
    if missing:
        raise TypeError(f"a result lacks {missing}")
    return dict(values)


def _note(result: dict[str, Any]) -> str:
    rates = ", ".join(f"{name} {row['successes']}/{row['episodes']}" for name, row in result["scenarios"].items())
    return f"{result['config']} {result['seed']}: {rates}"
