"""What ``robustness`` runs, as a value. Imports nothing heavy, so that the command line answers at once."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated

import tyro

from fixation_gym.errors import UsageError, check_names
from fixation_gym.evaluation.config import SEED_BLOCK, check_scenarios, check_seed, episode_seeds
from fixation_gym.names import Names

if TYPE_CHECKING:
    from fixation_gym.experiments.runner import Cell


@dataclass(frozen=True)
class RobustnessConfig:
    """Which degradations to try on which episodes, and with how many processes."""

    rows: Annotated[Names, tyro.conf.arg(name="row")] = ()
    """Names of degradations, separated by commas; all by default. The nominal noise always runs."""
    scenarios: Annotated[Names, tyro.conf.arg(name="scenario")] = ("opaque", "translucent")
    """Scenario names, separated by commas."""
    episodes: int | None = None
    """Episodes per scenario and degradation; 10 by default, 1 with --quick."""
    quick: bool = False
    """One episode of the first scenario: to see that everything works."""
    seed: int = 0
    """Chooses the block of episode seeds, as for evaluate."""
    workers: int = 1
    """Number of processes."""

    def check(self) -> None:
        """Check everything that can be checked without the simulator.

        Raises:
            UsageError: naming the first bad value and what is allowed.
        """
        from fixation_gym.evaluation.workers import check_backend
        from fixation_gym.experiments.robustness.degradations import DEGRADATIONS

        if self.rows:
            check_names(self.rows, DEGRADATIONS, "degradation")
        check_scenarios(self.scenarios)
        if not 1 <= self.episode_count <= SEED_BLOCK:
            raise UsageError(f"--episodes must be within 1..{SEED_BLOCK}, got {self.episodes}")
        check_seed(self.seed)
        check_backend("loky", self.workers)

    @property
    def episode_count(self) -> int:
        """Episodes per scenario and degradation."""
        return self.episodes if self.episodes is not None else 1 if self.quick else 10

    @property
    def row_names(self) -> tuple[str, ...]:
        """Degradations to try, the nominal noise first."""
        from fixation_gym.experiments.robustness.degradations import CLEAN, DEGRADATIONS

        return tuple(dict.fromkeys((CLEAN, *(self.rows or DEGRADATIONS))))

    def cells(self) -> list[Cell]:
        """Episodes row by row: an environment is built for each row and scenario."""
        from fixation_gym.experiments.robustness.degradations import DEGRADATIONS

        scenarios = self.scenarios[:1] if self.quick else self.scenarios
        return [
            {"row": row, "scenario": scenario, "seed": seed, "noise": asdict(DEGRADATIONS[row])}
            for row in self.row_names
            for scenario in scenarios
            for seed in episode_seeds(self.seed, self.episode_count)
        ]
