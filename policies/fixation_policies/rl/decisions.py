"""Decisions: a learner acts a few times per second, and a whole grasp is one step to it."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from fixation_gym.envs.info import reward_terms, with_prefix
from fixation_gym.envs.rewards import TERMS
from fixation_policies.rl.config import Configuration
from fixation_policies.rl.inputs import (
    PERIODS,
    Memory,
    blind_stage,
    busy,
    input_space,
    learner_for,
    network_inputs,
    remember,
)

_TRIGGER_BIAS = 0.8
"""Taken off the trigger, so that the first random actions seldom grasp: a grasp takes 100 control periods and more."""


class DecisionEnv(gym.Wrapper[dict[str, Any], NDArray[np.float32], dict[str, Any], NDArray[np.float32]]):
    """``FixationPickZFC-v0`` as the networks see it: inputs instead of observations, decisions instead of periods.

    ``step`` holds an action for ``PERIODS`` control periods. If it triggers the grasp, it goes on until the manoeuvre
    has ended and the next action counts: steps whose actions are ignored would teach nothing, and with random
    actions they are nearly all. While the tool goes in, the fingers close and lift, no image is rendered: it would be
    most of the time of a manoeuvre. So in training, and only there, a grasp does not follow a target that is pushed, or
    whose body is seen better on the way.
    The memory of the view rests meanwhile, here and in agents.
    Rewards and their terms in ``info`` are summed; ``info["periods"]`` counts.
    """

    def __init__(self, env: gym.Env[Any, Any], learner: Configuration | None = None) -> None:
        """Wrap ``FixationPickZFC-v0`` with any observation, or the residual learner's environment.

        Args:
            env: the environment.
            learner: who is to see its observation; None: the plainest one.
        """
        super().__init__(env)
        self._learner = learner or learner_for(env.observation_space)
        self.observation_space = input_space(self._learner)
        self.action_space = spaces.Box(-1.0, 1.0, env.action_space.shape, np.float32)
        self._memory: Memory | None = None
        self._base: Any = env.unwrapped  # FixationPickEnv

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start an episode."""
        obs, info = self.env.reset(seed=seed, options=options)
        self._memory = remember(None, obs, self._learner)
        return network_inputs(obs, self._memory, self._learner), {**info, "periods": 0}

    def step(self, action: NDArray[np.float32]) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Act until the next decision."""
        command = env_action(action)
        total, terms, periods, grasping = 0.0, dict.fromkeys(TERMS, 0.0), 0, False
        while True:
            obs, reward, terminated, truncated, info = self.env.step(command)
            if self._base.camera_on:
                self._memory = remember(self._memory, obs, self._learner)
            total, periods = total + float(reward), periods + 1
            terms = {name: terms[name] + value for name, value in reward_terms(info).items()}
            was_grasping, grasping = grasping, busy(obs)
            self._base.camera_on = not blind_stage(obs)
            decide = was_grasping or periods >= PERIODS
            if terminated or truncated or (decide and not grasping):
                break
        info = {**info, **with_prefix(terms), "periods": periods}
        return network_inputs(obs, self._memory, self._learner), total, terminated, truncated, info


def env_action(action: NDArray[np.float32]) -> NDArray[np.float32]:
    """Action of the environment for one of the network; only the trigger, if there is one, differs."""
    shifted = np.array(action, np.float32)
    shifted[3:] -= _TRIGGER_BIAS
    return shifted


class FixedEpisodes(gym.Wrapper[Any, Any, Any, Any]):
    """Between ``rewind`` and ``release``, resets with the seeds of a list, so that evaluations meet the same scenes."""

    def __init__(self, env: gym.Env[Any, Any], seeds: list[int]) -> None:
        """Wrap; ``seeds`` start again when they are used up."""
        super().__init__(env)
        self._seeds, self._next, self._fixed = seeds, 0, False

    def rewind(self) -> None:
        """Begin with the first seed at the next reset."""
        self._next, self._fixed = 0, True

    def release(self, seed: int) -> None:
        """Draw new scenes again, from ``seed`` on."""
        self._fixed = False
        self.env.reset(seed=seed)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Start the next episode; ``seed`` is not used while the seeds are fixed."""
        if self._fixed:
            seed = self._seeds[self._next % len(self._seeds)]
            self._next += 1
        return self.env.reset(seed=seed, options=options)
