"""Summary of the distance experiment: rows per condition and estimator, ratios of the motions, the wanted table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.special import gammaincinv

from fixation_gym.evaluation.statistics import mean, median

Cell = dict[str, Any]
Row = dict[str, Any]

PAPER = {0.15: 0.005, 2.0: 0.130}
"""The paper's errors when fixating, m, by distance in m."""
WANTED = (
    (0.066, 0.02, 0.0003, 0.0007),
    (0.15, 0.02, 0.0005, 0.001),
    (0.15, 0.05, 0.0005, 0.001),
    (2.0, 0.05, 0.013, 0.020),
    (2.0, 0.02, 0.026, 0.040),
    (6.6, 0.05, 0.066, 0.200),
)
"""Distance, amplitude, goal and floor of the mean absolute error of "pose" when fixating, all in m."""
_BOUNDS = {"hard": "velocity_hard", "free": "velocity_free", "pose": "pose", "batch": "pose", "pose3": "pose"}


def summarise(cells: Sequence[Cell], noise: str) -> dict[str, Any]:
    """``rows``, ``ratios`` and ``wanted`` of the finished sequences; a value is None where nothing has it."""
    rows = summary_rows(cells, noise)
    return {"rows": rows, "ratios": motion_ratios(cells), "wanted": wanted_table(rows)}


def summary_rows(cells: Sequence[Cell], noise: str) -> list[Row]:
    """One row per distance, amplitude, motion, estimator, flow and calibration, in the order of the cells."""
    groups: dict[tuple[Any, ...], list[tuple[Cell, Row]]] = {}
    for cell in cells:
        for result in cell["results"]:
            key = (cell["distance_m"], cell["amplitude_m"], cell["motion"])
            key += (result["estimator"], result["flow"], result["hand_eye"])
            groups.setdefault(key, []).append((cell, result))
    return [_row(key, members, noise) for key, members in sorted(groups.items(), key=lambda item: _order(item[0]))]


def _order(key: tuple[Any, ...]) -> tuple[Any, ...]:
    return tuple("" if value is None else value for value in key)


def _row(key: tuple[Any, ...], members: Sequence[tuple[Cell, Row]], noise: str) -> Row:
    distance, amplitude, motion, estimator, flow, hand_eye = key
    cells, results = zip(*members, strict=True)
    runs = len(results)
    low, high = nees_bounds(runs)
    robot, lens = errors_of(results, "robot"), errors_of(results, "lens")
    settled = [result["settle_s"] for result in results]
    jumped = [result["jump_settle_s"] for result in results]
    return {
        "distance_m": distance,
        "motion": motion,
        "estimator": estimator,
        "flow": flow,
        "amplitude_m": amplitude,
        "noise": noise,
        "hand_eye_error": hand_eye,
        "seeds": runs,
        "print_widths_m": sorted({cell["print_width_m"] for cell in cells}),
        **robot,
        "nees_low": low,
        "nees_high": high,
        "nees_consistent": robot["nees"] is not None and low <= robot["nees"] <= high,
        "mae_lens_m": lens["mae_m"],
        "mae_median_lens_m": lens["mae_median_m"],
        "bias_lens_m": lens["bias_m"],
        "nees_lens": lens["nees"],
        "nis_per_dof": mean(result["nis"] for result in results),
        "bound_std_m": mean(cell["bounds"][_BOUNDS[estimator]] for cell in cells),
        "paper_m": PAPER.get(distance),
        "relative_error_at_1s": mean(result["relative_1s"] for result in results),
        "relative_error_at_1s_worst": _worst(result["relative_1s"] for result in results),
        "settle_s": median(settled),
        "not_settled": sum(value is None for value in settled),
        "jump_relative_error_at_1s": mean(result["jump_relative_1s"] for result in results),
        "jump_relative_error_at_1s_worst": _worst(result["jump_relative_1s"] for result in results),
        "jump_settle_s": median(jumped),
        "jump_not_settled": sum(value is None for value in jumped),
    }


def _worst(values: Any) -> float | None:
    known = list(values)
    return None if any(value is None for value in known) else max(known)


def errors_of(results: Sequence[Row], truth: str) -> Row:
    """Bias, standard deviation, mean absolute error and NEES over all samples of all runs, against one truth.

    ``mae_median_m`` is the median over the runs of their own mean absolute errors, which a diverged run does not move.
    Runs whose estimate was not finite make the values None.
    """
    sums = [result[truth] for result in results]
    names = ("error", "error2", "absolute", "nees", "std")
    totals = {name: _total([part[name] for part in sums]) for name in names}
    n = sum(part["samples"] for part in sums)
    own = [None if part["absolute"] is None else part["absolute"] / part["samples"] for part in sums]
    means = {name: None if total is None else total / n for name, total in totals.items()}
    bias, square = means["error"], means["error2"]
    spread = None if bias is None or square is None else float(np.sqrt(max(square - bias**2, 0.0)))
    return {
        "bias_m": bias,
        "std_m": spread,
        "mae_m": means["absolute"],
        "mae_median_m": median(own),
        "mae_sem_m": float(np.std([v for v in own if v is not None], ddof=1) / np.sqrt(len(own)))
        if n and len(own) > 1
        else None,
        "stated_std_m": means["std"],
        "nees": means["nees"],
        "samples": n,
    }


