"""From episodes to the table of degradations. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from fixation_gym.evaluation.statistics import median, paired_difference_interval, wilson_interval
from fixation_gym.evaluation.text_table import aligned
from fixation_gym.experiments.robustness.degradations import CLEAN, MEANINGS
from fixation_gym.experiments.robustness.map_scores import map_scores

Episode = Mapping[str, Any]
"""One line of ``episodes.jsonl``: row, scenario, seed, and the fields of ``DegradedEpisode``."""
Row = dict[str, Any]

_NOTES = """
Maps of 32 x 32 cells while the servo gazes, against the truth. precision: cells in alarm in which anything is nearer;
(x clean): against the nominal noise on the same scenes. recall: of known cells that are in front. clear: of clear
cells, in alarm. free: success without collision; in brackets its difference from the nominal noise, paired, points."""


def summarise(episodes: Sequence[Episode]) -> list[Row]:
    """A row per degradation, in the order in which they come; JSON-able."""
    by_row: dict[str, list[Episode]] = {}
    for episode in episodes:
        by_row.setdefault(episode["row"], []).append(episode)
    clean = {_scene(episode): episode for episode in by_row.get(CLEAN, [])}
    return [_row(name, group, clean) for name, group in by_row.items()]


def _row(name: str, episodes: Sequence[Episode], clean: Mapping[tuple[str, int], Episode]) -> Row:
    scores = map_scores(_summed(episodes))
    reference = map_scores(_summed([clean[_scene(episode)] for episode in episodes if _scene(episode) in clean]))
    precision, known = scores["precision"], reference["precision"]
    n, free = len(episodes), [_is_free(episode) for episode in episodes]
    low, high = wilson_interval(sum(free), n)
    return {
        "row": name,
        "meaning": MEANINGS[name],
        "episodes": n,
        "maps": sum(episode["maps"] for episode in episodes),
        **scores,
        "precision_of_clean": None if precision is None or not known else precision / known,
        "distance_error": median(episode["distance_error"] for episode in episodes),
        "seen": median(episode["seen"] for episode in episodes),
        "success": sum(episode["success"] for episode in episodes),
        "collisions": sum(episode["collision"] for episode in episodes),
        "free": sum(free),
        "free_low": low,
        "free_high": high,
        **_difference(episodes, clean),
    }


def _scene(episode: Episode) -> tuple[str, int]:
    return episode["scenario"], episode["seed"]


def _is_free(episode: Episode) -> bool:
    return bool(episode["success"]) and not episode["collision"]


def _summed(episodes: Sequence[Episode]) -> Counter[str]:
    return sum((Counter(episode["counts"]) for episode in episodes), Counter())


def _difference(episodes: Sequence[Episode], clean: Mapping[tuple[str, int], Episode]) -> Row:
    """Success without collision minus that of the nominal noise on the same scenes, with its interval."""
    pairs = [(_is_free(e), _is_free(clean[_scene(e)])) for e in episodes if _scene(e) in clean]
    if not pairs:
        return {"difference": None, "difference_low": None, "difference_high": None}
    kinds = ((True, True), (True, False), (False, True), (False, False))
    both, first, second, neither = (pairs.count(kind) for kind in kinds)
    low, high = paired_difference_interval(both, first, second, neither)
    return {"difference": (first - second) / len(pairs), "difference_low": low, "difference_high": high}


def format_table(rows: Sequence[Row]) -> str:
    """The table as plain text."""
    header = ("degradation", "precision (x clean)", "recall", "clear", "known", "Z_f error", "seen", "free", "collided")
    return f"{aligned([header, *(_cells(row) for row in rows)])}\n{_NOTES}"


def _cells(row: Row) -> tuple[str, ...]:
    relative = "" if row["precision_of_clean"] is None else f" ({row['precision_of_clean']:.2f})"
    points = "" if row["difference"] is None else f" ({100.0 * row['difference']:+.0f})"
    return (
        row["meaning"],
        _number(row["precision"], "{:.3f}") + relative,
        _number(row["recall"], "{:.2f}"),
        _number(row["clear_alarmed"], "{:.2%}"),
        _number(row["known"], "{:.2f}"),
        _number(row["distance_error"], "{:.1%}"),
        _number(row["seen"], "{:.0%}"),
        f"{row['free']}/{row['episodes']}{points}",
        str(row["collisions"]),
    )


def _number(value: float | None, how: str) -> str:
    return "-" if value is None else how.format(value)
