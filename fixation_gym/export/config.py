"""What ``export`` records, as a value. Imports nothing heavy, so that the command line answers at once."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.config import EvaluationConfig, episode_seeds

if TYPE_CHECKING:
    from fixation_gym.evaluation.rollout import EpisodeKey

FORMATS = ("lerobot",)


@dataclass(frozen=True)
class ExportConfig(EvaluationConfig):
    """Which episodes to record, and for whom."""

    format: str = "lerobot"
    """lerobot: a data set of LeRobot, version 3.0."""

    def check(self) -> None:
        """Check everything that can be checked without building an environment.

        Raises:
            UsageError: naming the first bad value and what is allowed, or the extra that is missing.
        """
        super().check()
        if self.format not in FORMATS:
            raise UsageError(f"unknown format '{self.format}'; choose one of {', '.join(FORMATS)}")
        if any(importlib.util.find_spec(name) is None for name in ("pyarrow", "pandas")):
            raise UsageError("export needs pyarrow and pandas: pip install 'fixation-gym[export]'")

    def run_description(self) -> dict[str, Any]:
        """Everything the result of one episode depends on; the scenarios, too, for they number the episodes."""
        return {**super().run_description(), "format": self.format, "scenarios": list(self.scenarios)}

    def episode_keys(self) -> list[EpisodeKey]:
        """(scenario, seed) of every episode in the order of their numbers: more episodes come after those before."""
        return [(scenario, seed) for seed in episode_seeds(self.seed, self.episodes) for scenario in self.scenarios]
