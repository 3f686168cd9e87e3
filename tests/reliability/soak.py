"""Random actions for long: no exception, no NaN, every observation in its space, ``info`` as promised, memory flat.

Every scenario is run in both environments, in pieces. A finished piece is a line of ``pieces.jsonl``, so the same
command again goes on; ``soak.csv`` has a row per scenario and environment.
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from fixation_gym.envs.config import SCENARIO_NAMES
from fixation_gym.envs.info import reward_terms
from fixation_gym.envs.rewards import TERMS
from fixation_gym.errors import UsageError, check_names
from fixation_gym.evaluation.files import write_csv
from fixation_gym.evaluation.source import source_commit
from fixation_gym.evaluation.text_table import aligned
from fixation_gym.evaluation.workers import kept, prepare_process
from fixation_gym.experiments.runner import Cell, Experiment
from fixation_gym.gl import MissingGLError, select_backend
from fixation_gym.names import Names

ENVIRONMENTS = ("FixationPick-v0", "FixationPickZFC-v0")
WARM_UP = 5
"""Episodes of a new environment before memory counts: caches fill, and the allocator takes what it needs."""
LONGEST_HOLD = 20
"""An action is held for up to so many steps: others every step only tremble, and never get anywhere."""
CSV_FILE = "soak.csv"
FLAGS = ("is_success", "success", "collision")
NUMBERS = ("clearance_m", "distance_true_m", "fixation_error_px", *(f"reward_{term}" for term in TERMS))


@dataclass(frozen=True)
class Args:
    """How long, and where."""

    steps: int = 100_000
    """Random steps per scenario and environment."""
    resets: int = 1_000
    """Over so many resets."""
    piece: int = 100
    """Resets of a piece, between which another environment is built."""
    scenario: Names = SCENARIO_NAMES
    """Scenario names, separated by commas."""
    image_size: tuple[int, int] = (240, 320)
    """Height and width of the wrist image, px."""
    workers: int = 1
    """Number of processes."""
    seed: int = 0
    """Of scenes and actions."""
    out: Path = Path("out/soak")
    """Folder of the results."""

    def cells(self) -> list[Cell]:
        """All pieces; the first of every scenario, then the second of every one: part of a run has met all of them."""
        check_names(self.scenario, SCENARIO_NAMES, "scenario")
        if not 1 <= self.piece <= self.resets or self.steps < self.resets or self.resets % self.piece:
            raise UsageError("--steps must be at least --resets, and --resets a multiple of --piece")
        return [
            {
                "environment": environment,
                "scenario": scenario,
                "index": index,
                "resets": self.piece,
                "mean_steps": self.steps // self.resets,
            }
            for index in range(self.resets // self.piece)
            for scenario in self.scenario
            for environment in ENVIRONMENTS
        ]


def format_table(summary: Mapping[str, Any]) -> str:
    """Rows and sums as plain text."""
    rows = summary["rows"]
    table = aligned([[*rows[0]], *([str(value) for value in row.values()] for row in rows)])
    steps, episodes, faults = (sum(row[name] for row in rows) for name in ("steps", "episodes", "faults"))
    return f"{table}\n\n{steps} steps, {episodes} episodes, {faults} faults"


EXPERIMENT = Experiment(
    command="soak",
    unit="piece",
    file="pieces.jsonl",
    outputs=(CSV_FILE,),
    key=lambda cell: (cell["environment"], cell["scenario"], cell["index"]),
    content=frozenset({"environment", "scenario", "index", "steps", "faults", "rss_mb"}),
    note=lambda value: f"{value['scenario']}, {value['environment']}, {len(value['faults'])} faults",
    table=format_table,
)


class Soaked:
    """An environment that is kept for the next piece, and the episodes that it has had."""

    def __init__(self, environment: str, scenario: str, image_size: tuple[int, int]) -> None:
        import gymnasium

        prepare_process()
        self.env = gymnasium.make(f"fixation_gym:{environment}", scenario=scenario, image_size=image_size)
        self.episodes = 0

    def close(self) -> None:
        self.env.close()


def run_piece(cell: Cell) -> dict[str, Any]:
    """Run the episodes of a piece; returns the cell with its steps, faults and resident memory after each episode."""
    soaked = kept(Soaked, cell["environment"], cell["scenario"], tuple(cell["image_size"]), close=Soaked.close)
    rng = np.random.default_rng([cell["seed"], SCENARIO_NAMES.index(cell["scenario"]), cell["index"]])
    lengths = episode_lengths(cell["resets"], cell["mean_steps"], rng)
    steps, faults, rss_mb = 0, set(), []
    for number, length in enumerate(lengths):
        seed = cell["seed"] * 100_000 + cell["index"] * cell["resets"] + number
        try:
            done, found = run_episode(soaked.env, seed, length, rng)
        except Exception as error:  # whatever it is, it is a fault to be listed
            done, found = 0, {f"{type(error).__name__}: {error}"}
        steps += done
        faults |= {f"seed {seed}: {fault}" for fault in found}
        soaked.episodes += 1
        if soaked.episodes > WARM_UP:
            rss_mb.append(resident_mb())
    return {**cell, "steps": steps, "faults": sorted(faults), "rss_mb": rss_mb}


def episode_lengths(count: int, mean: int, rng: np.random.Generator) -> list[int]:
    """Lengths that are between 1 and twice the mean, and sum to ``count * mean``."""
    half = rng.integers(1, 2 * mean, count // 2)
    return [*half.tolist(), *(2 * mean - half).tolist(), *[mean] * (count % 2)]


def run_episode(env: Any, seed: int, length: int, rng: np.random.Generator) -> tuple[int, set[str]]:
    """Random actions for so many steps, again from the start where an episode ends; steps done, and faults."""
    observation, info = env.reset(seed=seed)
    faults = faults_of(env, observation, info, 0.0)
    action, hold = env.action_space.sample(), 0
    for _ in range(length):
        if hold == 0:
            low, high = env.action_space.low, env.action_space.high
            action, hold = rng.uniform(low, high).astype(np.float32), int(rng.integers(1, LONGEST_HOLD + 1))
        hold -= 1
        observation, reward, terminated, truncated, info = env.step(action)
        faults |= faults_of(env, observation, info, reward)
        if terminated or truncated:
            observation, info = env.reset()
            faults |= faults_of(env, observation, info, 0.0)
    return length, faults


def faults_of(env: Any, observation: Mapping[str, Any], info: Mapping[str, Any], reward: Any) -> set[str]:
    """What is wrong with a step's results; empty if nothing is."""
    faults = set()
    for key, space in env.observation_space.items():
        if not space.contains(observation[key]):
            faults.add(f"{key} is not in its space")
    if set(observation) != set(env.observation_space):
        faults.add("keys of the observation are not those of its space")
    if not isinstance(reward, float) or not math.isfinite(reward):
        faults.add(f"reward is {reward!r}")
    if not {*FLAGS, *NUMBERS} <= set(info):
        return faults | {"info lacks keys"}
    faults |= {f"info {key} is {info[key]!r}" for key in FLAGS if not isinstance(info[key], np.bool_)}
    for key in NUMBERS:
        may_be_nan = key == "fixation_error_px" and info["distance_true_m"] <= 0.0
        if not isinstance(info[key], np.float64) or not (math.isfinite(info[key]) or may_be_nan):
            faults.add(f"info {key} is {info[key]!r}")
    if not math.isclose(sum(reward_terms(info).values()), reward, abs_tol=1e-9):
        faults.add("reward terms do not sum to the reward")
    return faults


