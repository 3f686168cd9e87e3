"""An environment and a policy without a simulator, whose every measurement is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

STEP_S = 0.04


@dataclass(frozen=True)
class FakeEstimate:
    distance_m: float
    distance_std_m: float
    phase: str


class FakeEnv(gymnasium.Env):
    """Ends after ``length`` steps; step k is at 1 - 0.1 k m. Even seeds succeed, seeds divisible by 4 also collide."""

    def __init__(self, length: int = 5, size: tuple[int, int] = (31, 45)) -> None:
        self.length, self.size = length, size
        self.closed = False

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None):
        self.seed, self.count = seed or 0, 0
        return self._obs(), self._info()

    def step(self, action: np.ndarray):
        self.count += 1
        done = self.count == self.length
        return self._obs(), 1.0, done and self._success(), done and not self._success(), self._info()

    def render(self):
        return np.full((*self.size, 3), min(40 * self.count, 255), np.uint8)

    def close(self) -> None:
        self.closed = True

    def _success(self) -> bool:
        return self.seed % 2 == 0

    def _obs(self) -> dict[str, np.ndarray]:
        return {"time": np.array([STEP_S * self.count], np.float32)}

    def _info(self) -> dict[str, Any]:
        success = self.count == self.length and self._success()
        return {
            "is_success": success,
            "success": success,
            "collision": self.count >= 2 and self.seed % 4 == 0,
            "clearance_m": 0.5 - 0.1 * self.count,
            "distance_true_m": 1.0 - 0.1 * self.count,
            "fixation_error_px": 3.0 if self.count % 2 else 4.0,
            "reward_progress": 0.75,
            "reward_time": 0.0,
            "reward_success": 0.25,
            "reward_collision": 0.0,
        }


class FakePolicy:
    """Goes through given phases and estimates a constant distance."""

    def __init__(self, phases: tuple[str, ...] = ("search", "approach", "approach", "grasp", "lift")) -> None:
        self.phases = phases

    def reset(self, seed: int | None) -> None:
        self.count = 0
        self.estimate: FakeEstimate | None = None

    def act(self, obs: dict[str, np.ndarray]) -> np.ndarray:
        phase = self.phases[min(self.count, len(self.phases) - 1)]
        self.estimate = FakeEstimate(0.85, 0.01, phase)
        self.count += 1
        return np.zeros(7, np.float32)


class SilentPolicy(FakePolicy):
    """Has no estimate."""

    def act(self, obs: dict[str, np.ndarray]) -> np.ndarray:
        return np.zeros(7, np.float32)


def run_fake_cell(cell: dict[str, Any]) -> dict[str, Any]:
    """Stands in for ``workers.run_cell``; picklable."""
    from fixation_gym.evaluation.rollout import run_episode

    result = run_episode(FakeEnv(), FakePolicy(), cell["seed"], scenario=cell["scenario"], policy_name=cell["policy"])
    return {**result.to_json(), "trace": result.trace}
