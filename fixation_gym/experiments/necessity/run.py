"""Is sight of the obstacles necessary? The best fixed blind way of every scenario, beside other policies. Resumable."""

from __future__ import annotations

import atexit
import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fixation_gym.errors import UsageError, check_names
from fixation_gym.evaluation import workers
from fixation_gym.evaluation.evaluate import SEED_BLOCK, EvaluationConfig, episode_seeds
from fixation_gym.evaluation.files import write_csv
from fixation_gym.evaluation.source import source_commit
from fixation_gym.evaluation.storage import EPISODES_FILE, EpisodeKey
from fixation_gym.experiments.necessity.statistics import AGENT, chosen_ways, summarise
from fixation_gym.experiments.runner import Cell, Experiment

if TYPE_CHECKING:
    from fixation_gym.envs.pick_sim import PickSim
    from fixation_gym.envs.scene import SceneSpec
    from policies.blind_ways import BlindWay

ROWS_FILE, TABLE_FILE, FIGURE_FILE = "rows.csv", "table.csv", "necessity.png"
ORACLE = "oracle"
POLICIES = ("blind", "blind:slow")
"""Blind policies that see the target with the wrist camera."""
QUICK_SCENARIOS = ("opaque", "screen", "clutter")

Key = tuple[str, str, int]
"""(scenario, member, seed)"""


@dataclass(frozen=True)
class NecessityConfig:
    """What to try, and with how many processes."""

    scenarios: tuple[str, ...] | None = None
    """None: all with obstacles or, if quick, three of them."""
    quick: bool = False
    """A few ways, and four episodes instead of forty."""
    episodes: int | None = None
    """Episodes per scenario and member, an even number; None for 40, or 4 if quick."""
    seed: int = 0
    agent: Path | None = None
    """An agent's zip to put beside the others."""
    evaluation: Path | None = None
    """Folder of an evaluation of the same block of seeds, to be paired with the best ways."""
    workers: int = 1

    def check(self) -> None:
        """Check everything that can be checked without the simulator.

        Raises:
            UsageError: naming the first bad value and what is allowed.
        """
        from fixation_gym.envs.config import SCENARIO_NAMES
        from policies.catalogue import AGENT_SUFFIX, check_policy

        names = self.scenario_names
        check_names(names, SCENARIO_NAMES, "scenario")
        if not names or len(set(names)) < len(names):
            raise UsageError(f"--scenario must name one or more different scenarios, got {','.join(names)!r}")
        if not 2 <= self.episode_count <= SEED_BLOCK or self.episode_count % 2:
            raise UsageError(f"--episodes must be an even number within 2..{SEED_BLOCK}, got {self.episodes}")
        if self.seed < 0:
            raise UsageError(f"--seed must be 0 or more, got {self.seed}")
        if self.agent is not None:
            if self.agent.suffix != AGENT_SUFFIX:
                raise UsageError(f"--agent must be an agent's {AGENT_SUFFIX}, got {self.agent}")
            check_policy(str(self.agent))
        self.evaluated()
        workers.check_backend("loky", self.workers)

    @property
    def scenario_names(self) -> tuple[str, ...]:
        """Scenarios to try the ways in."""
        if self.scenarios is not None:
            return self.scenarios
        return QUICK_SCENARIOS if self.quick else scenarios_with_obstacles()

    @property
    def episode_count(self) -> int:
        """Episodes per scenario and member."""
        return self.episodes if self.episodes is not None else 4 if self.quick else 40

    @property
    def ways(self) -> Mapping[str, BlindWay]:
        """Ways by name."""
        from fixation_gym.experiments.necessity.ways import QUICK_WAYS, WAYS

        return QUICK_WAYS if self.quick else WAYS

    def policies(self) -> dict[str, str]:
        """Names or files of the policies that need images, by member; another agent is another member."""
        from policies.catalogue import POLICY_NAMES

        members = {name: name for name in POLICIES if name in POLICY_NAMES}
        if self.agent is not None:
            digest = hashlib.sha256(self.agent.read_bytes()).hexdigest()
            members[f"{AGENT}:{digest[:12]}"] = str(self.agent)
        return members

    def evaluated(self) -> dict[EpisodeKey, bool] | None:
        """Success without collision of the evaluation by (scenario, seed); None without one.

        Raises:
            UsageError: if the folder cannot be read, or is of other seeds.
        """
        if self.evaluation is None:
            return None
        from fixation_gym.evaluation.folders import read_evaluation

        read = read_evaluation(self.evaluation)
        if read.run["seed"] != self.seed:
            raise UsageError(
                f"--evaluation must be of --seed {self.seed}, but {self.evaluation} is of seed {read.run['seed']}"
            )
        return {(result.scenario, result.seed): result.collision_free_success for result in read.results}

    def choosing(self) -> dict[Key, Cell]:
        """Episodes on which ways are chosen: all ways on the even seeds, and the oracle.

        A seed's scenarios come before the next seed, so that part of a run shows the whole. All members meet a scene
        in a row, for drawing it may take longer than a way.
        """
        seeds = episode_seeds(self.seed, self.episode_count)[::2]
        members = {name: (*self.ways, ORACLE) for name in self.scenario_names}
        return _cells(seeds, members)

    def judging(self, chosen: Mapping[str, tuple[str, ...]]) -> dict[Key, Cell]:
        """Episodes on the odd seeds: the chosen ways by scenario, the oracle, and the policies with images.

        Those come last: an environment of each scenario has to be built for them.
        """
        seeds = episode_seeds(self.seed, self.episode_count)[1::2]
        cells = _cells(seeds, {name: (*chosen[name], ORACLE) for name in self.scenario_names})
        for member, policy in self.policies().items():
            with_images = _cells(seeds, {name: (member,) for name in self.scenario_names}, by_scenario=True)
            cells |= {key: {**cell, "policy": policy} for key, cell in with_images.items()}
        return cells


