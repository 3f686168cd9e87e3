"""Random actions, the floor of every comparison."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fixation_policies.base import Action, Estimate


class RandomPolicy:
    """Uniform random actions, held for a while so that the arm gets somewhere."""

    def __init__(self, hold_steps: int = 10) -> None:
        """Hold every action for ``hold_steps`` steps."""
        self.estimate: Estimate | None = None
        self._hold_steps = hold_steps
        self.reset()

    def reset(self, seed: int | None = None) -> None:
        """Start a new sequence of actions."""
        self._rng = np.random.default_rng(seed)
        self._step = 0
        self._action = np.zeros(7, np.float32)

    def act(self, obs: Mapping[str, Any]) -> Action:
        """Action of shape (7,)."""
        if self._step % self._hold_steps == 0:
            self._action = self._rng.uniform(-1.0, 1.0, 7).astype(np.float32)
        self._step += 1
        return self._action.copy()
