"""What every policy offers, and what it may say about itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fixation_gym.strangers import whose_code

if TYPE_CHECKING:
    from fixation_gym.envs.pick_sim import PickSim
    from fixation_gym.envs.scene import SceneSpec

Action = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Estimate:
    """A policy's own view of the episode, for evaluation."""

    distance_m: float
    """Depth of the target along the optical axis, m; NaN if unknown."""
    distance_std_m: float
    """Its standard deviation, m."""
    phase: str
    """What the policy is doing."""


class Policy(Protocol):
    """Chooses actions of ``FixationPick-v0``."""

    estimate: Estimate | None
    """What the policy believed at its last action; None if it has no beliefs."""

    def reset(self, seed: int | None = None) -> None:
        """Forget the last episode."""
        ...

    def act(self, obs: Mapping[str, Any]) -> Action:
        """Action of shape (7,) for an observation."""
        ...


def decision(policy: Policy, obs: Mapping[str, Any]) -> Action:
    """What a policy does about an observation.

    Raises:
        RuntimeError: from whatever somebody else's policy raised, naming whose code it was.
    """
    with whose_code("policy", policy):
        return policy.act(obs)


class SimulatedWorld(Protocol):
    """What a privileged policy looks into; an unwrapped ``FixationPick-v0`` is one."""

    @property
    def sim(self) -> PickSim:
        """The simulation."""
        ...

    @property
    def scene(self) -> SceneSpec | None:
        """The scene of the episode; None before the first."""
        ...
