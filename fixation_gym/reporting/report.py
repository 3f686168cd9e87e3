"""``fixation-gym report``: the page and its numbers."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.evaluate import seed_hash
from fixation_gym.evaluation.files import write_file, write_json
from fixation_gym.evaluation.folders import evaluation_folders, read_evaluation
from fixation_gym.evaluation.report import summarise
from fixation_gym.evaluation.storage import (
    EPISODES_FILE,
    RUN_FILE,
    SUMMARY_FILE,
    check_no_folders,
    folder_lock,
    make_folder,
)
from fixation_gym.reporting import sections
from fixation_gym.reporting.comparison import compare_success, compare_values
from fixation_gym.reporting.digest import PolicyRecord, digest, scenario_names
from fixation_gym.reporting.gallery import failed_episodes
from fixation_gym.reporting.markup import Html, element, joined, page

REPORT_FILE = "report.html"


def write_report(folders: Sequence[Path], out: Path, pictures: int, title: str) -> dict[str, Any]:
    """Write ``report.html`` and ``summary.json``; an earlier report is replaced once the new one is complete.

    Args:
        folders: of evaluations, or folders that hold such folders; the first policy is the reference of comparisons.
        out: folder of the page; made if needed.
        pictures: most failures to show with pictures.
        title: heading of the page.

    Returns:
        The content of ``summary.json``.

    Raises:
        UsageError: if a folder or a number cannot be used.
    """
    check_report(out, pictures)
    return write_page(digest([read_evaluation(folder) for folder in evaluation_folders(folders)]), out, pictures, title)


def write_page(records: Sequence[PolicyRecord], out: Path, pictures: int, title: str) -> dict[str, Any]:
    """As ``write_report``, of records; ``check_report`` has accepted the folder."""
    make_folder(out)
    with folder_lock(out):
        text = report_page(records, title, pictures)
        summary = report_summary(records)
        try:
            write_file(out / REPORT_FILE, text.encode())
            write_json(out / SUMMARY_FILE, summary)
        except OSError as error:
            raise UsageError(f"cannot write the report to {out} ({error}); choose another --out") from error
    return summary


def check_report(out: Path, pictures: int) -> None:
    """Check that a report with so many pictures may go to a folder.

    Raises:
        UsageError: for a wrong number, or if something in the folder may not be replaced.
    """
    if pictures < 0:
        raise UsageError(f"--gallery must be 0 or more, got {pictures}")
    check_no_folders(out, (REPORT_FILE, SUMMARY_FILE))
    for name in (RUN_FILE, EPISODES_FILE):
        if (out / name).exists():
            raise UsageError(f"{out} holds results of another command ({name}); choose another --out")


def report_page(records: Sequence[PolicyRecord], title: str, pictures: int) -> str:
    """The whole page as text."""
    scenarios = scenario_names(records)
    parts = [
        ("success", "Success", sections.success(records, scenarios)),
        ("paired", "On the same episodes", sections.paired(records, scenarios)),
        ("time", "Time and distance", sections.measurements(records, scenarios)),
        ("paths", "Paths", sections.paths(records, scenarios)),
        ("failures", "Failures", sections.failures(records, pictures)),
        ("source", "How it was made", sections.source(records)),
    ]
    shown = [(anchor, heading, content) for anchor, heading, content in parts if content]
    links = joined([Html(f'<a href="#{anchor}">{html.escape(heading)}</a>') for anchor, heading, _ in shown], " ")
    body = [element("h1", title), sections.introduction(records, scenarios), element("nav", links)]
    for anchor, heading, content in shown:
        body += [element("h2", heading, anchor=anchor), content]
    return page(title, body)


def report_summary(records: Sequence[PolicyRecord]) -> dict[str, Any]:
    """The page's numbers, JSON-able."""
    scenarios = scenario_names(records)
    reference, others = records[0], records[1:]
    return {
        "policies": {
            record.label: {
                "folder": str(record.evaluation.folder),
                "scenarios": summarise(record.of(None)),
                "seed_sha256": seed_hash(record.evaluation.keys),
            }
            for record in records
        },
        "reference": reference.label,
        "success_differences": [
            asdict(row) for other in others for row in compare_success(reference, other, scenarios)
        ],
        "value_differences": [asdict(row) for other in others for row in compare_values(reference, other)],
        "failures": [
            {
                "policy": records[item.policy].label,
                "scenario": item.episode.result.scenario,
                "seed": item.episode.result.seed,
                **asdict(item.failure),
            }
            for item in failed_episodes(records)
        ],
    }
