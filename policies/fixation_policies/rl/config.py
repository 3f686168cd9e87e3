"""What is trained and how: all numbers of a training run. Imports neither torch nor the simulator."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass, fields
from typing import Any

from tyro.conf import Fixed

from fixation_gym.errors import UsageError, check_names

Convolution = tuple[int, int, int]
"""(channels, size of the kernel, stride)"""
VIEW_FEATURES, HIDDEN = 64, 256
"""Sizes of a network's layers: what the view comes to, and each of the two between features and action."""
UNKNOWN = 128.0 / 255.0
"""Of a map, among pixels within 0..1; networks see twice the difference from it."""


@dataclass(frozen=True)
class Configuration:
    """What a learner sees, and with what network it looks."""

    observation: str
    """Of ``FixationPickZFC-v0``."""
    residual: bool = False
    """Whether it adds to the servo's lateral velocity, in ``FixationPick-v0``."""
    image_cells: int = 48
    """Images are shrunk to this height and width, px."""
    image_frames: int = 0
    """How many images it sees, a decision apart from each other; 0: the newest and a running mean."""
    convolutions: tuple[Convolution, ...] = ((16, 4, 4),)
    """A gradient step is most of what learning costs on a CPU, and a second convolution doubles the time of it."""
    augmented: bool = False
    """Whether images are shifted and change colour at random in every gradient step."""


CONFIGS: dict[str, Configuration] = {
    "zfc": Configuration("zfc"),
    "ways": Configuration("ways"),
    "blind": Configuration("blind"),
    "rgb": Configuration("rgb"),
    "depth": Configuration("depth"),
    "privileged": Configuration("privileged"),
    "residual": Configuration("zfc", residual=True),
    "rgb_augmented": Configuration(
        "rgb", image_cells=64, image_frames=3, convolutions=((16, 4, 4), (32, 3, 2), (32, 3, 1)), augmented=True
    ),
}
"""Configurations by name."""
BEST_FILE, FINAL_FILE = "best.zip", "final.zip"
"""What a training run leaves in its folder: the agent that did best in validation, and the last one."""
ALGORITHMS = ("sac", "ppo")

TRAIN_SEEDS = 2_000_000_000
"""Where the seeds of training begin; those of ``evaluate`` are far below."""
VALIDATION_SEEDS = 1_900_000_000
"""Where the seeds of the evaluations during training begin."""


@dataclass(frozen=True)
class TrainConfig:
    """One training run. A step is a decision of the learner. Fields that are ``Fixed`` are no options of ``train``."""

    config: str = "zfc"
    """What the learner sees: zfc (zero-flow map), ways (what is remembered of all ways to the target), blind (no map),
    rgb (image), rgb_augmented (larger images, in other places and colours at random), depth (a stereo depth camera),
    privileged (true map), or residual: the map, to add to the servo's lateral velocity."""
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
    """ideal, nominal, conservative or realistic."""
    image_size: Fixed[tuple[int, int]] = (96, 128)
    """Height and width of the wrist image, px; the map's cells lie as those of 240x320."""
    eval_every: int = 2_000
    """Decisions between evaluations."""
    eval_episodes: int = 32
    """Episodes of each evaluation, always the same ones."""
    checkpoint_minutes: float = 5.0
    """Minutes between checkpoints; another follows every evaluation."""
    learning_starts: Fixed[int] = 1_000
    """SAC: random decisions before learning begins."""
    gradient_steps: Fixed[int] = 1
    """SAC: per decision."""
    buffer_size: Fixed[int] = 50_000
    """SAC: decisions kept."""

    @property
    def learner(self) -> Configuration:
        """What the learner sees, and with what network."""
        return CONFIGS[self.config]

    def check(self) -> None:
        """Check everything that can be checked without building an environment.

        Raises:
            UsageError: naming the first bad value and what is allowed.
        """
        from fixation_gym.envs.config import SCENARIO_NAMES
        from fixation_gym.envs.sensor_noise import SENSOR_NOISE

        check_names([self.config], CONFIGS, "configuration")
        check_names([self.algorithm], ALGORITHMS, "algorithm")
        check_names([self.scenario], SCENARIO_NAMES, "scenario")
        check_names([self.sensor_noise], SENSOR_NOISE, "sensor noise")
        for name in ("steps", "workers", "eval_every", "eval_episodes", "gradient_steps", "buffer_size"):
            if getattr(self, name) < 1:
                raise UsageError(f"--{name.replace('_', '-')} must be at least 1, got {getattr(self, name)}")
        if not 0 <= self.seed < 1000:
            raise UsageError(f"--seed must be within 0..999, got {self.seed}")
        random_steps = self.learning_starts + self.workers  # learning lags behind by one step of all environments
        if self.algorithm == "sac" and self.steps <= random_steps:
            raise UsageError(
                f"--steps must be above {random_steps}, since SAC learns after so many random ones, got {self.steps}"
            )
        if not self.checkpoint_minutes > 0.0:
            raise UsageError(f"--checkpoint-minutes must be above 0, got {self.checkpoint_minutes}")
        require_learning_packages()

    def identity(self) -> dict[str, Any]:
        """What may not change between a run and its continuation, JSON-able.

        The number of workers may not, since a replay buffer has a column for each.
        """
        may_change = ("steps", "eval_every", "checkpoint_minutes")
        names = [field.name for field in fields(TrainConfig) if field.name not in may_change]
        values = {name: getattr(self, name) for name in names}
        return {**values, "image_size": list(self.image_size)}


def require_learning_packages() -> None:
    """Check that the packages of the extra "rl" are there.

    Raises:
        UsageError: naming what is missing.
    """
    for package in ("torch", "stable_baselines3", "tensorboard"):
        if importlib.util.find_spec(package) is None:
            raise UsageError(
                f"training needs the package {package}, which is not installed: pip install 'fixation-gym[rl]'"
            )