def _cells(seeds: Sequence[int], members: Mapping[str, Sequence[str]], by_scenario: bool = False) -> dict[Key, Cell]:
    """Episodes of the members of every scenario, seed by seed or scenario by scenario."""
    pairs = [(scenario, seed) for seed in seeds for scenario in members]
    if by_scenario:
        pairs.sort(key=lambda pair: list(members).index(pair[0]))
    return {
        (scenario, member, seed): {"scenario": scenario, "member": member, "seed": seed}
        for scenario, seed in pairs
        for member in members[scenario]
    }


def scenarios_with_obstacles() -> tuple[str, ...]:
    """Names of the scenarios in which something may be in the way."""
    from fixation_gym.envs.config import SCENARIOS

    return tuple(name for name, item in SCENARIOS.items() if item.obstacle_count[1] + item.moving_count[1] > 0)


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
)


_sims: list[PickSim] = []  # at most one: it is large


def run_cell(cell: Cell) -> dict[str, Any]:
    """Run the episode of a cell; returns scenario, member, seed and how it ended."""
    if "policy" in cell:
        close_sims()
        return _run_with_images(cell)
    workers.close_worlds()
    return _run_without_images(cell)


def _run_with_images(cell: Cell) -> dict[str, Any]:
    """Run the episode of a policy of the catalogue in the environment in which ``evaluate`` runs it."""
    from fixation_gym.experiments.necessity.episodes import play_in
    from policies.catalogue import surroundings

    config = EvaluationConfig(policy=cell["policy"], image_size=surroundings(cell["policy"]).image_size)
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
    from policies.blind_ways import BlindWayPolicy
    from policies.oracle import OraclePolicy

    if not _sims:
        _sims.append(PickSim(CONTROL_FREQUENCY))
    world = World(_sims[0], _scene(cell["scenario"], cell["seed"]))
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


@atexit.register
def close_sims() -> None:
    """Drop the simulation that ``run_cell`` keeps in this process."""
    _sims.clear()


def measure(config: NecessityConfig, out: Path, run: Callable[[Cell], dict[str, Any]] = run_cell) -> dict[str, Any]:
    """Run the episodes that a folder does not have yet, and write summary, CSVs and figure.

    Args:
        config: must have passed ``check``.
        out: folder; made if needed.
        run: runs one cell; tests replace it.

    Returns:
        The summary, as in ``summary.json``.

    Raises:
        UsageError: if the folder cannot be used.
    """
    from fixation_gym.experiments.necessity.figure import draw_figure

    ways = tuple(config.ways)
    evaluated = config.evaluated()
    with EXPERIMENT.opened(out, {"seed": config.seed}, run, config.workers) as folder:
        choosing = folder.results(config.choosing().values())
        judging = folder.results(config.judging(chosen_ways(choosing, ways)).values())
        close_sims()
        workers.close_worlds()
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
