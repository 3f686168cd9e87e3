"""What ``distance`` measures, as a value. Imports nothing heavy, so that the command line answers at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, get_args

import tyro

from fixation_gym.evaluation.config import SEED_BLOCK
from fixation_gym.experiments.distance.sequence import INTRINSICS, Motion
from fixation_gym.experiments.rig_config import RigConfig

if TYPE_CHECKING:
    from fixation_gym.experiments.runner import Cell

DISTANCES = (0.066, 0.097, 0.15, 0.21, 0.31, 0.45, 0.66, 0.97, 1.4, 2.0, 3.1, 4.5, 6.6)
"""m, evenly spaced in the logarithm but for the paper's 0.15 and 2."""
QUICK_DISTANCES = (0.066, 0.15, 0.31, 0.66, 2.0, 6.6)
AMPLITUDES = (0.02, 0.05)
"""Radii of the circle, m."""
LARGE_AMPLITUDE_FROM = 0.15
"""Nearest distance for the larger circle, m."""


@dataclass(frozen=True)
class DistanceConfig(RigConfig):
    """What to measure, and with how many processes."""

    COUNT_OPTION = "--seeds"
    COUNTS = (20, 2)

    quick: bool = False
    """Six distances and two seeds instead of thirteen and twenty, and one amplitude per distance, the largest."""
    count: Annotated[int | None, tyro.conf.arg(name="seeds")] = None
    """Sequences per distance, amplitude and motion; 20 by default, 2 with --quick."""
    seed: int = 0
    """Chooses the block of seeds: sequence i has seed 100000 * SEED + i."""
    noise: str = "conservative"

    def cells(self) -> list[Cell]:
        """All sequences. A seed's conditions come before those of the next, so that part of a run shows the whole."""
        cells = []
        for index in range(self.repetitions):
            for distance in QUICK_DISTANCES if self.quick else DISTANCES:
                amplitudes = [a for a in AMPLITUDES if a == AMPLITUDES[0] or distance >= LARGE_AMPLITUDE_FROM]
                for amplitude in amplitudes[-1:] if self.quick else amplitudes:
                    for motion in get_args(Motion):
                        cells.append(self._cell(distance, amplitude, motion, index))
        return cells

    def _cell(self, distance: float, amplitude: float, motion: Motion, index: int) -> Cell:
        from fixation_gym.experiments.distance.duck_print import valid_widths

        # Without rotation the print wanders through the image by the amplitude.
        widths = valid_widths(distance, INTRINSICS, amplitude if motion == "translation" else 0.0)
        return {
            "distance_m": distance,
            "amplitude_m": amplitude,
            "motion": motion,
            "print_width_m": widths[index % len(widths)],
            "seed": self.seed * SEED_BLOCK + index,
            "noise": self.noise,
        }
