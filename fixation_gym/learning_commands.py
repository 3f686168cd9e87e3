"""The commands ``train`` and ``compare``; see ``cli``."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from fixation_gym.gl import select_backend
from fixation_gym.report_commands import split_names


@dataclass(frozen=True)
class Train:
    """Train an agent on FixationPickZFC-v0 with Stable-Baselines3; a run that was killed goes on with --resume."""

    config: str = "zfc"
    """What the learner sees: zfc (zero-flow map), blind (no map), rgb (image), privileged (true map), or residual: the
    map, to add to the servo's lateral velocity."""
    algorithm: str = "sac"
    """sac or ppo."""
    scenario: str = "mixed"
    """Name of the scenario to train on."""
    steps: int = 8_000
    """Decisions to learn from; 5 per simulated second, and a whole grasp counts as one. SAC begins with 1000 random
    ones."""
    seed: int = 0
    """Chooses scenes and initial weights."""
    workers: int = 4
    """Number of processes that step environments; more than cores is good, since grasps take long."""
    sensor_noise: str = "nominal"
    """ideal, nominal or conservative."""
    eval_every: int = 2_000
    """Decisions between evaluations."""
    eval_episodes: int = 32
    """Episodes of each evaluation."""
    checkpoint_minutes: float = 5.0
    """Minutes between checkpoints."""
    resume: bool = False
    """Go on with the run in the folder."""
    out: Path = Path("out/train")
    """Folder of the results."""

    def run(self) -> int:
        """Train and print where the agents are."""
        from policies.rl.config import TrainConfig

        config = TrainConfig(
            config=self.config,
            algorithm=self.algorithm,
            scenario=self.scenario,
            steps=self.steps,
            seed=self.seed,
            workers=self.workers,
            sensor_noise=self.sensor_noise,
            eval_every=self.eval_every,
            eval_episodes=self.eval_episodes,
            checkpoint_minutes=self.checkpoint_minutes,
        )
        config.check()
        select_backend()
        from fixation_gym.evaluation.storage import SUMMARY_FILE
        from policies.rl.train import BEST_FILE, FINAL_FILE, train

        summary = train(config, self.out, self.resume)
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

    config: str = "zfc,blind,rgb,residual"
    """Configurations, separated by commas; the others are compared with the first, seed by seed."""
    seeds: int = 5
    """Training seeds of every configuration, from 0 on."""
    steps: int = 6_000
    """Decisions of every training run; the first 1000 are random."""
    scenario: str = "mixed"
    """Scenario to train on."""
    test: str = ""
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
        from policies.rl.config import TrainConfig, require_learning_packages

        require_learning_packages()
        from policies.rl.compare import QUICK, CompareConfig, compare
        from policies.rl.comparison_tables import (
            CURVES_FILE,
            DIFFERENCES_FILE,
            FIGURE_FILE,
            TABLE_FILE,
            format_differences,
            format_table,
        )

        training = QUICK if self.quick else TrainConfig(steps=self.steps)
        config = CompareConfig(
            configs=("zfc", "blind") if self.quick else split_names(self.config),
            seeds=2 if self.quick else self.seeds,
            training=replace(training, scenario=self.scenario, workers=self.env_workers),
            scenarios=split_names(self.test or self.scenario),
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