def resident_mb() -> float:
    """Memory of this process that is in use, MB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def slope(pieces: Sequence[Mapping[str, Any]]) -> float | None:
    """Growth of memory, MB per 1000 episodes: the median over pieces of a line through the second half of each.

    In the first half the allocator still takes what a new environment needs at most: about 40 MB, at a moment that
    depends on the scenes, and the same again in every piece.
    """
    halves = [piece["rss_mb"][len(piece["rss_mb"]) // 2 :] for piece in pieces]
    slopes = [float(np.polyfit(range(len(half)), half, 1)[0]) for half in halves if len(half) > 1]
    return 1000.0 * float(np.median(slopes)) if slopes else None


def row_of(environment: str, scenario: str, pieces: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The row of a scenario in an environment."""
    memory = [value for piece in pieces for value in piece["rss_mb"]]
    return {
        "environment": environment,
        "scenario": scenario,
        "steps": sum(piece["steps"] for piece in pieces),
        "episodes": sum(piece["resets"] for piece in pieces),
        "faults": sum(len(piece["faults"]) for piece in pieces),
        "first_fault": next((fault for piece in pieces for fault in piece["faults"]), ""),
        "rss_max_mb": max(memory, default=None),
        "rss_mb_per_1000_episodes": slope(pieces),
    }


def run(args: Args) -> int:
    """Soak and print the table; exit code 1 with faults."""
    cells = [{**cell, "image_size": list(args.image_size), "seed": args.seed} for cell in args.cells()]
    select_backend()
    settings = {"seed": args.seed, "image_size": list(args.image_size), "piece": args.piece}
    settings |= {"mean_steps": args.steps // args.resets, "commit": source_commit()}
    with EXPERIMENT.opened(args.out, settings, run_piece, args.workers) as folder:
        pieces = folder.results(cells)
        keys = dict.fromkeys((piece["environment"], piece["scenario"]) for piece in pieces)
        rows = [row_of(*key, [p for p in pieces if (p["environment"], p["scenario"]) == key]) for key in keys]
        folder.write_summary({"rows": rows}, {"resumed": folder.resumed})
        write_csv(args.out / CSV_FILE, rows)
    EXPERIMENT.show({"rows": rows}, args.out)
    return 1 if any(row["faults"] for row in rows) else 0


if __name__ == "__main__":
    try:
        sys.exit(run(tyro.cli(Args, description=__doc__)))
    except (UsageError, MissingGLError) as error:
        sys.exit(f"soak: error: {error}")
