"""From episodes to rates by axis and severity, what each shift costs, and differences between learners. Pure."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from fixation_gym.evaluation.statistics import paired_difference_interval
from fixation_gym.experiments.transfer.shifts import APPEARANCE, AXES, NONE, Shift
from fixation_policies.rl.aggregates import bootstrap_interval
from fixation_policies.rl.comparison_tables import ALL, differences_of, table_of

Episode = Mapping[str, Any]
"""One line of ``episodes.jsonl``: name, training_seed, axis, severity, seed, success, collision."""
Row = dict[str, Any]
Runs = dict[tuple[str, int], dict[str, list[Episode]]]
"""Episodes by agent and by name of the shift, in the order of the seeds."""

_UNSHIFTED = Shift(NONE, NONE).name


def rows(episodes: Sequence[Episode], learners: Collection[str]) -> list[Row]:
    """One row per policy and shift, and one per policy and severity for the mean over the axes of appearance.

    Rates as in ``table_of``: over training seeds, or over episodes where there is one run. ``loss`` is success without
    collision without a shift minus that with it, with a 95 % interval: over training seeds by the bootstrap, or of one
    run over its episodes, paired by seed (Newcombe); None where there is none.
    """
    runs = _runs(episodes)
    table = [_named(row) for row in table_of(_results(runs, learners)) if row["scenario"] != ALL]
    return [{**row, **_loss(runs, row)} for row in table]


def differences(episodes: Sequence[Episode], learners: Collection[str], reference: str) -> list[Row]:
    """Rates of the learner ``reference`` minus those of every other one, as in ``differences_of``."""
    results = [run for run in _results(_runs(episodes), learners) if run["curve"]]
    if reference not in {run["config"] for run in results}:
        return []
    return [_named(row) for row in differences_of(results, reference)]


def _runs(episodes: Sequence[Episode]) -> Runs:
    runs: Runs = {}
    for episode in sorted(episodes, key=lambda episode: episode["seed"]):
        shifts = runs.setdefault((episode["name"], episode["training_seed"]), {})
        shifts.setdefault(Shift(episode["axis"], episode["severity"]).name, []).append(episode)
    order = list(dict.fromkeys((episode["name"], episode["training_seed"]) for episode in episodes))
    names = list(dict.fromkeys(Shift(episode["axis"], episode["severity"]).name for episode in episodes))
    return {key: {name: runs[key][name] for name in names} for key in order}


def _results(runs: Runs, learners: Collection[str]) -> list[Row]:
    """The runs as results of ``compare``: shifts take the place of scenarios, ``curve`` tells learners."""
    return [
        {
            "config": name,
            "seed": seed,
            "curve": [seed] if name in learners else [],
            "scenarios": {shift: _counts(episodes) for shift, episodes in _with_means(shifts).items()},
        }
        for (name, seed), shifts in runs.items()
    ]


def _with_means(shifts: Mapping[str, list[Episode]]) -> dict[str, list[Episode]]:
    """The same with all episodes of the axes of appearance together, by severity: each axis has as many."""
    means: dict[str, list[Episode]] = {}
    for episodes in shifts.values():
        axis, severity = episodes[0]["axis"], episodes[0]["severity"]
        if axis != NONE and AXES[axis].appearance:
            means.setdefault(Shift(APPEARANCE, severity).name, []).extend(episodes)
    return {**shifts, **means}


def _counts(episodes: Sequence[Episode]) -> Row:
    return {
        "episodes": len(episodes),
        "successes": sum(bool(episode["success"]) for episode in episodes),
        "collision_free_successes": sum(map(_is_free, episodes)),
    }


def _is_free(episode: Episode) -> bool:
    return bool(episode["success"]) and not episode["collision"]


def _named(row: Row) -> Row:
    """A row of ``compare`` with axis and severity instead of the scenario."""
    axis, severity = row["scenario"].rsplit(" ", 1)
    head = {"config": row["config"]} | ({"minus": row["minus"]} if "minus" in row else {})
    rest = {name: value for name, value in row.items() if name not in (*head, "scenario")}
    return {**head, "axis": axis, "severity": severity, **rest}


def _loss(runs: Runs, row: Row) -> Row:
    """What the shift of a row costs its policy."""
    own = [_with_means(shifts) for (name, _), shifts in runs.items() if name == row["config"]]
    name = Shift(row["axis"], row["severity"]).name
    if name == _UNSHIFTED:
        return {"loss": None, "loss_low": None, "loss_high": None}
    plain, shifted = ([_rate(shifts[key]) for shifts in own] for key in (_UNSHIFTED, name))
    losses = np.subtract(plain, shifted)
    low, high = _loss_interval(own, name, losses)
    return {"loss": float(np.mean(losses)), "loss_low": low, "loss_high": high}


def _loss_interval(
    own: Sequence[Mapping[str, list[Episode]]], name: str, losses: np.ndarray
) -> tuple[float | None, float | None]:
    if len(own) > 1:
        return bootstrap_interval(losses[:, None], lambda scores: float(np.mean(scores)))
    if name.startswith(APPEARANCE):  # the unshifted episodes count several times: no pairs
        return None, None
    pairs = [(_is_free(a), _is_free(b)) for a, b in zip(own[0][_UNSHIFTED], own[0][name], strict=True)]
    both, first, second, neither = (
        pairs.count(kind) for kind in ((True, True), (True, False), (False, True), (False, False))
    )
    return paired_difference_interval(both, first, second, neither)


def _rate(episodes: Sequence[Episode]) -> float:
    return sum(map(_is_free, episodes)) / len(episodes)


def format_table(table: Sequence[Row]) -> str:
    """Success without collision in percent: a line per axis and severity, a column per policy; losses in brackets."""
    names = list(dict.fromkeys(row["config"] for row in table))
    seeds = {row["config"]: row["seeds"] for row in table}
    cells = {(row["axis"], row["severity"], row["config"]): row for row in table}
    lines = [f"{'axis':22}{'severity':10}" + "".join(f"{f'{name} ({seeds[name]})':>18}" for name in names)]
    for axis, severity in dict.fromkeys((row["axis"], row["severity"]) for row in table):
        shown = (_shown(cells[axis, severity, name]) for name in names)
        lines.append(f"{axis:22}{severity:10}" + "".join(f"{text:>18}" for text in shown))
    return "\n".join([*lines, "", "success without collision, %; in brackets the loss against no shift, points"])


def _shown(row: Row) -> str:
    loss = "" if row["loss"] is None else f" ({100.0 * row['loss']:+.0f})"
    return f"{100.0 * row['collision_free']:.0f}{loss}"
