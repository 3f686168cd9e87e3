"""Statistics of success rates and of measurements with gaps."""

from __future__ import annotations

import math
from collections.abc import Iterable
from statistics import NormalDist

import numpy as np


def wilson_interval(successes: int, n: int, confidence: float = 0.95) -> tuple[float, float]:
    """Wilson score interval of a success rate.

    Unlike the normal approximation it stays within [0, 1] and does not collapse at 0 or n successes.

    Args:
        successes: number of successes, 0 to n.
        n: number of trials. Without trials nothing is known, and the interval is (0, 1).
        confidence: coverage, between 0 and 1.

    Raises:
        ValueError: if the counts or the confidence are out of range.
    """
    if not 0 <= successes <= n:
        raise ValueError(f"successes must be within 0..n, got {successes} of {n}")
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence must be between 0 and 1, got {confidence}")
    if n == 0:
        return 0.0, 1.0
    z = NormalDist().inv_cdf(0.5 + confidence / 2.0)
    rate = successes / n
    centre = (rate + z * z / (2 * n)) / (1 + z * z / n)
    half_width = z * math.sqrt(rate * (1 - rate) / n + z * z / (4 * n * n)) / (1 + z * z / n)
    # Rounding must not exclude the observed rate at its limits.
    low = 0.0 if successes == 0 else max(0.0, centre - half_width)
    high = 1.0 if successes == n else min(1.0, centre + half_width)
    return low, high


def mean(values: Iterable[float | None]) -> float | None:
    """Mean of the finite values; None if there are none."""
    known = _known(values)
    return float(np.mean(known)) if known.size else None


def median(values: Iterable[float | None]) -> float | None:
    """Median of the finite values; None if there are none."""
    known = _known(values)
    return float(np.median(known)) if known.size else None


def root_mean_square(values: Iterable[float | None]) -> float | None:
    """Root of the mean square of the finite values; None if there are none."""
    known = _known(values)
    return float(np.sqrt(np.mean(known**2))) if known.size else None


def minimum(values: Iterable[float | None]) -> float | None:
    """Smallest of the finite values; None if there are none."""
    known = _known(values)
    return float(known.min()) if known.size else None


def _known(values: Iterable[float | None]) -> np.ndarray:
    array = np.array([math.nan if value is None else value for value in values], dtype=np.float64)
    return array[np.isfinite(array)]
