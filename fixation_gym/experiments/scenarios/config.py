"""What ``scenarios`` looks at, as a value. Imports nothing heavy, so that the command line answers at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import tyro

from fixation_gym.evaluation.config import SEED_BLOCK
from fixation_gym.experiments.rig_config import RigConfig

if TYPE_CHECKING:
    from fixation_gym.experiments.runner import Cell

Key = tuple[str, str, int]
"""(scene, variant, seed)"""


@dataclass(frozen=True)
class ScenariosConfig(RigConfig):
    """What to look at, and with how many processes."""

    COUNT_OPTION = "--instances"
    COUNTS = (20, 3)

    quick: bool = False
    """Three instances of every scene and variant instead of twenty."""
    count: Annotated[int | None, tyro.conf.arg(name="instances")] = None
    """Random instances of every scene and variant, and of the clear scene; 20 by default, 3 with --quick."""
    seed: int = 0
    """Chooses the block of seeds: instance i has seed 100000 * SEED + i."""
    film: bool = True
    """Make figure and videos."""

    def cells(self) -> dict[Key, Cell]:
        """All runs. A seed's scenes come before those of the next, so that part of a run shows the whole."""
        from fixation_gym.experiments.scenarios.scenes import CLEAR, SCENES, VARIANTS

        cells = {}
        for index in range(self.repetitions):
            seed = self.seed * SEED_BLOCK + index
            keys = [(scene, variant, seed) for scene in SCENES for variant in VARIANTS]
            keys.append((CLEAR, VARIANTS[index % 2], seed))  # lateral and approaching in turn
            for scene, variant, seed in keys:
                cells[scene, variant, seed] = {"scene": scene, "variant": variant, "seed": seed, "noise": self.noise}
        return cells
