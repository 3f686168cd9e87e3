"""Rewards as named terms whose sum is the reward. Pure functions of two successive states of the task."""

from __future__ import annotations

from dataclasses import dataclass

from fixation_gym.envs.config import LIFT_HEIGHT

REWARDS = ("dense", "sparse")
SUCCESS_BONUS = 10.0
"""Larger than all shaping of an episode together, so that hovering never pays."""
COLLISION_COST = 5.0
TIME_COST = 0.004
"""Per control step, 2.5 for a whole episode at 25 Hz: hovering costs, and so does a grasp that fails."""
_DISTANCE_WEIGHT = 2.0
"""Potential per metre between tool and target; 0.5 m at the start is worth 1."""
_FARTHEST = 1.0
"""A target that rolled off the table costs no more than this distance, m."""


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


def potential(state: TaskState) -> float:
    """Progress in [-2, 1]: 0 with the tool at the target on the table, 1 with the target lifted."""
    return -_DISTANCE_WEIGHT * min(state.tool_distance, _FARTHEST) + min(max(state.rise, 0.0) / LIFT_HEIGHT, 1.0)


def dense_terms(before: TaskState, after: TaskState) -> dict[str, float]:
    """Potential-based shaping (Ng, Harada, Russell 1999, undiscounted), time, success bonus, the first collision."""
    return {
        "progress": potential(after) - potential(before),
        "time": -TIME_COST,
        "success": SUCCESS_BONUS * float(after.success and not before.success),
        "collision": -COLLISION_COST * float(after.collision and not before.collision),
    }


def sparse_terms(before: TaskState, after: TaskState) -> dict[str, float]:
    """1 on success, -1 for the first collision."""
    return {
        "progress": 0.0,
        "time": 0.0,
        "success": float(after.success and not before.success),
        "collision": -float(after.collision and not before.collision),
    }
