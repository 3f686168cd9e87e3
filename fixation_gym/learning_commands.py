"""The commands ``train``, ``compare`` and ``transfer``; see ``cli``."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from fixation_gym.experiments.transfer.config import TransferConfig
from fixation_gym.gl import select_backend
from fixation_gym.names import Names
from fixation_policies.rl.config import BEST_FILE, FINAL_FILE, TrainConfig, require_learning_packages


@dataclass(frozen=True)
class Train(TrainConfig):
    """Train an agent on FixationPickZFC-v0 with Stable-Baselines3; a run that was killed goes on with --resume."""

    resume: bool = False
    """Go on with the run in the folder."""
    out: Path = Path("out/train")
    """Folder of the results."""

    def run(self) -> int:
        """Train and print where the agents are."""
        self.check()
        select_backend()
        from fixation_gym.evaluation.storage import SUMMARY_FILE
        from fixation_policies.rl.train import train

        summary = train(self, self.out, self.resume)
        rates = summary["final"]
        print(
            f"\nafter {summary['decisions']} decisions, {summary['env_steps']} control steps, "
            f"{summary['wall_s'] / 60:.1f} min: success {rates['success']:.2f}, "
            f"without collision {rates['collision_free']:.2f}"
        )
        print("\n".join(str(self.out / name) for name in (SUMMARY_FILE, BEST_FILE, FINAL_FILE)))
        return 0


@dataclass(frozen=True)
class Compare:
    """Train and test configurations over seeds: learning curves, final table. The same command again resumes."""

    config: Names = ("zfc", "blind", "rgb", "residual")
    """Configurations, separated by commas; the others are compared with the first, seed by seed."""
    seeds: int = 5
    """Training seeds of every configuration, from 0 on."""
    steps: int = 6_000
    """Decisions of every training run; the first 1000 are random."""
    scenario: str = "mixed"
    """Scenario to train on."""
    test: Names = ()
    """Scenarios to test on, separated by commas; if none, the one that is trained on. The servo is tested, too."""
    episodes: int = 50
    """Episodes per test scenario and agent; the same for all."""
    quick: bool = False
    """Two seeds of zfc and blind, 600 decisions each, 8 episodes, whatever --config, --seeds, --steps and --episodes
    say: minutes, to see that everything works."""
    env_workers: int = 4
    """Processes that step the environments of one training run."""
    workers: int = 1
    """Training runs at the same time."""
    backend: str = "loky"
    """Where they run: loky (this machine) or ray (a Ray cluster whose machines all see the folder)."""
    out: Path = Path("out/compare")
    """Folder of the results."""

    def run(self) -> int:
        """Compare and print the table."""
        require_learning_packages()
        from fixation_policies.rl.compare import QUICK, CompareConfig, compare
        from fixation_policies.rl.comparison_tables import (
            CURVES_FILE,
            DIFFERENCES_FILE,
            FIGURE_FILE,
            TABLE_FILE,
            format_differences,
            format_table,
        )

        training = QUICK if self.quick else TrainConfig(steps=self.steps)
        config = CompareConfig(
            configs=("zfc", "blind") if self.quick else self.config,
            seeds=2 if self.quick else self.seeds,
            training=replace(training, scenario=self.scenario, workers=self.env_workers),
            scenarios=self.test or (self.scenario,),
            episodes=8 if self.quick else self.episodes,
            workers=self.workers,
            backend=self.backend,
        )
        config.check()
        select_backend()
        from fixation_gym.evaluation.storage import SUMMARY_FILE

        summary = compare(config, self.out)
        print(f"{format_table(summary['table'])}\n\n{format_differences(summary['differences'])}\n")
        for name in (SUMMARY_FILE, TABLE_FILE, DIFFERENCES_FILE, CURVES_FILE, FIGURE_FILE):
            print(self.out / name)
        return 0


@dataclass(frozen=True)
class Transfer(TransferConfig):
    """Train agents where things are plain, test them where they look otherwise. The same command again resumes."""

    out: Path = Path("out/transfer")
    """Folder of the results."""

    def run(self) -> int:
        """Train, test and print the table."""
        self.check()
        select_backend()
        from fixation_gym.experiments.transfer.run import EXPERIMENT, measure

        return EXPERIMENT.show(measure(self, self.out), self.out)
