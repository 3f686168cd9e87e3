"""The page and its numbers."""

from __future__ import annotations

import json
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.clips import clip_file
from fixation_gym.evaluation.video import jpeg
from fixation_gym.reporting.report import write_report


class Reader(HTMLParser):
    """Text of all table rows, sources of images, and tags that are open."""

    VOID = ("meta", "img")

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.sources: list[str] = []
        self.rows: list[list[str]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.sources += [value or "" for name, value in attrs if name == "src"]
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "td" in self.open or "th" in self.open:
            self.rows[-1][-1] += data


def read(page: Path) -> tuple[str, Reader]:
    text, reader = page.read_text(), Reader()
    reader.feed(text)
    assert reader.open == []
    return text, reader


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory, servo_folder: Path, blind_folder: Path) -> Path:
    """A report; not to be written to."""
    out = tmp_path_factory.mktemp("report")
    write_report([servo_folder, blind_folder], out, 3, "Servo & blind")
    return out


def test_the_page_needs_nothing_from_outside(report: Path) -> None:
    text, reader = read(report / "report.html")
    assert sorted(path.name for path in report.iterdir()) == ["report.html", "summary.json"]
    assert all(source.startswith("data:image/") for source in reader.sources)
    assert not re.search(r"https?://|<script|<link|url\(", text)
    assert "<title>Servo &amp; blind</title>" in text


def test_the_tables_have_rates_with_intervals(report: Path) -> None:
    _, reader = read(report / "report.html")
    assert ["servo", "4/4 100% [51, 100]", "3/4 75% [30, 95]", "7/8 88% [53, 98]"] in reader.rows
    assert ["blind", "4/4 100% [51, 100]", "0/4 0% [0, 49]", "4/8 50% [22, 78]"] in reader.rows


def test_policies_are_compared_on_the_same_episodes(report: Path) -> None:
    _, reader = read(report / "report.html")
    rows = [row for row in reader.rows if row[0] == "mirror" and row[1] == "4"]
    assert [row[1:6] for row in rows] == [["4", "2", "1", "0", "1"], ["4", "0", "3", "0", "1"]]
    summary = json.loads((report / "summary.json").read_text())
    assert summary["reference"] == "servo"
    whole = [row for row in summary["success_differences"] if row["scenario"] == "all"]
    assert [row["difference"] for row in whole] == pytest.approx([-1 / 8, -3 / 8])
    assert [row["p"] for row in whole] == pytest.approx([1.0, 0.25])


def test_every_failure_is_listed_with_its_kind_and_some_have_pictures(report: Path) -> None:
    text, reader = read(report / "report.html")
    summary = json.loads((report / "summary.json").read_text())
    found = [(row["policy"], row["scenario"], row["seed"], row["kind"]) for row in summary["failures"]]
    assert found == [
        ("servo", "mirror", 1, "lost target"),
        *[("blind", "mirror", seed, "collision") for seed in range(4)],
    ]
    assert ["servo", "mirror", "1", "lost target", "search", "8.2"] in [row[:6] for row in reader.rows]
    assert text.count("<article>") == 3
    assert "Pictures of 3 of 5" in text


def test_the_source_of_the_numbers_is_given(report: Path, servo_folder: Path) -> None:
    text, _ = read(report / "report.html")
    assert "fixation-gym evaluate --policy servo --scenario clear,mirror --episodes 4 --seed 0" in text
    assert json.loads((servo_folder / "summary.json").read_text())["seed_sha256"] in text
    assert "10 min" in text
    assert "mujoco" in text


def test_folders_without_traces_are_reported_with_what_they_know(tmp_path: Path, servo_folder: Path) -> None:
    shutil.copytree(servo_folder, tmp_path / "old")
    shutil.rmtree(tmp_path / "old" / "traces")
    summary = write_report([tmp_path / "old"], tmp_path / "report", 5, "Old")
    text, _ = read(tmp_path / "report" / "report.html")
    assert [row["kind"] for row in summary["failures"]] == ["lost target"]
    assert "Neither trace nor clip" in text
    assert "No traces" in text
    assert "On the same episodes" not in text  # one policy only


def test_clips_are_shown_as_they_are(tmp_path: Path, servo_folder: Path) -> None:
    shutil.copytree(servo_folder, tmp_path / "servo")
    clip = clip_file(tmp_path / "servo", "mirror", 1)
    clip.parent.mkdir()
    clip.write_bytes(jpeg(np.zeros((9, 9, 3), np.uint8), 80))
    write_report([tmp_path / "servo"], tmp_path / "report", 5, "Clips")
    _, reader = read(tmp_path / "report" / "report.html")
    assert [source for source in reader.sources if source.startswith("data:image/jpeg;base64,")]


def test_a_report_replaces_a_report_but_nothing_else(tmp_path: Path, servo_folder: Path) -> None:
    shutil.copytree(servo_folder, tmp_path / "servo")
    before = {path.name: path.read_bytes() for path in (tmp_path / "servo").iterdir() if path.is_file()}
    with pytest.raises(UsageError, match=r"holds results of another command \(run\.json\)"):
        write_report([servo_folder], tmp_path / "servo", 0, "Title")
    assert {path.name: path.read_bytes() for path in (tmp_path / "servo").iterdir() if path.is_file()} == before
    for title in ("First", "Second"):
        write_report([servo_folder], tmp_path / "report", 0, title)
    assert "Second" in (tmp_path / "report" / "report.html").read_text()


def test_what_cannot_be_reported_leaves_nothing(tmp_path: Path, servo_folder: Path) -> None:
    shutil.copytree(servo_folder, tmp_path / "broken")
    (tmp_path / "broken" / "traces" / "clear-0.npz").write_bytes(b"nothing")
    with pytest.raises(UsageError, match=r"clear-0\.npz is no trace"):
        write_report([tmp_path / "broken"], tmp_path / "out", 0, "Title")
    with pytest.raises(UsageError, match="--gallery must be 0 or more"):
        write_report([servo_folder], tmp_path / "out", -1, "Title")
    assert not (tmp_path / "out").exists()
    (tmp_path / "file").write_text("mine")
    with pytest.raises(UsageError, match="cannot write to the output folder"):
        write_report([servo_folder], tmp_path / "file" / "out", 0, "Title")
    (tmp_path / "taken" / "report.html").mkdir(parents=True)
    with pytest.raises(UsageError, match=r"report\.html is a folder where a file is needed"):
        write_report([servo_folder], tmp_path / "taken", 0, "Title")
