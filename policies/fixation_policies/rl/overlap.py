"""Learning while the environments are busy: SB3 alternates between the two, which leaves cores idle in both."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from stable_baselines3 import SAC
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn


class BusyEnvs(VecEnvWrapper):
    """Does something else while all environments step."""

    def __init__(self, venv: VecEnv) -> None:
        """Wrap environments that step in other processes."""
        super().__init__(venv)
        self.meanwhile: Callable[[], None] | None = None
        self.waited_s = 0.0
        """Time spent waiting for the environments after everything else was done, s."""

    def reset(self) -> VecEnvObs:
        """Reset all environments."""
        return self.venv.reset()

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Nothing: SB3 would seed with the run's seed and its neighbours, ``draw_new_scenes`` decides instead."""
        return [None] * self.num_envs

    def step_wait(self) -> VecEnvStepReturn:
        """Do something else, then wait for the environments."""
        if self.meanwhile is not None:
            self.meanwhile()
        started = time.monotonic()
        result = self.venv.step_wait()
        self.waited_s += time.monotonic() - started
        return result


def learn_meanwhile(model: SAC, envs: BusyEnvs, gradient_steps: int) -> None:
    """Let a model, made with ``gradient_steps=0``, learn while its environments step.

    The transitions of that step join the replay buffer after it, so learning lags behind by one of many.

    Args:
        model: is going to learn in ``envs``.
        envs: its environments.
        gradient_steps: per step of all environments.
    """

    def meanwhile() -> None:
        if model.num_timesteps > model.learning_starts:
            model.train(gradient_steps=gradient_steps, batch_size=model.batch_size)

    envs.meanwhile = meanwhile
