"""Summaries of finished episodes, as values and as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fixation_gym.evaluation.rollout import EpisodeResult
from fixation_gym.evaluation.statistics import mean, median, minimum, wilson_interval
from fixation_gym.evaluation.text_table import aligned

CLEARANCE_LIMIT_M = 0.5
"""The environment measures clearances up to here only, and reports this value without obstacles, too."""

HEADER = ("scenario", "success [95 % CI]", "collision-free [95 % CI]", "time s", "distance error at grasp mm")


def summarise(results: Sequence[EpisodeResult]) -> dict[str, dict[str, Any]]:
    """Summarise per scenario, in the order in which scenarios first occur.

    ``mean_time_s`` is over all episodes (time-outs count in full), ``mean_success_time_s`` over the successful ones.
    A value is None where no episode has it; ``min_clearance_m`` also where it reaches ``CLEARANCE_LIMIT_M``, because
    the environment then measured no obstacle: it is further away, or there is none.
    """
    scenarios = dict.fromkeys(result.scenario for result in results)
    return {name: _summarise([result for result in results if result.scenario == name]) for name in scenarios}


def _summarise(results: Sequence[EpisodeResult]) -> dict[str, Any]:
    n = len(results)
    clearance = minimum(result.min_clearance_m for result in results)
    if clearance is not None and clearance >= CLEARANCE_LIMIT_M:  # saturated: no measurement
        clearance = None
    successes = sum(result.success for result in results)
    collision_free = sum(result.collision_free_success for result in results)
    return {
        "episodes": n,
        "successes": successes,
        "collision_free_successes": collision_free,
        "success_ci95": list(wilson_interval(successes, n)),
        "collision_free_ci95": list(wilson_interval(collision_free, n)),
        "mean_time_s": mean(result.time_s for result in results),
        "distance_mae_m": mean(result.distance_mae_m for result in results),
        "fixation_rms_px": mean(result.fixation_rms_px for result in results),
        "collisions": sum(result.collision for result in results),
        "mean_success_time_s": mean(result.time_s for result in results if result.success),
        "distance_error_at_grasp_median_m": median(result.distance_error_at_grasp_m for result in results),
        "min_clearance_m": clearance,
        "mean_return": mean(result.return_ for result in results),
    }


def format_table(scenarios: Mapping[str, Mapping[str, Any]]) -> str:
    """Format the output of ``summarise`` as plain text, one row per scenario.

    The time is the mean over successful episodes, the distance error the median.
    """
    return aligned([HEADER, *(_row(name, values) for name, values in scenarios.items())])


def _row(name: str, values: Mapping[str, Any]) -> tuple[str, ...]:
    n = values["episodes"]
    return (
        name,
        _rate(values["successes"], n, values["success_ci95"]),
        _rate(values["collision_free_successes"], n, values["collision_free_ci95"]),
        _number(values["mean_success_time_s"], 1.0),
        _number(values["distance_error_at_grasp_median_m"], 1000.0),
    )


def _rate(k: int, n: int, interval: Sequence[float]) -> str:
    percent = 100.0 * k / n if n else 0.0
    return f"{k}/{n}  {percent:.0f}% [{100 * interval[0]:.0f}, {100 * interval[1]:.0f}]"


def _number(value: float | None, scale: float) -> str:
    return "-" if value is None else f"{value * scale:.1f}"
