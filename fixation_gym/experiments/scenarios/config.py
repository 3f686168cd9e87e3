"""What ``scenarios`` looks at, as a value. Imports nothing heavy, so that the command line answers at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import tyro

from fixation_gym.errors import check_names
from fixation_gym.evaluation.config import SEED_BLOCK
from fixation_gym.experiments.rig_config import RigConfig
from fixation_gym.names import Names

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
    variants: Names = ("lateral", "approach", "border", "plain", "moving")
    """Variants of the scenes, separated by commas."""
    renderer: str = "mujoco"
    """Who makes the pictures: mujoco, or mitsuba (extra photoreal; minutes per run), which adds scenes of glass and
    chrome, and leaves the clear one out."""
    film: bool = True
    """Make figure and videos."""

    def check(self) -> None:
        """Check everything that can be checked without the simulator.

        Raises:
            UsageError: naming the first bad value and what is allowed.
        """
        from fixation_gym.envs.photoreal.engine import check_renderer
        from fixation_gym.experiments.scenarios.scenes import VARIANTS

        super().check()
        check_names(self.variants, VARIANTS, "variant")
        check_renderer(self.renderer)

    @property
    def scenes(self) -> tuple[str, ...]:
        """Scenes that are looked at, the clear one apart."""
        from fixation_gym.experiments.scenarios.scenes import MATERIAL_SCENES, SCENES

        return SCENES if self.renderer == "mujoco" else (*SCENES, *MATERIAL_SCENES)

    def cells(self) -> dict[Key, Cell]:
        """All runs. A seed's scenes come before those of the next, so that part of a run shows the whole."""
        from fixation_gym.experiments.scenarios.scenes import CLEAR

        cells = {}
        for index in range(self.repetitions):
            seed = self.seed * SEED_BLOCK + index
            keys = [(scene, variant, seed) for scene in self.scenes for variant in self.variants]
            if self.renderer == "mujoco":
                keys.append((CLEAR, ("lateral", "approach")[index % 2], seed))
            for scene, variant, seed in keys:
                cell = {"scene": scene, "variant": variant, "seed": seed, "noise": self.noise}
                cells[scene, variant, seed] = cell | {"renderer": self.renderer}
        return cells
