"""Times of every stage and of comparable environments, interleaved in one run, so that their ratios are fair.

A shared machine's speed drifts. Every round therefore times every case for a moment, and the ratios are of medians
over all rounds of the same run.
"""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from fixation_gym.doctor import installed_versions
from fixation_gym.evaluation.files import write_json
from fixation_gym.evaluation.storage import SUMMARY_FILE, folder_lock, make_folder
from fixation_gym.experiments.bench.cases import all_groups
from fixation_gym.experiments.bench.figure import draw_figure
from fixation_gym.experiments.bench.groups import Group, ProcessGroup
from fixation_gym.experiments.bench.processes import lift_reset_rows, memory_slope_kib, steps_per_second

FIGURE_FILE = "bench.png"
_ROUND_S = 0.12
"""Time given to one case in one round, s; slow cases are called at least once."""


@dataclass(frozen=True)
class Ratio:
    """One wanted ratio of two cases' medians."""

    name: str
    numerator: str
    denominator: str
    goal: float
    """At least this; at most, if ``upper``."""
    upper: bool = False


RATIOS = (
    Ratio("robosuite Lift step / ours, 128x128 image", "lift step 128x128", "step 128x128", 10.0),
    Ratio("Fetch step / ours, 128x128 image", "fetch step 128x128", "step 128x128", 3.0),
    Ratio("Fetch step / ours, no image", "fetch step", "step without image", 1.0),
    Ratio("robosuite Lift reset / ours, 128x128 image", "lift reset 128x128", "reset 128x128", 30.0),
    Ratio("robosuite Lift reset / ours, no image", "lift reset", "reset without image", 30.0),
    Ratio("optic flow / DIS ultrafast, 640x480", "flow 640x480", "DIS ultrafast 640x480", 1.3, upper=True),
)
"""What the project holds itself to; a ratio is left out where a peer is not installed."""
PERCEPTION_GOALS_MS = {"perception 640x480": 10.0, "perception 128x128": 1.0}
WORKERS_GOAL = 1.7


def bench(quick: bool, out: Path) -> dict[str, Any]:
    """Time everything and write ``summary.json`` and ``bench.png``.

    Args:
        quick: fewer rounds, no worker processes and no memory run.
        out: folder; made if needed, earlier results there are replaced.

    Returns:
        The content of ``summary.json``.

    Raises:
        UsageError: if the folder cannot be used.
    """
    make_folder(out)
    started = time.monotonic()
    with folder_lock(out):
        with ExitStack() as stack:
            groups = [stack.enter_context(closing(ProcessGroup(build))) for build in all_groups()]
            rows = measure(groups, rounds=5 if quick else 25)
        rows += lift_reset_rows()
        summary: dict[str, Any] = {"rows": rows, "ratios": ratios_of(rows)}
        if not quick:
            one, two = steps_per_second(1), steps_per_second(2)
            summary["workers"] = {"steps_per_s": [one, two], "ratio": two / one, "goal": WORKERS_GOAL}
            summary["memory"] = memory_slope_kib()
        summary |= {
            "perception_goals_ms": PERCEPTION_GOALS_MS,
            "versions": installed_versions(),
            "gl": os.environ.get("MUJOCO_GL"),
            "cpus": os.cpu_count(),
            "wall_s": time.monotonic() - started,
        }
        draw_figure(out / FIGURE_FILE, rows)
        write_json(out / SUMMARY_FILE, summary)
    return summary


def measure(groups: Sequence[Group], rounds: int) -> list[dict[str, Any]]:
    """Time all cases of all groups in turn, ``rounds`` times.

    Returns:
        A row per case with median and 95th percentile, ms.
    """
    cases = [(group, index, name) for group in groups for index, name in enumerate(group.names)]
    times: list[list[float]] = [[] for _ in cases]
    for _ in tqdm(range(rounds), unit="round", dynamic_ncols=True):
        for (group, index, _), own in zip(cases, times, strict=True):
            own += group.time(index, _ROUND_S)
    return [
        {
            "name": name,
            "ms_median": 1e3 * float(np.median(own)),
            "ms_p95": 1e3 * float(np.percentile(own, 95)),
            "calls": len(own),
        }
        for (_, _, name), own in zip(cases, times, strict=True)
    ]


def ratios_of(rows: Sequence[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Wanted ratios between rows, with goals and whether they are met."""
    medians = {row["name"]: row["ms_median"] for row in rows}
    found = {}
    for ratio in RATIOS:
        if ratio.numerator in medians and ratio.denominator in medians:
            value = medians[ratio.numerator] / medians[ratio.denominator]
            met = value <= ratio.goal if ratio.upper else value >= ratio.goal
            found[ratio.name] = {"value": value, "goal": ratio.goal, "at_most": ratio.upper, "met": met}
    return found


def format_table(summary: dict[str, Any]) -> str:
    """Times and ratios as text."""
    lines = [f"{'':44} {'median ms':>10} {'p95 ms':>10}"]
    lines += [f"{row['name']:44} {row['ms_median']:10.3f} {row['ms_p95']:10.3f}" for row in summary["rows"]]
    lines.append("")
    for name, ratio in summary["ratios"].items():
        sign = "<=" if ratio["at_most"] else ">="
        lines.append(f"{name:44} {ratio['value']:10.2f}   goal {sign} {ratio['goal']:g}")
    if "workers" in summary:
        workers = summary["workers"]
        lines.append(f"{'two worker processes / one':44} {workers['ratio']:10.2f}   goal >= {workers['goal']:g}")
        memory = summary["memory"]
        lines.append(f"{'memory growth, KiB per 1000 steps':44} {memory['kib_per_1000_steps']:10.2f}   goal flat")
    return "\n".join(lines)
