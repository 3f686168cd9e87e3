"""What ``export`` records, as a value. Imports nothing heavy, so that the command line answers at once."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.config import EvaluationConfig, episode_seeds

if TYPE_CHECKING:
    from fixation_gym.evaluation.rollout import EpisodeKey

FORMATS = {"lerobot": ("pyarrow", "pandas"), "minari": ("pyarrow", "minari")}
"""Data sets that can be written, and the packages that each needs."""


@dataclass(frozen=True)
class ExportConfig(EvaluationConfig):
    """Which episodes to record, and for whom."""

    format: str = "lerobot"
    """lerobot: a data set of LeRobot, version 3.0; minari: one of Minari. A folder may hold both, recorded once."""

    def check(self) -> None:
        """Check everything that can be checked without building an environment.

        Raises:
            UsageError: naming the first bad value and what is allowed, or the extra that is missing.
        """
        super().check()
        if self.format not in FORMATS:
            raise UsageError(f"unknown format '{self.format}'; choose one of {', '.join(FORMATS)}")
        packages = FORMATS[self.format]
        if any(importlib.util.find_spec(name) is None for name in packages):
            needs = " and ".join(packages)
            raise UsageError(f"--format {self.format} needs {needs}: pip install 'fixation-gym[export]'")

    def run_description(self) -> dict[str, Any]:
        """Everything a recording depends on, so not the format; the scenarios, too, for they number the episodes."""
        return {**super().run_description(), "scenarios": list(self.scenarios)}

    def episode_keys(self) -> list[EpisodeKey]:
        """(scenario, seed) of every episode in the order of their numbers: more episodes come after those before."""
        return [(scenario, seed) for seed in episode_seeds(self.seed, self.episodes) for scenario in self.scenarios]
