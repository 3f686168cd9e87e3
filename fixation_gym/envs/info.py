"""The ``info`` of the environments: how it goes, and true values, which never reach the observation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fixation_gym.envs.rewards import TERMS, TaskState


def info_of(
    state: TaskState, clearance: float, sight: tuple[float, float], terms: Mapping[str, float]
) -> dict[str, Any]:
    """The info of a step; its keys are those of the class's page.

    Args:
        state: of the task.
        clearance: between robot and obstacles, m.
        sight: depth of the target's centre, m, and its offset from the image centre, px.
        terms: of the reward.
    """
    # NumPy's scalars and nothing nested: some libraries ask every value for its dtype.
    return {
        "is_success": np.bool_(state.success),
        "success": np.bool_(state.success),
        "collision": np.bool_(state.collision),
        "clearance_m": np.float64(clearance),
        "distance_true_m": np.float64(sight[0]),
        "fixation_error_px": np.float64(sight[1]),
        **with_prefix(terms),
    }


def with_prefix(terms: Mapping[str, float]) -> dict[str, np.float64]:
    """Terms of the reward as an info has them: ``reward_progress`` and so on, as in Gymnasium's own environments."""
    return {f"reward_{term}": np.float64(value) for term, value in terms.items()}


def reward_terms(info: Mapping[str, Any]) -> dict[str, float]:
    """The terms of the reward in an info, by their names in ``TERMS``."""
    return {term: float(info[f"reward_{term}"]) for term in TERMS}
