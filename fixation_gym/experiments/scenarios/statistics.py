"""From the runs of the scenarios experiment to rows with intervals, table and CSV."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from fixation_gym.evaluation.statistics import mean, median, wilson_interval
from fixation_gym.experiments.scenarios.rules import RULES, SURFACES
from fixation_gym.experiments.scenarios.scenes import CLEAR, MATERIAL_SCENES, SCENES, VARIANTS

Run = Mapping[str, Any]
MEASURES = {
    "sign_accuracy": ("right", "asked"),
    "obstacle_sign_accuracy": ("on_obstacle_right", "on_obstacle"),
    "table_sign_accuracy": ("on_table_right", "on_table"),
    "room_sign_accuracy": ("on_room_right", "on_room"),
    "inner_sign_accuracy": ("inner_right", "inner"),
    "surface_sign_accuracy": ("surface_right", "surface"),
    "inner_obstacle_sign_accuracy": ("inner_obstacle_right", "inner_obstacle"),
    "front_recall": ("front_called", "front"),
    "front_precision": ("front_called", "called"),
    "image_behind": ("image_behind", "image"),
    "inner_image_behind": ("inner_image_behind", "inner_image"),
    "obstacle_share": ("on_obstacle", "asked"),
    "evidence_obstacle_sign_accuracy": ("evidence_obstacle_right", "evidence_obstacle"),
    "evidence_surface_sign_accuracy": ("evidence_surface_right", "evidence_surface"),
    "obstacle_evidence": ("evidence_obstacle", "obstacle_pixels"),
    "obstacle_answering": ("on_obstacle", "obstacle_pixels"),
    "front_evidence_found": ("evidence_front_obstacle_called", "front_obstacle"),
    "front_found": ("front_obstacle_called", "front_obstacle"),
    "thin_evidence_found": ("evidence_thin_called", "thin"),
    "thin_found": ("thin_called", "thin"),
    **{f"{name}_called_front": (f"front_{name}_called", f"front_{name}") for name in SURFACES},
}
"""Ratios of pixel counts summed over the instances; only pixels that answer count. ``surface``: of obstacles, but for
images in mirrors. ``evidence``: at all pixels with evidence. ``obstacle_evidence``, ``obstacle_answering``: share of
all pixels of obstacles that have evidence or answer. ``found``: share of all pixels of obstacles in front, or of thin
parts of them, that are called in front. ``called_front``: of the pixels with evidence of a surface in front, whatever
is seen in it."""
FIRST_CALL_S = 0.5
_RESAMPLES = 1000
ALL = "all"

OBJECT_GROUPS: dict[str, Callable[[Mapping[str, Any]], bool]] = {
    "all": lambda o: True,
    "all in front": lambda o: o["side"] == "front",
    "all behind": lambda o: o["side"] == "behind",
    "opaque, in front": lambda o: o["kind"] == "opaque" and o["side"] == "front" and not o["moves"],
    "opaque, behind": lambda o: o["kind"] == "opaque" and o["side"] == "behind" and not o["moves"],
    "see-through, alpha >= 0.7 or with rim or label": lambda o: (
        o["kind"] == "translucent" and (o["alpha"] >= 0.7 or o["trimmed"])
    ),
    "see-through, 0.5 <= alpha < 0.7, bare": lambda o: (
        o["kind"] == "translucent" and not o["trimmed"] and 0.5 <= o["alpha"] < 0.7
    ),
    "see-through, alpha < 0.5, bare": lambda o: o["kind"] == "translucent" and not o["trimmed"] and o["alpha"] < 0.5,
    "real glass": lambda o: o["kind"] == "glass" and o["side"] == "front",
    "curved mirror": lambda o: o["kind"] == "chrome" and o["side"] == "front",
    "framed mirror": lambda o: o["kind"] == "mirror",
    "moves by itself, in front": lambda o: o["moves"] and o["side"] == "front",
}
"""Kinds of obstacles that are voted on."""


def summarise(runs: Sequence[Run]) -> dict[str, Any]:
    """Rows per scene and over all, votes per kind of obstacle, and false alarms, JSON-able."""
    scored = [run for run in runs if run["scene"] != CLEAR]
    scenes = {}
    variants = [variant for variant in VARIANTS if any(run["variant"] == variant for run in scored)]
    for scene in (*SCENES, *MATERIAL_SCENES):
        here = [run for run in scored if run["scene"] == scene]
        if not here:
            continue
        scenes[scene] = [
            _row(variant, [run for run in here if variant in (run["variant"], ALL)], rule)
            for variant in (*variants, ALL)
            for rule in RULES
        ]
    scenes[ALL] = [_row(ALL, scored, rule) for rule in RULES]
    objects = [item for run in scored for item in run["objects"]]
    groups = [
        _group(name, [item for item in objects if belongs(item)], rule)
        for name, belongs in OBJECT_GROUPS.items()
        for rule in RULES
    ]
    return {"scenes": scenes, "objects": groups, "clear": _alarms([run for run in runs if run["scene"] == CLEAR])}


def _row(variant: str, runs: Sequence[Run], rule: str) -> dict[str, Any]:
    row: dict[str, Any] = {"variant": variant, "rule": rule, "instances": len(runs)}
    for name, (part, whole) in MEASURES.items():
        pairs = [(run["rules"][rule].get(part, 0), run["rules"][rule].get(whole, 0)) for run in runs]
        row[name], row[f"{name}_ci95"] = bootstrap_ratio(pairs)
    objects = [item for run in runs for item in run["objects"]]
    right = [item["final"][rule] == item["side"] for item in objects]
    row["objects"] = len(objects)
    row["object_vote_accuracy"] = mean(map(float, right))
    row["object_vote_ci95"] = list(wilson_interval(sum(right), len(right)))
    row["unknown_fraction"], row["unknown_ci95"] = bootstrap_ratio([(run["unknown"], run["pixels"]) for run in runs])
    row["falsely_moving"], _ = bootstrap_ratio([(run["falsely_moving"], run["pixels"]) for run in runs])
    row["distance_error_median"] = median(run["distance_error"] for run in runs)
    known = [run["distance_error"] for run in runs if run["distance_error"] is not None]
    row["distance_error_worst"] = max(known, default=None)
    return row


def _group(name: str, objects: Sequence[Mapping[str, Any]], rule: str) -> dict[str, Any]:
    """Votes on one kind of obstacle."""
    n = len(objects)
    final = [item["final"][rule] for item in objects]
    right = sum(item["final"][rule] == item["side"] for item in objects)
    frames = [_share(item["verdicts"][rule], item["side"]) for item in objects]
    in_front = [item for item in objects if item["side"] == "front"]
    calls = [item["first_call_s"][rule] for item in in_front]
    in_time = sum(call is not None and call <= FIRST_CALL_S for call in calls)
    return {
        "group": name,
        "rule": rule,
        "objects": n,
        **{f"called_{side}": final.count(side) for side in ("front", "behind", "unknown")},
        "vote_accuracy": right / n if n else None,
        "vote_ci95": list(wilson_interval(right, n)),
        "frame_vote_accuracy": mean(frames),
        "first_call_median_s": median(calls) if any(call is not None for call in calls) else None,
        "first_call_in_time": in_time / len(calls) if calls else None,
        "first_call_in_time_ci95": list(wilson_interval(in_time, len(calls))),
    }


def _share(verdicts: Mapping[str, int], side: str) -> float:
    return verdicts.get(side, 0) / max(1, sum(verdicts.values()))


def _alarms(runs: Sequence[Run]) -> dict[str, Any]:
    minutes = sum(run["seconds"] for run in runs) / 60.0
    totals = {name: sum(run[name] for run in runs) for name in ("map_alarms", "path_alarms")}
    front, known = (sum(run[name] for run in runs) for name in ("front_cells", "known_cells"))
    return {
        "minutes": minutes,
        **totals,
        "map_alarms_per_minute": totals["map_alarms"] / minutes if minutes else None,
        "path_alarms_per_minute": totals["path_alarms"] / minutes if minutes else None,
        "front_share_of_known_cells": front / known if known else None,
    }


def bootstrap_ratio(pairs: Sequence[tuple[float, float]]) -> tuple[float | None, list[float] | None]:
    """Ratio of sums with its 95 % interval, drawing whole instances: their pixels are not independent.

    Args:
        pairs: (part, whole) of every instance.
    """
    table = np.array([pair for pair in pairs if pair[1] > 0], dtype=np.float64).reshape(-1, 2)
    if not len(table):
        return None, None
    rng = np.random.default_rng(0)
    sums = table[rng.integers(0, len(table), (_RESAMPLES, len(table)))].sum(axis=1)
    low, high = np.quantile(sums[:, 0] / sums[:, 1], (0.025, 0.975))
    part, whole = table.sum(axis=0)
    return float(part / whole), [float(low), float(high)]


def rows_of(scenes: Mapping[str, Sequence[Mapping[str, Any]]]) -> list[dict[str, Any]]:
    """All rows as one table; an interval becomes two columns."""
    return [{"scene": scene, **_flat(row)} for scene, rows in scenes.items() for row in rows]


def _flat(row: Mapping[str, Any]) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in row.items():
        if name.endswith("_ci95"):
            low, high = value or (None, None)
            flat |= {f"{name}_low": low, f"{name}_high": high}
        else:
            flat[name] = value
    return flat


_COLUMNS = {
    "sign": "sign_accuracy",
    **{place: f"{place}_sign_accuracy" for place in ("obstacle", "table", "room")},
    "surface": "surface_sign_accuracy",
    "inner": "inner_sign_accuracy",
    "inner obs": "inner_obstacle_sign_accuracy",
    "evidence": "evidence_obstacle_sign_accuracy",
    "answering": "obstacle_answering",
    "recall": "front_recall",
    "precision": "front_precision",
    "images": "inner_image_behind",
    "votes": "object_vote_accuracy",
}


def format_table(summary: Mapping[str, Any]) -> str:
    """Plain-text tables: a line per scene, variant and rule; votes on obstacles by each rule; false alarms."""
    header = f"{'scene':12}{'variant':10}{'rule':8}" + "".join(f"{name:>10}" for name in _COLUMNS) + f"{'unknown':>10}"
    lines = [header, "-" * len(header)]
    for scene, rows in summary["scenes"].items():
        for row in rows:
            cells = "".join(f"{_number(row[name]):>10}" for name in (*_COLUMNS.values(), "unknown_fraction"))
            lines.append(f"{scene:12}{row['variant']:10}{row['rule']:8}{cells}")
    lines += ["", f"{'obstacles':48}{'rule':8}  voted right"]
    for row in summary["objects"]:
        if row["objects"]:
            low, high = row["vote_ci95"]
            called = ", ".join(f"{row[f'called_{side}']} {side}" for side in ("front", "behind", "unknown"))
            first = f"in front within {FIRST_CALL_S} s: {_number(row['first_call_in_time'], 2)}"
            votes = f"{row['vote_accuracy']:.2f} [{low:.2f}, {high:.2f}]"
            lines.append(f"{row['group']:48}{row['rule']:8}  {votes}  {called};  {first}")
    clear = summary["clear"]
    if clear["minutes"]:
        lines.append(
            f"\nclear: {clear['minutes']:.1f} min, {clear['map_alarms']} false alarms in the map, "
            f"{clear['path_alarms']} that change the path"
        )
    return "\n".join(lines)


def _number(value: float | None, digits: int = 3) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
