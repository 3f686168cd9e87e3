"""The page's tables: one row per policy, one column per scenario."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence

from fixation_gym.evaluation.failures import FailureKind
from fixation_gym.evaluation.rollout import EpisodeResult
from fixation_gym.evaluation.statistics import median, quartiles, wilson_interval
from fixation_gym.reporting.comparison import SuccessComparison, ValueComparison, scaled
from fixation_gym.reporting.digest import PolicyRecord
from fixation_gym.reporting.markup import Html, element, escaped, joined, table

NOTHING = Html("&ndash;")


def rate_table(
    records: Sequence[PolicyRecord],
    scenarios: Sequence[str],
    succeeded: Callable[[EpisodeResult], bool],
    caption: str,
) -> Html:
    """k/n, rate and Wilson interval per policy and scenario, and over all."""

    def cell(results: Sequence[EpisodeResult]) -> Html:
        return rate(sum(map(succeeded, results)), len(results))

    return _by_scenario(records, scenarios, cell, caption)


def value_table(
    records: Sequence[PolicyRecord],
    scenarios: Sequence[str],
    value: Callable[[EpisodeResult], float | None],
    digits: int,
    caption: str,
) -> Html:
    """Median and quartiles per policy and scenario, and over all."""

    def cell(results: Sequence[EpisodeResult]) -> Html:
        found = quartiles(map(value, results))
        if found is None:
            return NOTHING
        low, middle, high = (f"{number:.{digits}f}" for number in found)
        return Html(f"{middle} <small>({low}&ndash;{high})</small>")

    return _by_scenario(records, scenarios, cell, caption)


def detail_table(records: Sequence[PolicyRecord]) -> Html:
    """What else was measured, over all scenarios."""
    head = ("policy", "episodes", "collisions", "fixation error px", "|error| mm", "error within 2 std", "return")
    rows = []
    for record in records:
        results = record.of(None)
        curves = [episode.curves for episode in record.episodes if episode.curves is not None]
        decisions = sum(curve.decisions for curve in curves)
        within = sum(curve.within_two_std for curve in curves)
        rows.append(
            (
                record.label,
                str(len(results)),
                str(sum(result.collision for result in results)),
                number(median(result.fixation_rms_px for result in results), 1),
                number(scaled(median(result.distance_mae_m for result in results), 1000.0), 1),
                f"{100 * within / decisions:.0f} %" if decisions else NOTHING,
                number(median(result.return_ for result in results), 2),
            )
        )
    return table(
        head, rows, "All scenarios together, medians over episodes. Errors while the gaze is held (fixate, approach)."
    )


def comparison_table(comparisons: Sequence[SuccessComparison], caption: str) -> Html:
    """Rates of two policies on the same episodes."""
    head = ("scenario", "pairs", "both", "only reference", "only other", "neither", "difference", "McNemar p")
    rows = []
    for item in comparisons:
        low, high = (100.0 * bound for bound in item.interval)
        difference = Html(f"{100 * item.difference:+.0f} <small>[{low:+.0f}, {high:+.0f}]</small> points")
        counts = (item.pairs, item.both, item.reference_only, item.other_only, item.neither)
        rows.append((item.scenario, *map(str, counts), difference, f"{item.p:.2g}"))
    return table(head, rows, caption)


def difference_table(comparisons: Sequence[ValueComparison]) -> Html:
    """Median differences of measured values."""
    head = ("measure", "pairs", "median difference")
    rows = []
    for item in comparisons:
        low, high = item.interval
        rows.append(
            (item.measure, str(item.pairs), Html(f"{item.difference:+.2f} <small>[{low:+.2f}, {high:+.2f}]</small>"))
        )
    return table(head, rows, "Other minus reference, where both have the value; bootstrap 95 % intervals.")


def failure_table(records: Sequence[PolicyRecord]) -> Html:
    """How often each kind of failure occurred."""
    counts = {
        record.label: Counter(episode.failure.kind for episode in record.episodes if episode.failure is not None)
        for record in records
    }
    kinds = [kind for kind in FailureKind if any(found[kind] for found in counts.values())]
    rows = [
        (
            record.label,
            *(str(counts[record.label][kind]) if counts[record.label][kind] else NOTHING for kind in kinds),
            f"{sum(counts[record.label].values())} of {len(record.episodes)}",
        )
        for record in records
    ]
    return table(
        ("policy", *(kind.value for kind in kinds), "sum"), rows, "Episodes that were no collision-free success"
    )


def rate(successes: int, n: int) -> Html:
    """``k/n p% [lo, hi]``."""
    if n == 0:
        return NOTHING
    low, high = (100.0 * bound for bound in wilson_interval(successes, n))
    return joined(
        [
            f"{successes}/{n} ",
            element("b", f"{100 * successes / n:.0f}%"),
            Html(f" <small>[{low:.0f}, {high:.0f}]</small>"),
        ],
        "",
    )


def number(value: float | None, digits: int) -> Html:
    """A number, or a dash for None."""
    return NOTHING if value is None else escaped(f"{value:.{digits}f}")


def _by_scenario(
    records: Sequence[PolicyRecord],
    scenarios: Sequence[str],
    cell: Callable[[Sequence[EpisodeResult]], Html],
    caption: str,
) -> Html:
    several = len(scenarios) > 1
    rows = [
        (record.label, *(cell(record.of(name)) for name in scenarios), *([cell(record.of(None))] if several else []))
        for record in records
    ]
    return table(("policy", *scenarios, *(["all"] if several else [])), rows, caption)
