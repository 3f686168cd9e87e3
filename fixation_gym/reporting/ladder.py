"""``fixation-gym ladder``: from the paper's algorithm to the servo on the same episodes; what each step buys."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from fixation_gym.evaluation import workers
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.evaluation.files import write_csv, write_file
from fixation_gym.evaluation.rollout import EpisodeResult
from fixation_gym.evaluation.statistics import median, wilson_interval
from fixation_gym.evaluation.storage import check_no_folders, make_folder
from fixation_gym.reporting.ablation import ablate
from fixation_gym.reporting.comparison import ALL, compare_success
from fixation_gym.reporting.digest import PolicyRecord, scenario_names
from fixation_gym.reporting.figures import new_figure, png

TITLE = "From the paper's algorithm to the servo"
LADDER_FILE, FIGURE_FILE = "ladder.csv", "ladder.png"
Row = dict[str, Any]


def climb(
    config: EvaluationConfig,
    ladder: Mapping[str, str],
    beside: Sequence[str],
    out: Path,
    pictures: int,
    run: Callable[[workers.Cell], dict[str, Any]] = workers.run_cell,
) -> list[Row]:
    """Evaluate every rung and what stands beside, each in a folder of its own; write report, table and figure.

    The same call resumes a killed one.

    Args:
        config: what to evaluate; its policy is not used. Must have passed ``check`` with every policy.
        ladder: what each rung adds to the one below it, by policy; the lowest first.
        beside: policies that are no rungs.
        out: folder; made if needed.
        pictures: most failures that the report shows with pictures.
        run: runs one cell; tests replace it.

    Returns:
        Rows of ``ladder.csv``: of every policy in every scenario, and over all.

    Raises:
        UsageError: if a folder cannot be used.
    """
    make_folder(out)
    check_no_folders(out, (LADDER_FILE, FIGURE_FILE))
    names = [*ladder, *beside]
    records, _, _ = ablate(config, names, out, pictures, run=run, title=TITLE)
    rows = [row for index, name in enumerate(names) for row in _rows(records, index, ladder.get(name, ""), len(ladder))]
    write_csv(out / LADDER_FILE, rows)
    write_file(out / FIGURE_FILE, ladder_figure([row for row in rows if row["scenario"] == ALL]))
    return rows


def _rows(records: Sequence[PolicyRecord], index: int, adds: str, rungs: int) -> list[Row]:
    """Of one policy: a row per scenario, and one over all, which a single scenario has, too."""
    record, scenarios = records[index], scenario_names(records)
    steps = {}
    if 0 < index < rungs:
        found = compare_success(records[index - 1], record, scenarios)
        steps = {row.scenario: row for row in found if row.measure == "collision-free success"}
    if len(scenarios) == 1 and steps:
        steps[ALL] = steps[scenarios[0]]
    rows = []
    for scenario in (*scenarios, ALL):
        row: Row = {"policy": record.label, "adds": adds, "scenario": scenario}
        row |= _counts(record.of(None if scenario == ALL else scenario))
        step = steps.get(scenario)
        row["step"] = None if step is None else step.difference
        row["step_low"], row["step_high"] = (None, None) if step is None else step.interval
        row["p"] = None if step is None else step.p
        rows.append(row)
    return rows


def _counts(results: Sequence[EpisodeResult]) -> Row:
    n = len(results)
    free = sum(result.collision_free_success for result in results)
    low, high = wilson_interval(free, n)
    return {
        "episodes": n,
        "successes": sum(result.success for result in results),
        "collision_free": free,
        "rate": free / n if n else None,
        "rate_low": low,
        "rate_high": high,
        "median_time_s": median(result.time_s for result in results if result.success),
        "median_error_at_grasp_m": median(
            None if result.distance_error_at_grasp_m is None else abs(result.distance_error_at_grasp_m)
            for result in results
        ),
    }


def format_ladder(rows: Sequence[Row]) -> str:
    """The rows over all scenarios as plain text."""
    table = [("policy", "success", "collision-free [95 % CI]", "step, points", "time, s", "error, mm", "adds")]
    for row in rows:
        if row["scenario"] != ALL:
            continue
        rate = [100.0 * row[name] if row[name] is not None else 0.0 for name in ("rate", "rate_low", "rate_high")]
        step = "-"
        if row["step"] is not None:
            step = "{:+.0f} [{:+.0f}, {:+.0f}]".format(*(100.0 * row[n] for n in ("step", "step_low", "step_high")))
        table.append(
            (
                row["policy"],
                f"{row['successes']}/{row['episodes']}",
                "{:.0f}% [{:.0f}, {:.0f}]".format(*rate),
                step,
                _number(row["median_time_s"], 1.0),
                _number(row["median_error_at_grasp_m"], 1000.0),
                row["adds"],
            )
        )
    widths = [max(len(row[column]) for row in table) for column in range(len(table[0]))]
    return "\n".join("  ".join(map(str.ljust, row, widths)).rstrip() for row in table)


def _number(value: float | None, scale: float) -> str:
    return "-" if value is None else f"{scale * value:.1f}"


def ladder_figure(rows: Sequence[Row]) -> bytes:
    """Rates of all policies with Wilson intervals, the lowest rung at the bottom; hollow for success."""
    figure = new_figure(8.0, 0.8 + 0.36 * len(rows))
    axis = figure.subplots()
    for place, row in enumerate(rows):
        if not row["episodes"]:
            continue
        colour = "#0072B2" if row["adds"] else "0.5"
        axis.plot([100.0 * row["rate_low"], 100.0 * row["rate_high"]], [place, place], color=colour, linewidth=1.4)
        axis.plot(100.0 * row["successes"] / row["episodes"], place, "o", color=colour, markerfacecolor="white")
        axis.plot(100.0 * row["rate"], place, "o", color=colour)
    axis.set(xlim=(-3, 103), xlabel="collision-free success, %; hollow: success")
    axis.set_yticks(range(len(rows)), [row["policy"] for row in rows])
    axis.grid(True, axis="x", alpha=0.25)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)
    return png(figure)
