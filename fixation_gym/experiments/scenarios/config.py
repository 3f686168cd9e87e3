"""What ``scenarios`` looks at, as a value. Imports nothing heavy, so that the command line answers at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from fixation_gym.evaluation.config import SEED_BLOCK

if TYPE_CHECKING:
    from fixation_gym.experiments.runner import Cell

Key = tuple[str, str, int]
"""(scene, variant, seed)"""


@dataclass(frozen=True)
class ScenariosConfig:
    """What to look at, and with how many processes."""

    quick: bool = False
    """Three instances of every scene and variant instead of twenty."""
    instances: int | None = None
    """Random instances of every scene and variant, and of the clear scene; 20 by default, 3 with --quick."""
    seed: int = 0
    """Chooses the block of seeds: instance i has seed 100000 * SEED + i."""
    noise: str = "nominal"
    """Sensor noise: ideal, nominal or conservative."""
    workers: int = 1
    """Number of processes."""
    film: bool = True
    """Make figure and videos."""

    def check(self) -> None:
        """Check everything that can be checked without the simulator.

        Raises:
            UsageError: naming the first bad value and what is allowed.
        """
        from fixation_gym.experiments.runner import check_options

        check_options(self.noise, self.seed, self.instance_count, "--instances", self.workers)

    @property
    def instance_count(self) -> int:
        """Random instances of every scene and variant."""
        return self.instances if self.instances is not None else 3 if self.quick else 20

    def cells(self) -> dict[Key, Cell]:
        """All runs. A seed's scenes come before those of the next, so that part of a run shows the whole."""
        from fixation_gym.experiments.scenarios.scenes import CLEAR, SCENES, VARIANTS

        cells = {}
        for index in range(self.instance_count):
            seed = self.seed * SEED_BLOCK + index
            keys = [(scene, variant, seed) for scene in SCENES for variant in VARIANTS]
            keys.append((CLEAR, VARIANTS[index % 2], seed))  # lateral and approaching in turn
            for scene, variant, seed in keys:
                cells[scene, variant, seed] = {"scene": scene, "variant": variant, "seed": seed, "noise": self.noise}
        return cells
