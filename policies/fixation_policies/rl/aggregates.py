"""Aggregates over training seeds, after Agarwal et al. 2021, "Deep RL at the Edge of the Statistical Precipice"."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fixation_gym.types import FloatArray

_DRAWS = 2000


def interquartile_mean(scores: FloatArray) -> float:
    """Mean of the middle half of all scores, of any shape: 25 % are cut off at each end, parts of scores included.

    Raises:
        ValueError: without scores.
    """
    values = np.sort(np.ravel(scores))
    if not values.size:
        raise ValueError("there are no scores to take the mean of")
    cut = values.size / 4.0
    ranks = np.arange(values.size)
    weights = np.clip(ranks + 1.0 - cut, 0.0, 1.0) - np.clip(ranks + 1.0 - (values.size - cut), 0.0, 1.0)
    return float(weights @ values / weights.sum())


def bootstrap_interval(
    scores: FloatArray, statistic: Callable[[FloatArray], float] = interquartile_mean, confidence: float = 0.95
) -> tuple[float, float]:
    """Percentile interval of a statistic by the stratified bootstrap: in every column, rows are drawn again.

    The draws are the same every time.

    Args:
        scores: shape (seeds, tasks): one score per training seed, averaged over episodes, and task.
        statistic: of an array of that shape.
        confidence: coverage, between 0 and 1.

    Raises:
        ValueError: if ``scores`` is no matrix with rows.
    """
    if scores.ndim != 2 or not scores.size:
        raise ValueError(f"scores must have the shape (seeds, tasks), got {scores.shape}")
    rows = np.random.default_rng(0).integers(0, len(scores), (_DRAWS, *scores.shape))
    columns = np.arange(scores.shape[1])
    values = [statistic(scores[draw, columns]) for draw in rows]
    low, high = np.quantile(values, [0.5 - confidence / 2.0, 0.5 + confidence / 2.0])
    return float(low), float(high)


def student_interval(differences: FloatArray, confidence: float = 0.95) -> tuple[float, float]:
    """Student's interval of the mean of paired differences, wider than the bootstrap's where there are few.

    Raises:
        ValueError: with fewer than two.
    """
    values = np.ravel(differences)
    if values.size < 2:
        raise ValueError(f"an interval needs two differences or more, got {values.size}")
    from scipy.special import stdtrit

    half = stdtrit(values.size - 1, 0.5 + confidence / 2.0) * values.std(ddof=1) / np.sqrt(values.size)
    return float(values.mean() - half), float(values.mean() + half)


def probability_of_improvement(ours: FloatArray, theirs: FloatArray) -> float:
    """How often a run of ours has the higher score than one of theirs, over all pairs of runs; equal ones count half.

    Args:
        ours: one score per run, of any shape.
        theirs: the same of the others.
    """
    pairs = np.ravel(ours)[:, None] - np.ravel(theirs)[None]
    return float(np.mean((pairs > 0) + 0.5 * (pairs == 0)))
