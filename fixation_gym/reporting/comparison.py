"""Two policies on the same episodes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fixation_gym.evaluation.rollout import EpisodeResult
from fixation_gym.evaluation.statistics import mcnemar_p, median_difference, paired_difference_interval
from fixation_gym.reporting.digest import PolicyRecord

ALL = "all"
"""Stands for all scenarios together."""

SUCCESS_MEASURES: dict[str, Callable[[EpisodeResult], bool]] = {
    "success": lambda result: result.success,
    "collision-free success": lambda result: result.collision_free_success,
}
VALUE_MEASURES: dict[str, Callable[[EpisodeResult], float | None]] = {
    "time to lift, s": lambda result: result.time_s if result.success else None,
    "distance error at grasp, mm": lambda result: scaled(result.distance_error_at_grasp_m, 1000.0),
    "fixation error, px": lambda result: result.fixation_rms_px,
}


@dataclass(frozen=True)
class SuccessComparison:
    """How often which of two policies succeeded on the same episodes."""

    reference: str
    other: str
    scenario: str
    measure: str
    both: int
    reference_only: int
    other_only: int
    neither: int
    difference: float
    """Rate of the other minus rate of the reference."""
    interval: tuple[float, float]
    """95 %, Newcombe's for paired rates."""
    p: float
    """Exact McNemar test, two-sided."""

    @property
    def pairs(self) -> int:
        """Number of common episodes."""
        return self.both + self.reference_only + self.other_only + self.neither


@dataclass(frozen=True)
class ValueComparison:
    """How much a measured value differs on the episodes in which both policies have it."""

    reference: str
    other: str
    measure: str
    pairs: int
    difference: float
    """Median of other minus reference."""
    interval: tuple[float, float]
    """95 %, percentile bootstrap."""


def compare_success(reference: PolicyRecord, other: PolicyRecord, scenarios: list[str]) -> list[SuccessComparison]:
    """Compare the rates per scenario and, with several, over all; scenarios without common episodes are left out."""
    groups = [*scenarios, ALL] if len(scenarios) > 1 else scenarios
    found = []
    for measure, succeeded in SUCCESS_MEASURES.items():
        for scenario in groups:
            pairs = _pairs(reference, other, None if scenario == ALL else scenario)
            outcomes = [(succeeded(first), succeeded(second)) for first, second in pairs]
            if outcomes:
                found.append(_success(reference.label, other.label, scenario, measure, outcomes))
    return found


def compare_values(reference: PolicyRecord, other: PolicyRecord) -> list[ValueComparison]:
    """Compare times and errors over all common episodes; measures with fewer than two pairs are left out."""
    found = []
    for measure, value in VALUE_MEASURES.items():
        both = [(value(first), value(second)) for first, second in _pairs(reference, other, None)]
        known = [(first, second) for first, second in both if first is not None and second is not None]
        result = median_difference([second for _, second in known], [first for first, _ in known])
        if result is not None:
            middle, low, high = result
            found.append(ValueComparison(reference.label, other.label, measure, len(known), middle, (low, high)))
    return found


def _success(
    reference: str, other: str, scenario: str, measure: str, outcomes: list[tuple[bool, bool]]
) -> SuccessComparison:
    both, neither = outcomes.count((True, True)), outcomes.count((False, False))
    first_only, second_only = outcomes.count((True, False)), outcomes.count((False, True))
    return SuccessComparison(
        reference=reference,
        other=other,
        scenario=scenario,
        measure=measure,
        both=both,
        reference_only=first_only,
        other_only=second_only,
        neither=neither,
        difference=(second_only - first_only) / len(outcomes),
        interval=paired_difference_interval(both, second_only, first_only, neither),
        p=mcnemar_p(first_only, second_only),
    )


def _pairs(
    reference: PolicyRecord, other: PolicyRecord, scenario: str | None
) -> list[tuple[EpisodeResult, EpisodeResult]]:
    """Results on the same scenario and seed."""
    theirs = {result.key: result for result in other.of(scenario)}
    return [(result, theirs[result.key]) for result in reference.of(scenario) if result.key in theirs]


def scaled(value: float | None, scale: float) -> float | None:
    """A value in another unit; None stays None."""
    return None if value is None else scale * value
