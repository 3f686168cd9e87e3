"""Is sight of the obstacles necessary? The best fixed blind way of every scenario, beside other policies. Resumable."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fixation_gym.evaluation import workers
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.evaluation.files import write_csv
from fixation_gym.evaluation.source import source_commit
from fixation_gym.evaluation.storage import EPISODES_FILE
from fixation_gym.experiments.necessity.config import ORACLE, Key, NecessityConfig
from fixation_gym.experiments.necessity.statistics import chosen_ways, format_table, summarise
from fixation_gym.experiments.runner import Cell, Experiment

if TYPE_CHECKING:
    from fixation_gym.envs.scene import SceneSpec

ROWS_FILE, TABLE_FILE, FIGURE_FILE = "rows.csv", "table.csv", "necessity.png"


def cell_key(cell: Mapping[str, Any]) -> Key:
    """What tells the results of one run apart."""
    return cell["scenario"], cell["member"], cell["seed"]


EXPERIMENT = Experiment(
    command="necessity",
    unit="episode",
    file=EPISODES_FILE,
    outputs=(ROWS_FILE, TABLE_FILE, FIGURE_FILE),
    key=cell_key,
    content=frozenset({"scenario", "member", "seed", "success", "collision"}),
    note=lambda value: f"{value['scenario']}, {value['member']}",
    table=lambda summary: format_table(summary["table"]),
)


def run_cell(cell: Cell) -> dict[str, Any]:
    """Run the episode of a cell; returns scenario, member, seed and how it ended."""
    return _run_with_images(cell) if "policy" in cell else _run_without_images(cell)


def _run_with_images(cell: Cell) -> dict[str, Any]:
    """Run the episode of a policy of the catalogue in the environment in which ``evaluate`` runs it."""
    from fixation_gym.experiments.necessity.episodes import play_in

    config = EvaluationConfig(policy=cell["policy"])
    env, policy = workers.world(config.cell((cell["scenario"], cell["seed"])))
    return {**_named(cell), **asdict(play_in(env, policy, cell["seed"]))}


def _run_without_images(cell: Cell) -> dict[str, Any]:
    """Run the episode of a blind way or of the oracle."""
    from fixation_gym.gl import select_backend

    select_backend()
    from fixation_gym.envs.config import CONTROL_FREQUENCY
    from fixation_gym.envs.pick_sim import PickSim
    from fixation_gym.experiments.necessity.episodes import World, play
    from fixation_gym.experiments.necessity.ways import WAYS
    from fixation_policies.blind_ways import BlindWayPolicy
    from fixation_policies.oracle import OraclePolicy

    sim = workers.kept(PickSim, CONTROL_FREQUENCY, close=lambda sim: None)
    world = World(sim, _scene(cell["scenario"], cell["seed"]))
    member = cell["member"]
    policy = OraclePolicy(world) if member == ORACLE else BlindWayPolicy(world, WAYS[member])
    return {**_named(cell), **asdict(play(world, policy))}


def _named(cell: Cell) -> dict[str, Any]:
    return {name: cell[name] for name in ("scenario", "member", "seed")}


@lru_cache(maxsize=1)
def _scene(scenario: str, seed: int) -> SceneSpec:
    """The scene of an episode, the same that the environment draws; all members meet it in a row."""
    from gymnasium.utils.seeding import np_random

    from fixation_gym.envs.config import SCENARIOS
    from fixation_gym.envs.sampling import sample_scene

    return sample_scene(SCENARIOS[scenario], np_random(seed)[0])


def measure(config: NecessityConfig, out: Path, run: Callable[[Cell], dict[str, Any]] = run_cell) -> dict[str, Any]:
    """Run the episodes that a folder does not have yet, and write summary, CSVs and figure; see ``runner``."""
    from fixation_gym.experiments.necessity.figure import draw_figure

    ways = tuple(config.ways)
    evaluated = config.evaluated()
    with EXPERIMENT.opened(out, {"seed": config.seed}, run, config.workers) as folder:
        choosing = folder.results(config.choosing().values())
        judging = folder.results(config.judging(chosen_ways(choosing, ways)).values())
        about = {
            "ways": {name: asdict(way) for name, way in config.ways.items()},
            "quick": config.quick,
            "episodes": config.episode_count,
            "episodes_resumed": folder.resumed,
            "commit": source_commit(),
        }
        summary = folder.write_summary(summarise([*choosing, *judging], ways, evaluated), about)
        write_csv(out / ROWS_FILE, summary["rows"])
        write_csv(out / TABLE_FILE, summary["table"])
        draw_figure(out / FIGURE_FILE, summary["rows"], summary["table"])
    return summary
