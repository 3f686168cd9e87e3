"""Statistics of success rates, of measurements with gaps, and of two policies on the same episodes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

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
    from scipy.stats import binomtest  # a second to import

    interval = binomtest(successes, n).proportion_ci(confidence, method="wilson")
    # Rounding must not exclude the observed rate at its limits.
    return min(float(interval.low), successes / n), max(float(interval.high), successes / n)


def mcnemar_p(first_only: int, second_only: int) -> float:
    """Two-sided exact McNemar test: how likely so uneven a split is if both policies are equally good.

    Args:
        first_only: pairs in which only the first succeeded.
        second_only: pairs in which only the second succeeded.
    """
    if first_only + second_only == 0:
        return 1.0
    from scipy.stats import binomtest  # a second to import

    return float(binomtest(first_only, first_only + second_only).pvalue)


def paired_difference_interval(
    both: int, first_only: int, second_only: int, neither: int, confidence: float = 0.95
) -> tuple[float, float]:
    """Interval of the difference of two success rates on the same episodes, first minus second.

    Newcombe 1998, "Improved confidence intervals for the difference between binomial proportions based on paired
    data", method 10: Wilson intervals, joined with the correlation. Like those it does not collapse
    where all pairs agree.

    Raises:
        ValueError: without pairs, or for a negative count.
    """
    n = both + first_only + second_only + neither
    if n == 0 or min(both, first_only, second_only, neither) < 0:
        raise ValueError(f"pairs must be counted, got {(both, first_only, second_only, neither)}")
    k_first, k_second = both + first_only, both + second_only
    p, q = k_first / n, k_second / n
    (p_low, p_high), (q_low, q_high) = wilson_interval(k_first, n, confidence), wilson_interval(k_second, n, confidence)
    product = k_first * (n - k_first) * k_second * (n - k_second)
    agreement = both * neither - first_only * second_only
    if agreement > 0:
        agreement = max(agreement - n / 2, 0.0)
    phi = agreement / math.sqrt(product) if product else 0.0
    down, up = _joined(p - p_low, q_high - q, phi), _joined(q - q_low, p_high - p, phi)
    return p - q - down, p - q + up


def _joined(a: float, b: float, correlation: float) -> float:
    return math.sqrt(max(0.0, a * a - 2.0 * correlation * a * b + b * b))


def median_difference(first: Sequence[float], second: Sequence[float]) -> tuple[float, float, float] | None:
    """Median of the paired differences, first minus second, and its 95 % percentile bootstrap interval.

    The bootstrap draws 2000 times with a fixed seed. None with fewer than two pairs.
    """
    differences = np.asarray(first, float) - np.asarray(second, float)
    if differences.size < 2:
        return None
    draws = np.random.default_rng(0).integers(0, differences.size, (2000, differences.size))
    low, high = np.percentile(np.median(differences[draws], axis=1), [2.5, 97.5])
    return float(np.median(differences)), float(low), float(high)


def quartiles(values: Iterable[float | None]) -> tuple[float, float, float] | None:
    """Lower quartile, median and upper quartile of the finite values; None if there are none."""
    known = _known(values)
    if not known.size:
        return None
    low, middle, high = np.percentile(known, [25, 50, 75])
    return float(low), float(middle), float(high)


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
