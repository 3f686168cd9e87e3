"""The commands ``train`` and ``compare``; see ``cli``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fixation_gym.gl import select_backend


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
    steps: int = 150_000
    """Decisions to learn from; 5 per simulated second, and a whole grasp counts as one."""
    seed: int = 0
    """Chooses scenes and initial weights."""
    workers: int = 4
    """Number of processes that step environments; more than cores is good, since grasps take long."""
    sensor_noise: str = "nominal"
    """ideal, nominal or conservative."""
    eval_every: int = 10_000
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
