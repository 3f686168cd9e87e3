"""What ``necessity`` tries, as a value. Imports nothing heavy, so that the command line answers at once."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from fixation_gym.errors import UsageError, check_names
from fixation_gym.evaluation.config import SEED_BLOCK, EvaluationConfig, check_scenarios, check_seed, episode_seeds
from fixation_gym.experiments.necessity.statistics import AGENT
from fixation_gym.names import Names

if TYPE_CHECKING:
    from fixation_gym.evaluation.rollout import EpisodeKey
    from fixation_gym.experiments.runner import Cell
    from fixation_policies.blind_ways import BlindWay

ORACLE = "oracle"
QUICK_SCENARIOS = ("opaque", "screen", "clutter")

Key = tuple[str, str, int]
"""(scenario, member, seed)"""


@dataclass(frozen=True)
class NecessityConfig:
    """What to try, and with how many processes."""

    scenarios: Annotated[Names, tyro.conf.arg(name="scenario")] = ()
    """Scenario names, separated by commas; by default all with obstacles that need no extra, with --quick three."""
    quick: bool = False
    """A few ways and four episodes: minutes, to see that everything works."""
    episodes: int | None = None
    """Episodes per scenario, an even number, half to choose the best way and half to judge it; 40 by default, 4 with
    --quick."""
    seed: int = 0
    """Chooses the block of episode seeds, as for evaluate."""
    beside: Names = ("blind", "blind:slow")
    """Policies that see the target with the wrist camera, to put beside the ways; "" for none."""
    agent: Path | None = None
    """An agent's zip, such as a trained blind one, to put beside the ways."""
    evaluation: Path | None = None
    """A folder that evaluate wrote with the same --seed, such as the servo's, to be paired with the best ways."""
    workers: int = 1
    """Number of processes."""

    def check(self) -> None:
        """Check everything that can be checked without the simulator.

        Raises:
            UsageError: naming the first bad value and what is allowed.
        """
        from fixation_gym.evaluation.workers import check_backend
        from fixation_policies.catalogue import AGENT_SUFFIX, POLICY_NAMES, check_policy

        check_scenarios(self.scenario_names)
        if not 2 <= self.episode_count <= SEED_BLOCK or self.episode_count % 2:
            raise UsageError(f"--episodes must be an even number within 2..{SEED_BLOCK}, got {self.episodes}")
        check_seed(self.seed)
        if self.beside:
            check_names(self.beside, [name for name in POLICY_NAMES if name != ORACLE], "policy")
        if self.agent is not None:
            if self.agent.suffix != AGENT_SUFFIX:
                raise UsageError(f"--agent must be an agent's {AGENT_SUFFIX}, got {self.agent}")
            check_policy(str(self.agent))
        self.evaluated()
        check_backend("loky", self.workers)

    @property
    def scenario_names(self) -> tuple[str, ...]:
        """Scenarios to try the ways in."""
        from fixation_gym.envs.config import SCENARIOS

        plain = tuple(name for name in scenarios_with_obstacles() if SCENARIOS[name].plain)
        return self.scenarios or (QUICK_SCENARIOS if self.quick else plain)

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
        members = {name: name for name in self.beside}
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
        if read.run["sensor_noise"] != EvaluationConfig.sensor_noise:
            raise UsageError(f"--evaluation must be of nominal sensor noise, but {self.evaluation} is not")
        return {result.key: result.collision_free_success for result in read.results}

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

    return tuple(name for name, item in SCENARIOS.items() if item.has_obstacles)
