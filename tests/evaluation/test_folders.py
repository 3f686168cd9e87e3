"""Reading evaluation folders: order, what is missing, what is damaged."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from evaluation_fakes import run_fake_cell

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.evaluation.evaluate import evaluate, seed_hash
from fixation_gym.evaluation.folders import evaluation_folders, read_evaluation

CONFIG = EvaluationConfig(scenarios=("opaque", "clear"), episodes=2)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    evaluate(CONFIG, tmp_path / "servo", run_fake_cell)
    return tmp_path / "servo"


def test_results_come_in_the_order_of_the_run(folder: Path) -> None:
    file = folder / "episodes.jsonl"
    file.write_text("".join(f"{line}\n" for line in reversed(file.read_text().splitlines())))
    evaluation = read_evaluation(folder)
    assert evaluation.keys == CONFIG.episode_keys()
    assert seed_hash(evaluation.keys) == evaluation.summary["seed_sha256"]
    assert evaluation.trace(evaluation.results[0]) is not None


def test_episodes_without_traces_have_none(folder: Path) -> None:
    for path in (folder / "traces").iterdir():
        path.unlink()
    assert read_evaluation(folder).trace(read_evaluation(folder).results[0]) is None


def test_a_line_being_written_is_left_out(folder: Path) -> None:
    with (folder / "episodes.jsonl").open("a") as file:
        file.write('{"scenario": "cle')
    assert len(read_evaluation(folder).results) == 4


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (
            lambda folder: (folder / "summary.json").unlink(),
            r"summary\.json: it is missing; is the evaluation finished",
        ),
        (lambda folder: (folder / "run.json").unlink(), r"run\.json: it is missing"),
        (lambda folder: (folder / "run.json").write_text("{}"), r"run\.json lacks 'policy'"),
        (lambda folder: (folder / "summary.json").write_text("[]"), r"summary\.json is damaged"),
        (lambda folder: (folder / "summary.json").write_text("{"), r"summary\.json is damaged"),
        (lambda folder: (folder / "summary.json").write_text(json.dumps({"rows": []})), "lacks 'scenarios'"),
        (lambda folder: (folder / "episodes.jsonl").write_text("{}\n"), r"episodes\.jsonl, line 1 is damaged"),
        (lambda folder: (folder / "episodes.jsonl").write_text(""), r"episodes\.jsonl has no episodes"),
    ],
)
def test_what_is_missing_or_damaged_is_named(folder: Path, damage: Callable[[Path], None], message: str) -> None:
    damage(folder)
    with pytest.raises(UsageError, match=message):
        read_evaluation(folder)


def test_a_folder_of_evaluations_stands_for_those_the_full_servo_first(folder: Path) -> None:
    for name in ("blind", "servo-no_retry"):
        (folder.parent / name).mkdir()
        (folder.parent / name / "episodes.jsonl").write_text("")
    names = ["servo", "blind", "servo-no_retry"]
    assert [path.name for path in evaluation_folders([folder.parent])] == names
    assert evaluation_folders([folder]) == [folder]


def test_folders_that_cannot_be_reported_are_errors(folder: Path) -> None:
    with pytest.raises(UsageError, match="nowhere is no folder"):
        evaluation_folders([folder.parent / "nowhere"])
    with pytest.raises(UsageError, match="given twice"):
        evaluation_folders([folder, folder.parent])
    (folder.parent / "empty").mkdir()
    with pytest.raises(UsageError, match=r"empty has no episodes\.jsonl"):
        evaluation_folders([folder.parent / "empty"])
