"""What is counted while SB3 learns: control steps, recent episodes, and where the time goes."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback
from tqdm import tqdm

from fixation_policies.rl.checkpoints import Progress
from fixation_policies.rl.overlap import BusyEnvs

_RECENT = 100
"""Episodes over which the rates of training are taken."""


class Watch(BaseCallback):
    """Updates a run's progress and its bar, and asks for a checkpoint from time to time."""

    def __init__(
        self, envs: BusyEnvs, progress: Progress, bar: tqdm, save: Callable[[], object], save_every_s: float
    ) -> None:
        """Prepare.

        Args:
            envs: to learn in.
            progress: so far; is updated.
            bar: of decisions.
            save: saves a checkpoint.
            save_every_s: time between checkpoints, s.
        """
        super().__init__()
        self._envs, self._progress, self._bar, self._save, self._save_every_s = envs, progress, bar, save, save_every_s
        self._recent: deque[tuple[bool, bool]] = deque(maxlen=_RECENT)

    def _on_training_start(self) -> None:
        self._since = self._saved = time.monotonic()

    def _on_rollout_start(self) -> None:
        self._spent("learning")
        if self._since - self._saved > self._save_every_s:
            self._save()
            self._spent("saving")
            self._saved = self._since

    def _on_step(self) -> bool:
        infos = self.locals["infos"]
        self._progress.decisions = self.num_timesteps
        self._progress.env_steps += sum(info["periods"] for info in infos)
        self._recent.extend((bool(info["is_success"]), bool(info["collision"])) for info in infos if "episode" in info)
        self._bar.update(len(infos))
        return True

    def _on_rollout_end(self) -> None:
        self._spent("learning")
        self._progress.move("learning", "waiting", self._envs.waited_s)
        self._envs.waited_s = 0.0
        self.logger.record("time/env_steps", self._progress.env_steps)
        if self._recent:
            success, collision = np.array(self._recent).T
            self.logger.record("rollout/collision_free", float(np.mean(success & ~collision)))

    def _on_training_end(self) -> None:
        self._spent("learning")

    def _spent(self, what: str) -> None:
        now = time.monotonic()
        self._progress.spend(what, now - self._since)
        self._since = now
