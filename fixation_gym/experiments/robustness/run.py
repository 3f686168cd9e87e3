"""The servo and its map under one degradation after the other. Resumable."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from fixation_gym.evaluation import workers
from fixation_gym.evaluation.files import write_csv
from fixation_gym.evaluation.source import source_commit
from fixation_gym.evaluation.storage import EPISODES_FILE
from fixation_gym.experiments.robustness.config import RobustnessConfig
from fixation_gym.experiments.robustness.degradations import DEGRADATIONS
from fixation_gym.experiments.robustness.statistics import format_table, summarise
from fixation_gym.experiments.runner import Cell, Experiment

CSV_FILE, FIGURE_FILE = "robustness.csv", "robustness.png"


def cell_key(cell: Mapping[str, Any]) -> tuple[str, str, int, str]:
    """What tells the results of one run apart. A row whose noise was changed is measured again."""
    return cell["row"], cell["scenario"], cell["seed"], json.dumps(cell["noise"])


EXPERIMENT = Experiment(
    command="robustness",
    unit="episode",
    file=EPISODES_FILE,
    outputs=(CSV_FILE, FIGURE_FILE),
    key=cell_key,
    content=frozenset({"row", "scenario", "seed", "noise", "success", "collision", "counts"}),
    note=lambda value: f"{value['row']}, {value['scenario']}",
    table=lambda summary: format_table(summary["rows"]),
)


def run_cell(cell: Cell) -> dict[str, Any]:
    """Run the episode of a cell."""
    from fixation_gym.experiments.robustness.episode import run_degraded

    env, policy = workers.kept(_world, cell["row"], cell["scenario"], close=lambda world: world[0].close())
    return {**cell, **asdict(run_degraded(env, policy, cell["seed"]))}


def _world(row: str, scenario: str) -> tuple[Any, Any]:
    """Environment with a degradation, and the servo in it."""
    workers.prepare_process()
    import gymnasium

    noise = asdict(DEGRADATIONS[row])
    env = gymnasium.make("fixation_gym:FixationPick-v0", scenario=scenario, sensor_noise=noise)
    return env, workers.make_policy("servo", env)


def measure(config: RobustnessConfig, out: Path, run: Callable[[Cell], dict[str, Any]] = run_cell) -> dict[str, Any]:
    """Run the episodes that a folder does not have yet, and write summary, CSV and figure; see ``runner``."""
    from fixation_gym.experiments.robustness.figure import draw_figure

    noise = {row: asdict(DEGRADATIONS[row]) for row in config.row_names}
    with EXPERIMENT.opened(out, {"seed": config.seed}, run, config.workers) as folder:
        rows = summarise(folder.results(config.cells()))
        about = {"noise": noise, "episodes_resumed": folder.resumed, "commit": source_commit()}
        summary = folder.write_summary({"rows": rows}, about)
        write_csv(out / CSV_FILE, rows)
        draw_figure(out / FIGURE_FILE, rows)
    return summary
