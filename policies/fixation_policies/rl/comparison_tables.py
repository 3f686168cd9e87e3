"""Learning curves and final rates over seeds, with intervals: pure functions of the runs' results."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fixation_gym.evaluation.statistics import wilson_interval
from fixation_policies.rl.aggregates import (
    bootstrap_interval,
    interquartile_mean,
    probability_of_improvement,
    student_interval,
)

CURVES_FILE, TABLE_FILE, DIFFERENCES_FILE, FIGURE_FILE = "curves.csv", "table.csv", "differences.csv", "comparison.png"
MEASURES = {"success": "successes", "collision_free": "collision_free_successes"}
"""Names of rates, and the counts that they come from."""
ALL = "all"
"""Name of the aggregate over scenarios."""


def curves_of(results: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """One row per configuration and evaluation that all its seeds have: interquartile means with 95 % intervals.

    ``env_steps`` and ``wall_min`` are means over seeds.
    """
    rows: list[dict[str, Any]] = []
    for config in _configs(results):
        curves = [result["curve"] for result in results if result["config"] == config and result["curve"]]
        for points in zip(*curves, strict=False):
            row: dict[str, Any] = {
                "config": config,
                "seeds": len(points),
                "decisions": int(np.mean([point["decisions"] for point in points])),
                "env_steps": float(np.mean([point["env_steps"] for point in points])),
                "wall_min": float(np.mean([point["wall_s"] for point in points])) / 60.0,
            }
            for measure in MEASURES:
                row |= _aggregate(measure, np.array([[point[measure]] for point in points]))
            rows.append(row)
    return rows


def table_of(results: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """One row per configuration and scenario, and one over all scenarios if there are several.

    Rates are interquartile means over seeds with intervals of the bootstrap over seeds. What has one seed only, such as
    the servo, has Wilson intervals over episodes instead.
    """
    rows: list[dict[str, Any]] = []
    for config in _configs(results):
        runs = [result["scenarios"] for result in results if result["config"] == config]
        scenarios = list(runs[0])
        for name in [*scenarios, *([ALL] if len(scenarios) > 1 else [])]:
            chosen = scenarios if name == ALL else [name]
            episodes = sum(run[scenario]["episodes"] for run in runs for scenario in chosen)
            row: dict[str, Any] = {"config": config, "scenario": name, "seeds": len(runs), "episodes": episodes}
            for measure, count in MEASURES.items():
                if len(runs) > 1:
                    row |= _aggregate(measure, _rates(runs, chosen, count))
                    continue
                successes = sum(runs[0][scenario][count] for scenario in chosen)
                low, high = wilson_interval(successes, episodes)
                row |= {measure: successes / episodes, f"{measure}_low": low, f"{measure}_high": high}
            rows.append(row)
    return rows


def differences_of(results: Sequence[dict[str, Any]], reference: str) -> list[dict[str, Any]]:
    """One row per other learner and scenario: rates of ``reference`` minus its own, paired by seed.

    Means over the seeds that both have, with intervals of the bootstrap over them and, as ``_t_low`` and ``_t_high``,
    of Student; ``_improved`` is the probability of improvement. One seed has no interval, so no row.
    """
    runs = {(result["config"], result["seed"]): result["scenarios"] for result in results if result["curve"]}
    rows = []
    for other in _configs([result for result in results if result["curve"] and result["config"] != reference]):
        seeds = [seed for config, seed in runs if config == other and (reference, seed) in runs]
        if len(seeds) < 2:
            continue
        for name in runs[reference, seeds[0]]:
            row: dict[str, Any] = {"config": reference, "minus": other, "scenario": name, "seeds": len(seeds)}
            for measure, count in MEASURES.items():
                ours, theirs = (
                    _rates([runs[config, seed] for seed in seeds], [name], count) for config in (reference, other)
                )
                row |= _difference(measure, ours, theirs)
            rows.append(row)
    return rows


def format_differences(rows: Sequence[dict[str, Any]]) -> str:
    """The differences for people, in percentage points with their intervals."""
    return "\n".join(
        f"{row['config'] + ' - ' + row['minus']:18}{row['scenario']:18}{row['seeds']:6}{_percent(row, '+')}"
        for row in rows
    )


def format_table(rows: Sequence[dict[str, Any]]) -> str:
    """The table for people: rates in percent with their intervals."""
    lines = [f"{'':12}{'scenario':18}{'seeds':>6}{'success':>23}{'without collision':>23}"]
    lines += [f"{row['config']:12}{row['scenario']:18}{row['seeds']:6}{_percent(row)}" for row in rows]
    return "\n".join(lines)


def _percent(row: dict[str, Any], sign: str = "") -> str:
    """Both measures of a row with their intervals, in percent."""
    cells = ""
    for measure in MEASURES:
        value, low, high = (100.0 * row[measure + end] for end in ("", "_low", "_high"))
        cells += f"{value:{sign}11.0f} [{low:{sign}4.0f}, {high:{sign}4.0f}]"
    return cells


def _configs(results: Sequence[dict[str, Any]]) -> list[str]:
    return list(dict.fromkeys(result["config"] for result in results))


def _rates(runs: Sequence[dict[str, Any]], scenarios: Sequence[str], count: str) -> np.ndarray:
    """Rates of runs in scenarios, shape (runs, scenarios)."""
    return np.array([[run[scenario][count] / run[scenario]["episodes"] for scenario in scenarios] for run in runs])


def _difference(measure: str, ours: np.ndarray, theirs: np.ndarray) -> dict[str, float]:
    low, high = bootstrap_interval(ours - theirs, lambda scores: float(np.mean(scores)))
    t_low, t_high = student_interval(ours - theirs)
    return {
        measure: float(np.mean(ours - theirs)),
        f"{measure}_low": low,
        f"{measure}_high": high,
        f"{measure}_t_low": t_low,
        f"{measure}_t_high": t_high,
        f"{measure}_improved": probability_of_improvement(ours, theirs),
    }


def _aggregate(measure: str, scores: np.ndarray) -> dict[str, float]:
    low, high = bootstrap_interval(scores)
    return {measure: interquartile_mean(scores), f"{measure}_low": low, f"{measure}_high": high}
