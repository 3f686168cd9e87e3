"""Rewards as named terms whose sum is the reward. Pure functions of two successive states of the task."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields
from functools import partial
from numbers import Real
from typing import Any

from fixation_gym.envs.arguments import require_choice
from fixation_gym.envs.config import LIFT_HEIGHT
from fixation_gym.envs.field_checks import with_fields

REWARDS = ("dense", "sparse")
TERMS: tuple[str, ...] = ("progress", "time", "success", "collision")
"""Names of the terms, the same with every reward."""


@dataclass(frozen=True)
class RewardWeights:
    """Weights of the dense reward, each a finite number, 0 or more.

    Raises:
        ValueError: for another value; the message names the weight.
    """

    success_bonus: float = 10.0
    """Reward of success; by default larger than all shaping of an episode together, so that hovering never pays."""
    collision_cost: float = 5.0
    """Price of the first collision."""
    time_cost: float = 0.004
    """Price of a control step, 2.5 for a whole episode at 25 Hz: hovering costs, and so does a grasp that fails."""
    distance_weight: float = 2.0
    """Potential per metre between tool and target, 1/m; 0.5 m at the start is worth 1."""
    farthest_distance: float = 1.0
    """A target that rolled off the table costs no more than this distance, m."""

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not isinstance(value, Real) or not 0.0 <= float(value) < math.inf:
                raise ValueError(f"reward weight {name} must be a finite number, 0 or more, got {value!r}")


@dataclass(frozen=True)
class TaskState:
    """What rewards depend on."""

    tool_distance: float
    """Distance between the point between the finger pads and the target's centre, m."""
    rise: float
    """Height of the target above its resting height, m."""
    success: bool
    collision: bool
    """Whether a collision has happened in this episode so far."""


def choose_terms(
    reward: str, weights: RewardWeights | Mapping[str, Any] | None
) -> Callable[[TaskState, TaskState], dict[str, float]]:
    """The function that gives the terms of a step from the states before and after it.

    Args:
        reward: "dense" or "sparse".
        weights: of the dense reward, or a mapping with some of them; None for the defaults.

    Raises:
        ValueError: for a value that is not allowed; the message says what is.
    """
    require_choice("reward", reward, REWARDS)
    if reward == "sparse":
        if weights is not None:
            raise ValueError('reward_weights are for reward="dense" only; "sparse" gives 1 and -1')
        return sparse_terms
    return partial(dense_terms, weights=resolve_weights({} if weights is None else weights))


def resolve_weights(weights: RewardWeights | Mapping[str, Any]) -> RewardWeights:
    """The weights themselves, or the defaults with those of a mapping in their place.

    Raises:
        ValueError: for an unknown name or a value that is not allowed; the message says what is.
    """
    if isinstance(weights, RewardWeights):
        return weights
    if not isinstance(weights, Mapping):
        known = [field.name for field in fields(RewardWeights)]
        raise ValueError(f"reward_weights must be a mapping from {known} to numbers, got {weights!r}")
    return with_fields(RewardWeights(), weights, "reward_weights")


def potential(state: TaskState, weights: RewardWeights) -> float:
    """Progress: 0 with the tool at the target on the table, 1 with the target lifted, below 0 away from it."""
    distance = min(state.tool_distance, weights.farthest_distance)
    return -weights.distance_weight * distance + min(max(state.rise, 0.0) / LIFT_HEIGHT, 1.0)


def dense_terms(before: TaskState, after: TaskState, weights: RewardWeights) -> dict[str, float]:
    """Potential-based shaping (Ng, Harada, Russell 1999, undiscounted), time, success bonus, the first collision."""
    return {
        "progress": potential(after, weights) - potential(before, weights),
        "time": -weights.time_cost,
        "success": weights.success_bonus * float(after.success and not before.success),
        "collision": -weights.collision_cost * float(after.collision and not before.collision),
    }


def sparse_terms(before: TaskState, after: TaskState) -> dict[str, float]:
    """1 on success, -1 for the first collision."""
    return {
        "progress": 0.0,
        "time": 0.0,
        "success": float(after.success and not before.success),
        "collision": -float(after.collision and not before.collision),
    }
