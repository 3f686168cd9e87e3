"""Agents trained on plain scenes, tested on shifted ones beside policies that are not trained. Resumable."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from fixation_gym.evaluation import workers
from fixation_gym.evaluation.files import write_csv
from fixation_gym.evaluation.source import source_commit
from fixation_gym.evaluation.storage import EPISODES_FILE
from fixation_gym.experiments.runner import Cell, Experiment
from fixation_gym.experiments.transfer.config import Candidate, TransferConfig, candidate_agent
from fixation_gym.experiments.transfer.shifts import NONE, Shift, shift, table_hash
from fixation_gym.experiments.transfer.statistics import differences, format_table, rows

CSV_FILE, DIFFERENCES_FILE, FIGURE_FILE = "transfer.csv", "differences.csv", "transfer.png"
Key = tuple[str, int, str, str, str, int]
"""(name, training seed, digest of the file, axis, severity, seed of the episode)"""


def cell_key(cell: Mapping[str, Any]) -> Key:
    """What tells the results of one run apart."""
    return cell["name"], cell["training_seed"], cell["digest"], cell["axis"], cell["severity"], cell["seed"]


EXPERIMENT = Experiment(
    command="transfer",
    unit="episode",
    file=EPISODES_FILE,
    outputs=(CSV_FILE, DIFFERENCES_FILE, FIGURE_FILE),
    key=cell_key,
    content=frozenset({"name", "training_seed", "digest", "axis", "severity", "seed", "success", "collision"}),
    note=lambda value: f"{value['name']} {value['training_seed']}, {value['axis']} {value['severity']}",
    table=lambda summary: format_table(summary["rows"]),
)


def run_cell(cell: Cell) -> dict[str, Any]:
    """Run the episode of a cell."""
    from fixation_gym.evaluation.rollout import run_episode

    settings = (cell["policy"], cell["digest"], cell["scenario"], cell["axis"], cell["severity"])
    env, policy = workers.kept(_world, *settings, close=lambda world: world[0].close())
    result = run_episode(env, policy, cell["seed"])
    named = {name: cell[name] for name in ("name", "training_seed", "digest", "axis", "severity", "seed")}
    return {**named, "success": result.success, "collision": result.collision, "time_s": result.time_s}


def _world(policy: str, digest: str, scenario: str, axis: str, severity: str) -> tuple[Any, Any]:
    """A shifted environment, and who acts in it."""
    workers.prepare_process()
    import gymnasium

    from fixation_policies.catalogue import needed_environment

    place = needed_environment(policy)
    chosen = Shift(NONE, NONE) if axis == NONE else shift(axis, severity)
    # The oracle knows where everything is, so no image is rendered for it.
    size = None if policy == "oracle" else place.image_size
    env = gymnasium.make(place.env_id, image_size=size, **place.arguments, **chosen.arguments(scenario))
    return env, workers.make_policy(policy, env)


def train_missing(config: TransferConfig, folder: Path) -> list[Candidate]:
    """Train the agents that a folder does not have yet, or go on with them, as ``compare`` does."""
    if not config.configs:
        return []
    from fixation_policies.rl.compare import train_cell

    cells = config.training_cells(folder)
    trained = list(workers.run_cells(list(cells.values()), config.workers, run=train_cell))
    agents = [candidate_agent(summary["config"], summary["seed"], summary["agent"]) for summary in trained]
    order = list(cells)
    return sorted(agents, key=lambda agent: order.index((agent.name, agent.training_seed)))


def measure(
    config: TransferConfig,
    out: Path,
    run: Callable[[Cell], dict[str, Any]] = run_cell,
    train: Callable[[TransferConfig, Path], list[Candidate]] = train_missing,
) -> dict[str, Any]:
    """Train and test what a folder does not have yet, and write summary, CSVs and figure; see ``runner``.

    ``train`` makes the agents; tests replace it.
    """
    from fixation_gym.experiments.transfer.figure import draw_figure

    config = config.smaller()
    settings = {"scenario": config.scenario, "seed": config.seed, "shifts": table_hash()}
    with EXPERIMENT.opened(out, settings, run, config.workers) as folder:
        tested = [*train(config, config.runs or out), *config.given()]
        results = folder.results(config.cells(tested))
        learners = {one.name for one in tested if one.trained}
        table = rows(results, learners)
        reference = config.configs[0] if config.configs else ""
        about = {
            "tested": [f"{one.name} {one.training_seed}" for one in tested],
            "steps": config.comparison().training.steps if config.configs else None,
            "episodes": config.episodes,
            "episodes_resumed": folder.resumed,
            "commit": source_commit(),
        }
        summary = folder.write_summary({"rows": table, "differences": differences(results, learners, reference)}, about)
        write_csv(out / CSV_FILE, table)
        write_csv(out / DIFFERENCES_FILE, summary["differences"])
        draw_figure(out / FIGURE_FILE, table)
    return summary
