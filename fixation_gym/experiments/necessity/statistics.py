"""From episodes to the best blind way: chosen on one half of the seeds, judged on the other. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fixation_gym.evaluation.statistics import wilson_interval

Episode = Mapping[str, Any]
"""One line of ``episodes.jsonl``: scenario, member, seed, success (without collision), collision, time_s, phase."""
Row = dict[str, Any]
AGENT = "agent"
"""Name of the column of the agent, and how its member's name begins."""
ALL = "all"
"""Name of the row of the best way for all scenarios at once. It has no intervals: scenes of the same seed have much in
common, such as the free way, whatever the scenario."""
COMPARED = ("blind", "blind:slow", AGENT, "oracle")
"""Columns beside the best way, as far as there are such episodes."""


_NOTES = """
Success without collision. The best way is chosen on the even seeds and judged on the odd ones; the others are judged on
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


def summarise(episodes: Iterable[Episode], ways: Sequence[str]) -> dict[str, list[Row]]:
    """Rows of every member, and the table of the best ways.

    Args:
        episodes: of all members; of every scenario and member the same seeds.
        ways: names of the members to choose from; of equally good ones the first is chosen.

    Returns:
        ``rows`` and ``table``, JSON-able.
    """
    tallies = tally(episodes)
    scenarios = list(dict.fromkeys(scenario for scenario, _ in tallies))
    members = list(dict.fromkeys(member for _, member in tallies))
    rows = [_row(scenario, member, value) for (scenario, member), value in tallies.items()]
    by_scenario = {
        scenario: {member: tallies[scenario, member] for member in members if (scenario, member) in tallies}
        for scenario in scenarios
    }
    if len(scenarios) > 1:
        by_scenario[ALL] = {
            member: sum((tallies[key] for key in tallies if key[1] == member), start=Tally()) for member in members
        }
    table = [_table_row(scenario, values, ways) for scenario, values in by_scenario.items()]
    return {"rows": rows, "table": table}


def best_way(tallies: Mapping[str, Tally], ways: Sequence[str]) -> str:
    """The way with the highest rate on the half on which ways are chosen; the first of equals."""
    return max(ways, key=lambda way: tallies[way].chosen_on.rate or 0.0)


def _row(scenario: str, member: str, value: Tally) -> Row:
    return {
        "scenario": scenario,
        "member": member,
        "k": value.whole.k,
        "n": value.whole.n,
        "chosen_on_k": value.chosen_on.k,
        "judged_on_k": value.judged_on.k,
        "collisions": value.collisions,
    }


def _table_row(scenario: str, tallies: Mapping[str, Tally], ways: Sequence[str]) -> Row:
    best = best_way(tallies, ways)
    highest = max(ways, key=lambda way: tallies[way].whole.rate or 0.0)
    row: Row = {"scenario": scenario, "best": best}
    row |= tallies[best].judged_on.columns("best", scenario != ALL)
    row |= {"chosen_on_k": tallies[best].chosen_on.k, "chosen_on_n": tallies[best].chosen_on.n}
    # Chosen and judged on the same seeds, so too high.
    row |= {"hindsight": highest, "hindsight_k": tallies[highest].whole.k, "hindsight_n": tallies[highest].whole.n}
    for name in COMPARED:
        for member in tallies:
            if member == name or (name == AGENT and member.startswith(f"{AGENT}:")):
                row |= tallies[member].whole.columns(name, scenario != ALL)
    return row


def format_table(table: Sequence[Row]) -> str:
    """The table as plain text."""
    names = [name for name in COMPARED if any(f"{name}_n" in row for row in table)]
    header = ("scenario", "best blind way", "chosen on", "judged on [95 % CI]", "best of all", *names)
    lines: list[tuple[str, ...]] = [header]
    for row in table:
        cells = [row["scenario"], row["best"], f"{row['chosen_on_k']}/{row['chosen_on_n']}", _rate(row, "best")]
        cells.append(f"{row['hindsight_k']}/{row['hindsight_n']}")
        lines.append((*cells, *(_rate(row, name) for name in names)))
    widths = [max(len(line[column]) for line in lines) for column in range(len(header))]
    text = ["  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip() for line in lines]
    return "\n".join([text[0], "-" * max(map(len, text)), *text[1:], _NOTES])


def _rate(row: Row, name: str) -> str:
    if not row.get(f"{name}_n"):
        return "-"
    text = f"{row[f'{name}_k']}/{row[f'{name}_n']}  {100.0 * row[f'{name}_rate']:.0f}%"
    if row[f"{name}_low"] is None:
        return text
    return f"{text} [{100.0 * row[f'{name}_low']:.0f}, {100.0 * row[f'{name}_high']:.0f}]"
