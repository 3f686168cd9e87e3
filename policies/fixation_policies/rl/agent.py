"""Trained agents as policies: the same ``reset`` and ``act`` as every other, at the control rate."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from fixation_gym.control.open_loop import Stage
from fixation_gym.envs.zfc_observation import OBSERVATIONS
from fixation_gym.errors import UsageError
from fixation_gym.perception.percept import Percept
from fixation_gym.types import Observation
from fixation_policies.base import Action, Estimate
from fixation_policies.rl.agent_file import AgentCard, read_agent
from fixation_policies.rl.config import CONFIGS, Configuration
from fixation_policies.rl.decisions import env_action
from fixation_policies.rl.inputs import (
    PERIODS,
    STAGE,
    VIEWS,
    Memory,
    blind_stage,
    busy,
    network_inputs,
    remember,
)
from fixation_policies.rl.network import action
from fixation_policies.rl.residual import ResidualServo
from fixation_policies.servo.servo_policy import ServoPolicy

Network = Callable[[Mapping[str, NDArray[Any]]], NDArray[np.float32]]
"""Action for what it sees, an element of ``inputs.input_space``."""
_STAGES = tuple(stage.value for stage in Stage)


class Decider:
    """A network with the clock and the memory that it was trained with."""

    def __init__(self, network: Network, size: int, learner: Configuration) -> None:
        """Use a network that gives actions of this size, and was trained with this configuration."""
        self._network, self._size, self._learner = network, size, learner
        self.reset()

    def reset(self) -> None:
        """Forget the last episode."""
        self._memory: Memory | None = None
        self._looking = True
        self._periods = 0
        self._action = np.zeros(self._size, np.float32)

    def act(self, obs: Mapping[str, Any]) -> NDArray[np.float32]:
        """Output for an observation of ``FixationPickZFC-v0``: a new one when the last has been held long enough."""
        if self._looking:
            self._memory = remember(self._memory, obs, self._learner)
        self._looking = not blind_stage(obs)  # in training the next image is not rendered then
        if busy(obs):
            self._periods = 0  # the first action after a manoeuvre is a new one
        else:
            if self._periods % PERIODS == 0:
                self._action = self._network(network_inputs(obs, self._memory, self._learner))
            self._periods += 1
        return self._action


class Agent:
    """A learned policy of ``FixationPickZFC-v0``, for the observation it was trained on."""

    def __init__(self, card: AgentCard, decider: Decider) -> None:
        """Use a loaded network; see ``load_agent``."""
        self.card = card
        self.estimate: Estimate | None = None
        self._decider = decider

    def reset(self, seed: int | None = None) -> None:
        """Forget the last episode. The behaviour is deterministic; ``seed`` is not used."""
        self._decider.reset()
        self.estimate = None

    def act(self, obs: Mapping[str, Any]) -> Action:
        """Action of shape (4,)."""
        stage = np.flatnonzero(obs["proprio"][STAGE])
        phase = _STAGES[stage[0]] if stage.size else "approach"
        self.estimate = Estimate(float(obs["fixation"][3]), float(obs["fixation"][4]), phase)
        return env_action(self._decider.act(obs))


class ResidualAgent:
    """A learned policy of ``FixationPick-v0``: the servo, and what was learned to add to it."""

    def __init__(self, card: AgentCard, decider: Decider, servo: ServoPolicy) -> None:
        """Use a loaded network, and the servo that it was trained to help."""
        self.card = card
        self.estimate: Estimate | None = None
        self.percept: Percept | None = None
        self._decider, self._servo = decider, ResidualServo(servo)

    def reset(self, seed: int | None = None) -> None:
        """Forget the last episode. The behaviour is deterministic; ``seed`` is not used."""
        self._decider.reset()
        self._servo.reset(seed)
        self.estimate = self.percept = None

    def act(self, obs: Mapping[str, Any]) -> Action:
        """Action of shape (7,)."""
        shown = self._servo.look(Observation.from_dict(obs))
        self.estimate, self.percept = self._servo.servo.estimate, self._servo.servo.percept
        return self._servo.action(self._decider.act(shown))


def load_agent(path: Path, env: Any) -> Agent | ResidualAgent:
    """The agent in a file.

    Args:
        path: written by ``fixation-gym train``.
        env: the environment it will act in; only "residual" needs its camera.

    Raises:
        UsageError: if the file is damaged, or the agent needs another observation than ``env`` shows.
    """
    card, weights = read_agent(path)
    learner = CONFIGS[card.config]
    _check_observation(path, card, learner, env.observation_space)
    decider = Decider(partial(action, card.algorithm, learner, weights), 2 if learner.residual else 4, learner)
    if not learner.residual:
        return Agent(card, decider)
    from fixation_policies.catalogue import make_policy

    servo = make_policy("servo", env)
    assert isinstance(servo, ServoPolicy)
    return ResidualAgent(card, decider, servo)


def _check_observation(path: Path, card: AgentCard, learner: Configuration, space: spaces.Dict) -> None:
    keys = set(space.keys())
    if learner.residual:
        if "time" not in keys:
            raise UsageError(f"{path} is a residual agent: it acts in FixationPick-v0")
        return
    view = VIEWS[learner.observation]
    shown = {key for key in VIEWS.values() if key in keys}
    if "fixation" not in keys or shown != ({view} - {None}):
        allowed = f'FixationPickZFC-v0 with observation="{learner.observation}"'
        assert learner.observation in OBSERVATIONS
        raise UsageError(f"{path} is an agent of configuration {card.config}: it acts in {allowed}")
