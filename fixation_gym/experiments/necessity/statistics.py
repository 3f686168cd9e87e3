"""From episodes to the best blind way: chosen on one half of the seeds, judged on the other. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fixation_gym.evaluation.statistics import paired_difference_interval, wilson_interval
from fixation_gym.evaluation.text_table import aligned

Episode = Mapping[str, Any]
"""One line of ``episodes.jsonl``: scenario, member, seed, success (without collision), collision, time_s, phase."""
Row = dict[str, Any]
AGENT = "agent"
"""Name of the column of the agent, and how its member's name begins."""
ALL = "all"
"""Name of the row of the best way for all scenarios at once. It has no intervals: scenes of the same seed have much in
common, such as the free way, whatever the scenario."""
_OF_WAYS = ("best", "chosen_on")
"""Beginnings of the columns that are about ways."""
EVALUATED = "evaluated"
"""Beginning of the columns of an evaluation that is paired with the best way."""

_NOTES = """
Success without collision. The best way is chosen on the even seeds, and all are judged on the odd ones; the oracle on
all. The ways know where the target truly is, so they are an upper bound of what fixed blind ways can do."""


@dataclass(frozen=True)
class Counts:
    """Successes and episodes."""

    k: int = 0
    n: int = 0

    def __add__(self, other: Counts) -> Counts:
        return Counts(self.k + other.k, self.n + other.n)

    @property
    def rate(self) -> float | None:
        """Share of successes; None without episodes."""
        return self.k / self.n if self.n else None

    def columns(self, name: str, independent: bool = True) -> Row:
        """Counts, rate and, if the episodes are independent, its 95 % interval as columns of a table."""
        low, high = wilson_interval(self.k, self.n) if independent else (None, None)
        return {
            f"{name}_k": self.k,
            f"{name}_n": self.n,
            f"{name}_rate": self.rate,
            f"{name}_low": low,
            f"{name}_high": high,
        }


@dataclass(frozen=True)
class Tally:
    """What one member did in one scenario."""

    chosen_on: Counts = Counts()
    """Of the even seeds, on which ways are chosen."""
    judged_on: Counts = Counts()
    """Of the odd seeds."""
    collisions: int = 0

    def __add__(self, other: Tally) -> Tally:
        return Tally(
            self.chosen_on + other.chosen_on, self.judged_on + other.judged_on, self.collisions + other.collisions
        )

    @property
    def whole(self) -> Counts:
        """Of all seeds."""
        return self.chosen_on + self.judged_on


def tally(episodes: Iterable[Episode]) -> dict[tuple[str, str], Tally]:
    """Counts by scenario and member, in the order in which they first occur."""
    tallies: dict[tuple[str, str], Tally] = {}
    for episode in episodes:
        key, counts = (episode["scenario"], episode["member"]), Counts(int(episode["success"]), 1)
        halves = (counts, Counts()) if episode["seed"] % 2 == 0 else (Counts(), counts)
        tallies[key] = tallies.get(key, Tally()) + Tally(*halves, int(episode["collision"]))
    return tallies


