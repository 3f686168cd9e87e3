"""Contact sheets of failures: which episodes, which moments, and that they are the same episodes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import pytest
from evaluation_fakes import FakeEnv, FakePolicy, run_fake_cell
from made_traces import make_trace

from fixation_gym.evaluation import clips, workers
from fixation_gym.evaluation.clips import clip_file, film_failures, moments
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.evaluation.evaluate import evaluate
from fixation_gym.evaluation.rollout import run_episode

CONFIG = EvaluationConfig(scenarios=("clear",), episodes=4)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(workers, "make_env", lambda cell, render_mode: FakeEnv())
    monkeypatch.setattr(workers, "make_policy", lambda name, env, detector=None: FakePolicy())
    evaluate(CONFIG, tmp_path, run_fake_cell)
    return tmp_path


def test_every_failure_gets_a_sheet_and_only_once(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert film_failures(folder) == []
    # Seed 2 is the only success without collision.
    assert sorted(path.name for path in (folder / "clips").iterdir()) == ["clear-0.jpg", "clear-1.jpg", "clear-3.jpg"]
    sheet = cv2.imread(str(clip_file(folder, "clear", 1)))
    assert sheet.shape == (2 * (31 + 26 + 4) + 4, 3 * (45 + 4) + 4, 3)
    clip_file(folder, "clear", 3).unlink()
    filmed: list[int] = []

    def film(cell: workers.Cell) -> dict:
        filmed.append(cell["seed"])
        return clips.film_cell(cell)

    assert film_failures(folder, run=film) == []
    assert filmed == [3]


def test_an_episode_that_comes_out_differently_has_no_sheet(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "make_env", lambda cell, render_mode: FakeEnv(length=6))
    assert [result.seed for result in film_failures(folder)] == [0, 1, 3]
    assert list((folder / "clips").iterdir()) == []


def test_the_moment_of_the_failure_is_among_those_shown() -> None:
    failed = replace(run_episode(FakeEnv(), FakePolicy(), seed=1), steps=100)
    assert moments(failed, None) == [0, 20, 40, 60, 80]
    hit = make_trace([("approach", 101)], collided_from=47)
    assert moments(replace(failed, collision=True), hit) == [0, 20, 47, 60, 80]
    assert moments(replace(failed, collision=True), make_trace([("approach", 101)], collided_from=3)) == [
        0,
        3,
        40,
        60,
        80,
    ]
    assert moments(replace(failed, steps=3), None) == [0, 1, 2]
