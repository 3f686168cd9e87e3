"""What every experiment with a rig is asked for. Imports nothing heavy, so that the command line answers at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from fixation_gym.errors import UsageError, check_names
from fixation_gym.evaluation.config import SEED_BLOCK, check_seed


@dataclass(frozen=True)
class RigConfig:
    """How often every condition is measured, with which seeds and noise, and with how many processes."""

    COUNT_OPTION: ClassVar[str]
    COUNTS: ClassVar[tuple[int, int]]
    """By default, and with ``quick``."""

    quick: bool = False
    count: int | None = None
    """How often every condition is measured."""
    seed: int = 0
    noise: str = "nominal"
    """Sensor noise: ideal, nominal or conservative."""
    workers: int = 1
    """Number of processes."""

    def check(self) -> None:
        """Check everything that can be checked without the simulator.

        Raises:
            UsageError: naming the first bad value and what is allowed.
        """
        from fixation_gym.envs.sensor_noise import SENSOR_NOISE
        from fixation_gym.evaluation.workers import check_backend

        rigs = [name for name, noise in SENSOR_NOISE.items() if noise.of_every_rig]
        check_names([self.noise], rigs, "sensor noise")
        check_seed(self.seed)
        if not 1 <= self.repetitions <= SEED_BLOCK:
            raise UsageError(f"{self.COUNT_OPTION} must be within 1..{SEED_BLOCK}, got {self.repetitions}")
        check_backend("loky", self.workers)

    @property
    def repetitions(self) -> int:
        """How often every condition is measured, each time with a seed of its own."""
        return self.COUNTS[self.quick] if self.count is None else self.count