def _total(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return None if len(known) < len(values) else float(sum(known))


def nees_bounds(runs: int) -> tuple[float, float]:
    """95 % bounds of the mean NEES of that many runs, one degree of freedom each.

    Samples of one run share most of their error, so a run counts once, however many samples it has.
    """
    low, high = (
        2.0 * gammaincinv(0.5 * runs, [0.025, 0.975]) / runs
    )  # quantiles of chi-square; SciPy's stats load slowly
    return float(low), float(high)


def motion_ratios(cells: Sequence[Cell]) -> list[Row]:
    """Mean absolute error fixating over only translating, for the prints that both motions have seen.

    ``hard`` is compared with ``free``, as in the paper: the same filter with and without the fixation constraint.
    """
    ratios = []
    conditions = sorted({(cell["distance_m"], cell["amplitude_m"]) for cell in cells})
    pairs = [(name, None, name) for name in ("pose", "batch", "pose3")]
    flows = ("gradient", "warped", "dis")
    pairs += [(kind, flow, "free") for kind in ("hard", "free") for flow in flows]
    for distance, amplitude in conditions:
        here = [cell for cell in cells if (cell["distance_m"], cell["amplitude_m"]) == (distance, amplitude)]
        seen = [{cell["print_width_m"] for cell in here if cell["motion"] == m} for m in ("fixation", "translation")]
        matched = [cell for cell in here if cell["print_width_m"] in seen[0] & seen[1]]
        for fixating, flow, translating in pairs:
            values = {}
            for motion, name in (("fixation", fixating), ("translation", translating)):
                results = _results(matched, motion, name, flow)
                values[motion] = results and {truth: errors_of(results, truth) for truth in ("robot", "lens")}
            if not (values["fixation"] and values["translation"]):
                continue
            row: Row = {"distance_m": distance, "amplitude_m": amplitude, "flow": flow}
            row |= {"fixation_estimator": fixating, "translation_estimator": translating}
            for truth in ("robot", "lens"):
                above, below = (values[motion][truth]["mae_median_m"] for motion in ("fixation", "translation"))
                row[f"ratio_{truth}"] = above / below if above is not None and below else None
            ratios.append(row)
    return ratios


def _results(cells: Sequence[Cell], motion: str, estimator: str, flow: str | None) -> list[Row]:
    return [
        result
        for cell in cells
        if cell["motion"] == motion
        for result in cell["results"]
        if (result["estimator"], result["flow"], result["hand_eye"]) == (estimator, flow, True)
    ]


def wanted_table(rows: Sequence[Row]) -> list[Row]:
    """The project's goals beside what was measured, where it was."""
    table = []
    for distance, amplitude, goal, floor in WANTED:
        wanted = (distance, amplitude, "fixation", "pose", True)
        for row in rows:
            if tuple(row[name] for name in _CONDITION) == wanted and row["mae_m"] is not None:
                measured = {name: row[name] for name in ("mae_m", "mae_lens_m", "bound_std_m", "nees", "paper_m")}
                reached = "goal" if row["mae_m"] <= goal else "floor" if row["mae_m"] <= floor else "no"
                table.append(
                    {"distance_m": distance, "amplitude_m": amplitude, "goal_m": goal, "floor_m": floor, **measured}
                    | {"reached": reached}
                )
    return table


_CONDITION = ("distance_m", "amplitude_m", "motion", "estimator", "hand_eye_error")


def format_table(summary: Mapping[str, Any]) -> str:
    """The pose filter's rows as plain text, and the paper's filter beside it, in mm."""
    header = (
        "distance",
        "circle",
        "motion",
        "pose mm",
        "bound mm",
        "NEES",
        "1 s %",
        "jump 1 s %",
        "hard mm",
        "free mm",
    )
    lines = ["  ".join(f"{name:>10}" for name in header)]
    rows = {tuple(row[name] for name in (*_CONDITION, "flow")): row for row in summary["rows"]}
    for key, row in rows.items():
        if key[3:] != ("pose", True, None):
            continue
        others = [rows.get((*key[:3], kind, True, "warped")) for kind in ("hard", "free")]
        cells = [f"{key[0]:g} m", f"{100 * key[1]:g} cm", key[2]]
        cells += [_number(row["mae_m"], 1e3), _number(row["bound_std_m"], 1e3), _number(row["nees"], 1.0)]
        cells += [_number(row["relative_error_at_1s"], 100), _number(row["jump_relative_error_at_1s"], 100)]
        cells += [_number(other and other["mae_median_m"], 1e3) for other in others]
        lines.append("  ".join(f"{cell:>10}" for cell in cells))
    return "\n".join(lines)


def _number(value: float | None, scale: float) -> str:
    return "-" if value is None else f"{value * scale:.3g}"