def chosen_ways(episodes: Iterable[Episode], ways: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """By scenario the ways to be judged in it: its best one, and the best one for all scenarios at once.

    Args:
        episodes: on even seeds, of all ways in all scenarios.
        ways: names of the ways; of equally good ones the first is chosen.
    """
    by_scenario = _by_scenario(tally(episodes))
    everywhere = best_way(by_scenario[ALL] if ALL in by_scenario else next(iter(by_scenario.values())), ways)
    return {
        scenario: tuple(dict.fromkeys((best_way(tallies, ways), everywhere)))
        for scenario, tallies in by_scenario.items()
        if scenario != ALL
    }


def summarise(
    episodes: Sequence[Episode], ways: Sequence[str], evaluated: Mapping[tuple[str, int], bool] | None = None
) -> dict[str, list[Row]]:
    """Rows of every member, and the table of the best ways.

    Args:
        episodes: of all members.
        ways: names of the members to choose from; of equally good ones the first is chosen.
        evaluated: success without collision of another policy by (scenario, seed), to be paired with the best way.

    Returns:
        ``rows`` and ``table``, JSON-able.
    """
    tallies = tally(episodes)
    rows = [_row(scenario, member, value) for (scenario, member), value in tallies.items()]
    table = []
    for scenario, values in _by_scenario(tallies).items():
        row = _table_row(scenario, values, ways)
        if evaluated is not None and scenario != ALL:
            row |= _paired(scenario, row["best"], episodes, evaluated)
        table.append(row)
    return {"rows": rows, "table": table}


def _by_scenario(tallies: Mapping[tuple[str, str], Tally]) -> dict[str, dict[str, Tally]]:
    """Tallies of the members by scenario; with several scenarios also of all together."""
    result: dict[str, dict[str, Tally]] = {}
    for (scenario, member), value in tallies.items():
        result.setdefault(scenario, {})[member] = value
    if len(result) > 1:
        members = dict.fromkeys(member for _, member in tallies)
        result[ALL] = {member: sum((v for (_, m), v in tallies.items() if m == member), Tally()) for member in members}
    return result


def best_way(tallies: Mapping[str, Tally], ways: Sequence[str]) -> str:
    """The way with the highest rate on the half on which ways are chosen; the first of equals."""
    return max(ways, key=lambda way: tallies[way].chosen_on.rate or 0.0)


def _paired(scenario: str, best: str, episodes: Sequence[Episode], evaluated: Mapping[tuple[str, int], bool]) -> Row:
    """Columns of another policy on the seeds on which the best way was judged, and of the difference in points."""
    pairs = [
        (evaluated[scenario, episode["seed"]], bool(episode["success"]))
        for episode in episodes
        if episode["scenario"] == scenario and episode["member"] == best and episode["seed"] % 2
        if (scenario, episode["seed"]) in evaluated
    ]
    row = Counts(sum(first for first, _ in pairs), len(pairs)).columns(EVALUATED)
    if pairs:
        counts = [pairs.count(pair) for pair in ((True, True), (True, False), (False, True), (False, False))]
        low, high = paired_difference_interval(*counts)
        row |= {
            "difference": (counts[1] - counts[2]) / len(pairs),
            "difference_low": low,
            "difference_high": high,
        }
    return row


def _row(scenario: str, member: str, value: Tally) -> Row:
    return {
        "scenario": scenario,
        "member": member,
        "k": value.whole.k,
        "n": value.whole.n,
        "chosen_on_k": value.chosen_on.k,
        "chosen_on_n": value.chosen_on.n,
        "judged_on_k": value.judged_on.k,
        "judged_on_n": value.judged_on.n,
        "collisions": value.collisions,
    }


def _table_row(scenario: str, tallies: Mapping[str, Tally], ways: Sequence[str]) -> Row:
    best = best_way(tallies, ways)
    row: Row = {"scenario": scenario, "best": best}
    row |= tallies[best].judged_on.columns("best", scenario != ALL)
    row |= {"chosen_on_k": tallies[best].chosen_on.k, "chosen_on_n": tallies[best].chosen_on.n}
    row["mean_rate"] = sum((tallies[way].chosen_on for way in ways), Counts()).rate
    for member in (name for name in tallies if name not in ways):
        name = AGENT if member.startswith(f"{AGENT}:") else member
        row |= tallies[member].whole.columns(name, scenario != ALL)
    return row


def format_table(table: Sequence[Row]) -> str:
    """The table as plain text."""
    columns = dict.fromkeys(column for row in table for column in row if column.endswith("_n"))
    names = [name for name in (column.removesuffix("_n") for column in columns) if name not in _OF_WAYS]
    paired = any("difference" in row for row in table)
    header = ("scenario", "best blind way", "mean of all", "chosen on", "judged on [95 % CI]", *names)
    lines: list[tuple[str, ...]] = [(*header, "minus best way, points") if paired else header]
    for row in table:
        cells = [row["scenario"], row["best"], f"{100.0 * row['mean_rate']:.0f}%"]
        cells += [f"{row['chosen_on_k']}/{row['chosen_on_n']}", _rate(row, "best"), *(_rate(row, n) for n in names)]
        lines.append((*cells, _difference(row)) if paired else tuple(cells))
    return f"{aligned(lines)}\n{_NOTES}"


def _difference(row: Row) -> str:
    if "difference" not in row:
        return "-"
    return "{:+.0f} [{:+.0f}, {:+.0f}]".format(
        *(100.0 * row[name] for name in ("difference", "difference_low", "difference_high"))
    )


def _rate(row: Row, name: str) -> str:
    if not row.get(f"{name}_n"):
        return "-"
    text = f"{row[f'{name}_k']}/{row[f'{name}_n']}  {100.0 * row[f'{name}_rate']:.0f}%"
    if row[f"{name}_low"] is None:
        return text
    return f"{text} [{100.0 * row[f'{name}_low']:.0f}, {100.0 * row[f'{name}_high']:.0f}]"
