"""One episode of the servo under one degradation, with its maps against the truth."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

from fixation_gym.envs.privileged_map import PictureTruth, nearer_map
from fixation_gym.evaluation.rollout import GAZE_PHASES
from fixation_gym.experiments.robustness.map_scores import MARGIN, cell_counts
from fixation_gym.types import ImageArray

_KEPT = 6
"""Pictures whose truth is kept: a map is of the picture before the newest."""


@dataclass(frozen=True)
class DegradedEpisode:
    """What came of one episode."""

    success: bool
    collision: bool
    time_s: float
    distance_error: float | None
    """Median of the error of Z_f against the depth of the target's centre, as a share of it, while gazing."""
    seen: float
    """Share of the time of gazing and searching in which the target is seen."""
    maps: int
    """Maps that were scored: of new pictures, while gazing."""
    counts: dict[str, int]
    """Sums of ``cell_counts``."""


def run_degraded(env: gymnasium.Env, policy: Any, seed: int) -> DegradedEpisode:
    """Run an episode of the servo in ``FixationPick-v0``.

    Args:
        env: the environment, with the degradation as its ``sensor_noise``.
        policy: a servo; its ``percept`` is judged.
        seed: of the episode.
    """
    base: Any = env.unwrapped
    obs, info = env.reset(seed=seed)
    policy.reset(seed)
    truth = PictureTruth(base.wrist_view, base.model)
    truths: dict[float, tuple[ImageArray, ImageArray]] = {}
    counts: Counter[str] = Counter()
    errors: list[float] = []
    seen: list[bool] = []
    maps, scored, over = 0, -np.inf, False
    while not over:
        stamp = float(obs["image_time"][0])
        if stamp not in truths:
            depth, distance = truth.look(base.picture_qpos)
            truths[stamp] = nearer_map(depth, distance), nearer_map(depth, distance / (1.0 + MARGIN))
            truths = dict(list(truths.items())[-_KEPT:])
        action = policy.act(obs)
        percept, phase = policy.percept, str(policy.estimate.phase)
        if phase in (*GAZE_PHASES, "search"):
            seen.append(percept.fixation.visible)
        if phase in GAZE_PHASES:
            errors.append(abs(percept.fixation.distance_m / float(info["distance_true_m"]) - 1.0))
            if percept.flow.valid and percept.flow.time > scored and percept.flow.time in truths:
                counts += cell_counts(percept.zfc.cells, *truths[percept.flow.time])
                maps, scored = maps + 1, percept.flow.time
        obs, _, terminated, truncated, info = env.step(action)
        over = terminated or truncated
    return DegradedEpisode(
        success=bool(info["is_success"]),
        collision=bool(info["collision"]),
        time_s=float(obs["time"][0]),
        distance_error=float(np.median(errors)) if errors else None,
        seen=float(np.mean(seen)),
        maps=maps,
        counts=dict(counts),
    )
