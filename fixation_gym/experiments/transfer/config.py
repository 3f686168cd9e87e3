"""What ``transfer`` trains and tests, as a value. Imports nothing heavy, so that the command line answers at once."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from fixation_gym.errors import UsageError, check_names
from fixation_gym.evaluation.config import SEED_BLOCK, check_scenarios, check_seed, episode_seeds
from fixation_gym.experiments.transfer.shifts import AXES, NONE, SEVERITIES, Shift, shift
from fixation_gym.names import Names
from fixation_policies.rl.config import CONFIGS, FINAL_FILE, TrainConfig

if TYPE_CHECKING:
    from fixation_gym.experiments.runner import Cell
    from fixation_policies.rl.compare import CompareConfig

_QUICK = TrainConfig(steps=300, eval_every=300, eval_episodes=4, learning_starts=100, buffer_size=1000)
_DIGEST = 12
"""Letters of a digest that are kept."""


@dataclass(frozen=True)
class Candidate:
    """Who is tested."""

    name: str
    """Of the policy, or of the agent's configuration."""
    training_seed: int
    """0 of policies that are not trained."""
    policy: str
    """A policy's name or an agent's file."""
    digest: str = ""
    """Beginning of the SHA-256 of that file, or of the one that holds somebody else's class: changed, it is another."""
    trained: bool = False
    """Whether it is an agent."""


