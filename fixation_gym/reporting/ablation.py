"""``fixation-gym ablate``: the servo and its variants on the same episodes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from fixation_gym.evaluation import workers
from fixation_gym.evaluation.clips import film_failures
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.evaluation.evaluate import evaluate
from fixation_gym.evaluation.folders import read_evaluation
from fixation_gym.evaluation.rollout import EpisodeResult
from fixation_gym.evaluation.storage import make_folder
from fixation_gym.reporting.digest import PolicyRecord, digest
from fixation_gym.reporting.report import check_report, write_page

TITLE = "Ablations of the servo"


def ablate(
    config: EvaluationConfig,
    variants: Sequence[str],
    out: Path,
    pictures: int,
    film: bool = False,
    run: Callable[[workers.Cell], dict[str, Any]] = workers.run_cell,
    title: str = TITLE,
) -> tuple[list[PolicyRecord], dict[str, Any], list[EpisodeResult]]:
    """Evaluate every variant in a folder of its own, then write their report. The same call resumes a killed one.

    Of folders that hold more episodes, those that ``config`` asks for count.

    Args:
        config: what to evaluate; its policy is not used. Must have passed ``check`` with every variant.
        variants: names of policies; the first is the reference of comparisons.
        out: folder; made if needed.
        pictures: most failures to show with pictures.
        film: whether to make pictures of failed episodes.
        run: runs one cell; tests replace it.
        title: heading of the report.

    Returns:
        The variants' episodes, the summary of their report, as in ``summary.json``, and what could not be filmed.

    Raises:
        UsageError: if a folder cannot be used.
    """
    make_folder(out)
    check_report(out, pictures)
    folders = [out / name.replace(":", "-") for name in variants]
    for name, folder in zip(variants, folders, strict=True):
        evaluate(replace(config, policy=name), folder, run)
    keys, different = config.episode_keys(), []
    for folder in folders if film else []:
        different += film_failures(folder, keys, config.workers, config.backend)
    records = digest([read_evaluation(folder, keys) for folder in folders])
    return records, write_page(records, out, pictures, title), different


def format_ablations(summary: Mapping[str, Any], summaries: Mapping[str, str]) -> str:
    """A line per variant: collision-free successes, difference to the reference in percent points, what it leaves out.

    Args:
        summary: what ``ablate`` returned.
        summaries: what every variant leaves out.
    """
    differences = {
        row["other"]: row
        for row in summary["success_differences"]
        if row["measure"] == "collision-free success"  # the last row of a policy is over all scenarios
    }
    rows = [("variant", "collision-free", "difference [95 % CI]", "p", "leaves out")]
    for name, values in summary["policies"].items():
        scenarios = values["scenarios"].values()
        wins = sum(scenario["collision_free_successes"] for scenario in scenarios)
        episodes = sum(scenario["episodes"] for scenario in scenarios)
        rows.append((name, f"{wins}/{episodes}", *_difference(differences.get(name)), summaries.get(name, "")))
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return "\n".join("  ".join(map(str.ljust, row, widths)).rstrip() for row in rows)


def _difference(row: Mapping[str, Any] | None) -> tuple[str, str]:
    if row is None:
        return "-", "-"
    low, high = (100.0 * bound for bound in row["interval"])
    return f"{100 * row['difference']:+.0f} [{low:+.0f}, {high:+.0f}]", f"{row['p']:.2g}"
