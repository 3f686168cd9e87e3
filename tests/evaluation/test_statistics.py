"""Statistics against published and hand-computed values."""

from __future__ import annotations

import math

import pytest

from fixation_gym.evaluation.statistics import (
    mcnemar_p,
    mean,
    median,
    median_difference,
    minimum,
    paired_difference_interval,
    quartiles,
    root_mean_square,
    wilson_interval,
)


@pytest.mark.parametrize(
    ("successes", "n", "low", "high"),
    [
        # R: prop.test(k, n, correct = FALSE)$conf.int
        (0, 10, 0.0, 0.2775328),
        (10, 10, 0.7224672, 1.0),
        (5, 10, 0.2365931, 0.7634069),
        (81, 263, 0.2553116, 0.3662029),  # Newcombe 1998, table I: 0.2553 to 0.3662
        (15, 148, 0.0623878, 0.1605401),  # the same: 0.0624 to 0.1605
    ],
)
def test_wilson_interval_has_published_values(successes: int, n: int, low: float, high: float) -> None:
    assert wilson_interval(successes, n) == pytest.approx((low, high), abs=1e-4)


def test_wilson_interval_contains_the_rate_and_stays_within_zero_and_one() -> None:
    for n in (1, 2, 7, 50, 1000):
        for successes in range(n + 1):
            low, high = wilson_interval(successes, n)
            assert 0.0 <= low <= successes / n <= high <= 1.0


def test_wilson_interval_is_symmetric_in_success_and_failure() -> None:
    low, high = wilson_interval(3, 20)
    assert wilson_interval(17, 20) == pytest.approx((1 - high, 1 - low))


def test_wilson_interval_solves_the_score_equation() -> None:
    for bound in wilson_interval(7, 30):
        assert abs(7 / 30 - bound) / math.sqrt(bound * (1 - bound) / 30) == pytest.approx(1.959964, abs=1e-5)


def test_more_confidence_gives_a_wider_interval() -> None:
    low_90, high_90 = wilson_interval(7, 20, confidence=0.90)
    low_99, high_99 = wilson_interval(7, 20, confidence=0.99)
    assert low_99 < low_90 < high_90 < high_99


def test_without_trials_nothing_is_known() -> None:
    assert wilson_interval(0, 0) == (0.0, 1.0)


@pytest.mark.parametrize(("successes", "n", "confidence"), [(-1, 5, 0.95), (6, 5, 0.95), (1, 5, 0.0), (1, 5, 1.0)])
def test_impossible_arguments_of_wilson_are_errors(successes: int, n: int, confidence: float) -> None:
    with pytest.raises(ValueError, match="must be"):
        wilson_interval(successes, n, confidence)


def test_missing_values_are_left_out() -> None:
    values = [3.0, None, math.nan, math.inf, 4.0, 11.0]
    assert mean(values) == pytest.approx(6.0)
    assert median(values) == 4.0
    assert minimum(values) == 3.0
    assert root_mean_square([3.0, None, 4.0]) == pytest.approx(math.sqrt(12.5))


@pytest.mark.parametrize("statistic", [mean, median, minimum, root_mean_square])
def test_a_statistic_of_nothing_is_none(statistic) -> None:
    assert statistic([]) is None
    assert statistic([None, math.nan]) is None


@pytest.mark.parametrize(
    ("first_only", "second_only", "p"),
    [
        (0, 0, 1.0),
        (6, 0, 2 / 64),
        (1, 5, 14 / 64),  # 2 (1 + 6) / 2^6
        (3, 3, 1.0),
    ],
)
def test_mcnemar_is_the_two_sided_binomial_test(first_only: int, second_only: int, p: float) -> None:
    assert mcnemar_p(first_only, second_only) == pytest.approx(p)
    assert mcnemar_p(second_only, first_only) == pytest.approx(p)


def test_the_interval_of_a_paired_difference_is_newcombes() -> None:
    # By hand: Wilson 48/50 [0.8654, 0.9890] and 38/50 [0.6259, 0.8570], phi = -24 / sqrt(48 2 38 12) = -0.1147.
    assert paired_difference_interval(36, 12, 2, 0) == pytest.approx((0.0569, 0.3404), abs=1e-3)


def test_the_interval_of_a_paired_difference_contains_it_and_changes_sign_with_the_order() -> None:
    for counts in ((5, 3, 1, 2), (10, 0, 0, 0), (0, 4, 4, 0), (0, 0, 7, 0), (20, 1, 0, 3)):
        both, first, second, neither = counts
        low, high = paired_difference_interval(*counts)
        assert -1.0 <= low <= (first - second) / sum(counts) <= high <= 1.0
        assert high - low > 0.05
        assert paired_difference_interval(both, second, first, neither) == pytest.approx((-high, -low))
    with pytest.raises(ValueError, match="must be counted"):
        paired_difference_interval(0, 0, 0, 0)


def test_the_median_difference_is_of_pairs() -> None:
    first, second = [10.0, 20.0, 30.0], [9.0, 18.0, 27.0]
    found = median_difference(first, second)
    assert found is not None
    assert found[0] == 2.0
    assert 1.0 <= found[1] <= 2.0 <= found[2] <= 3.0
    assert median_difference([1.0], [2.0]) is None


def test_quartiles_leave_out_what_is_missing() -> None:
    assert quartiles([1.0, None, 2.0, math.nan, 3.0]) == (1.5, 2.0, 2.5)
    assert quartiles([None]) is None
