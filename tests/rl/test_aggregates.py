"""Interquartile mean and bootstrap against known values."""

import numpy as np
import pytest
from scipy.stats import trim_mean, ttest_1samp

from fixation_policies.rl.aggregates import (
    bootstrap_interval,
    interquartile_mean,
    probability_of_improvement,
    student_interval,
)


def test_the_interquartile_mean_leaves_out_a_quarter_at_each_end():
    assert interquartile_mean(np.array([0.0, 1.0, 3.0, 100.0])) == 2.0
    scores = np.random.default_rng(0).random((5, 8))
    assert interquartile_mean(scores) == pytest.approx(trim_mean(scores.ravel(), 0.25))


def test_parts_of_scores_are_left_out_when_a_quarter_is_no_whole_number():
    # Of five, a quarter is 1.25: the middle one counts fully, its neighbours with three quarters.
    scores = np.array([0.0, 0.2, 0.5, 0.9, 1.0])
    assert interquartile_mean(scores) == pytest.approx((0.75 * 0.2 + 0.5 + 0.75 * 0.9) / 2.5)
    assert interquartile_mean(np.array([0.3])) == pytest.approx(0.3)


def test_equal_seeds_leave_no_uncertainty_however_different_the_tasks():
    scores = np.tile([0.1, 0.5, 0.9, 0.9], (5, 1))
    centre = pytest.approx(interquartile_mean(scores))
    assert bootstrap_interval(scores) == (centre, centre)


def test_the_interval_of_a_mean_is_the_textbook_one():
    scores = np.random.default_rng(1).normal(0.5, 0.1, (400, 1))
    low, high = bootstrap_interval(scores, statistic=np.mean)
    half = 1.96 * scores.std() / 20
    assert low == pytest.approx(scores.mean() - half, abs=0.1 * half)
    assert high == pytest.approx(scores.mean() + half, abs=0.1 * half)


def test_students_interval_is_that_of_scipy_and_needs_two():
    differences = np.random.default_rng(2).normal(0.1, 0.2, 5)
    assert student_interval(differences) == pytest.approx(ttest_1samp(differences, 0.0).confidence_interval(0.95))
    with pytest.raises(ValueError, match="two differences or more, got 1"):
        student_interval(np.array([0.1]))


def test_the_probability_of_improvement_counts_pairs_of_runs():
    ours, theirs = np.array([0.5, 0.7, 0.9]), np.array([0.5, 0.6])
    assert probability_of_improvement(ours, theirs) == pytest.approx((0.5 + 0 + 1 + 1 + 1 + 1) / 6)
    assert probability_of_improvement(ours, ours) == 0.5


@pytest.mark.parametrize("scores", [np.zeros(3), np.zeros((0, 2))])
def test_scores_that_are_no_matrix_are_refused(scores):
    with pytest.raises(ValueError, match="seeds, tasks"):
        bootstrap_interval(scores)