@dataclass(frozen=True)
class TransferConfig:
    """Whom to train on which scenario, and on which shifts to test them."""

    configs: Annotated[Names, tyro.conf.arg(name="config")] = ("zfc", "rgb_augmented", "blind")
    """Configurations to train, separated by commas; the others are compared with the first, seed by seed. "" for
    none."""
    seeds: int = 5
    """Training seeds of every configuration, from 0 on."""
    steps: int = 6_000
    """Decisions of every training run; the first 1000 are random."""
    scenario: str = "opaque"
    """Scenario to train on, which the shifts change."""
    agents: Annotated[Names, tyro.conf.arg(name="agent")] = ()
    """Files of more agents that were trained on that scenario, separated by commas."""
    policies: Annotated[Names, tyro.conf.arg(name="policy")] = ("servo", "oracle")
    """Policies beside the learners, separated by commas; "" for none."""
    axes: Annotated[Names, tyro.conf.arg(name="axis")] = ()
    """Axes to test on, separated by commas; all by default. No shift is always tested."""
    severities: Annotated[Names, tyro.conf.arg(name="severity")] = SEVERITIES
    """Severities of each: mild, middle, strong."""
    episodes: int = 20
    """Episodes per agent and shift; the same seeds for all."""
    seed: int = 6
    """Chooses the block of episode seeds, as for evaluate."""
    runs: Path | None = None
    """Folder of a finished comparison on the same scenario: its runs are not trained again. By default agents are
    trained in the folder of the results."""
    quick: bool = False
    """One seed of zfc, 300 decisions, two axes, one episode each, whatever the other options say: minutes, to see that
    everything works."""
    env_workers: int = 4
    """Processes that step the environments of one training run."""
    workers: int = 1
    """Episodes of the tests, and training runs, at the same time."""

    def check(self) -> None:
        """Check everything that can be checked without building an environment.

        Raises:
            UsageError: naming the first bad value and what is allowed.
        """
        from fixation_gym.evaluation.workers import check_backend

        if self.configs:
            self.comparison().check()
        if self.runs is not None:
            self._check_runs(self.runs)
        self._check_tested()
        self._check_shifts()
        if not 1 <= self.episodes <= SEED_BLOCK:
            raise UsageError(f"--episodes must be within 1..{SEED_BLOCK}, got {self.episodes}")
        check_seed(self.seed)
        check_backend("loky", self.workers)

    def _check_tested(self) -> None:
        from fixation_policies.catalogue import AGENT_SUFFIX, check_policy

        if not (self.configs or self.agents or self.policies):
            raise UsageError("there is nobody to test: name a --config, an --agent or a --policy")
        for policy in self.policies:
            check_policy(policy)
            if policy in CONFIGS or policy.endswith(AGENT_SUFFIX):
                raise UsageError(f"--policy takes what is not trained, got '{policy}'; see --config and --agent")
        for path in self.agents:
            self._check_agent(Path(path))
        names = [f"{tested.name} {tested.training_seed}" for tested in self.given()]
        names += [f"{config} {seed}" for config in self.configs for seed in range(self.seeds)]
        if len(set(names)) < len(names):
            raise UsageError(f"nobody may be tested twice, got {', '.join(names)}")

    def _check_runs(self, runs: Path) -> None:
        if not self.configs:
            raise UsageError(f"--runs goes with agents to train, got {runs} without a --config")
        folders = [Path(cell["folder"]) for cell in self.smaller().training_cells(runs).values()]
        missing = [folder.name for folder in folders if not (folder / FINAL_FILE).is_file()]
        if missing:
            names = ", ".join(missing)
            raise UsageError(f"--runs needs the {FINAL_FILE} of every agent, but {folders[0].parent} lacks {names}")

    def _check_shifts(self) -> None:
        from fixation_gym.envs.config import resolve_scenario

        if self.axes:
            check_names(self.axes, AXES, "axis")
        check_names(self.severities, SEVERITIES, "severity")
        check_scenarios([self.scenario])
        for chosen in self.shifts():
            try:
                resolve_scenario(chosen.arguments(self.scenario)["scenario"])
            except ValueError as error:
                raise UsageError(
                    f"--axis {chosen.axis} does not go with --scenario {self.scenario}: {error}"
                ) from error

    def _check_agent(self, path: Path) -> None:
        from fixation_policies.rl.agent_file import read_agent

        card, _ = read_agent(path)
        if card.scenario != self.scenario:
            raise UsageError(f"{path} was trained on {card.scenario}; --agent takes those trained on {self.scenario}")

    def smaller(self) -> TransferConfig:
        """What ``quick`` asks for; otherwise itself."""
        if not self.quick:
            return self
        axes, policies = ("object_textures", "light_colour"), ("servo",)
        return replace(
            self, configs=("zfc",), seeds=1, agents=(), policies=policies, axes=axes, severities=("middle",), episodes=1
        )

    def comparison(self) -> CompareConfig:
        """The training, as ``compare`` does it."""
        from fixation_policies.rl.compare import CompareConfig

        training = replace(
            _QUICK if self.quick else TrainConfig(steps=self.steps), scenario=self.scenario, workers=self.env_workers
        )
        return CompareConfig(self.configs, self.seeds, training, (self.scenario,), workers=self.workers)

    def training_cells(self, folder: Path) -> dict[tuple[str, int], Cell]:
        """The runs of that training by configuration and seed, each with its folder in ``folder``."""
        from fixation_policies.rl.compare import SERVO

        return {key: cell for key, cell in self.comparison().cells(folder).items() if key[0] != SERVO}

    def given(self) -> list[Candidate]:
        """Agents from files, and policies that are not trained."""
        from fixation_policies.catalogue import source_hashes
        from fixation_policies.rl.agent_file import read_card

        cards = [(path, read_card(Path(path))) for path in self.agents]
        agents = [candidate_agent(card.config, card.seed, path) for path, card in cards]
        digests = {name: source_hashes(name, None).get("policy_sha256", "")[:_DIGEST] for name in self.policies}
        return [*agents, *(Candidate(name, 0, name, digest) for name, digest in digests.items())]

    def shifts(self) -> list[Shift]:
        """No shift, then all axes at one severity, then at the next: part of a run shows all axes."""
        axes = self.axes or tuple(AXES)
        # The middle one comes first: most is compared there.
        order = sorted(dict.fromkeys(self.severities), key=lambda name: (name != "middle", SEVERITIES.index(name)))
        return [Shift(NONE, NONE), *(shift(axis, severity) for severity in order for axis in dict.fromkeys(axes))]

    def cells(self, tested: list[Candidate]) -> Iterator[Cell]:
        """Episodes shift by shift; an environment is built for each agent and shift."""
        for chosen in self.shifts():
            for one in tested:
                for seed in episode_seeds(self.seed, self.episodes):
                    yield {
                        "name": one.name,
                        "training_seed": one.training_seed,
                        "policy": one.policy,
                        "digest": one.digest,
                        "axis": chosen.axis,
                        "severity": chosen.severity,
                        "scenario": self.scenario,
                        "seed": seed,
                    }


def candidate_agent(config: str, training_seed: int, path: str) -> Candidate:
    """The agent in a file."""
    digest = hashlib.sha256(Path(path).read_bytes()).hexdigest()[:_DIGEST]
    return Candidate(config, training_seed, path, digest, trained=True)
