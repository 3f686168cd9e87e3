"""The demonstration's files, with an environment that is no simulator."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import imageio_ffmpeg
import pytest
from evaluation_fakes import FakeEnv, FakePolicy

from fixation_gym.errors import UsageError
from fixation_gym.evaluation import demo, workers
from fixation_gym.evaluation.evaluate import EvaluationConfig

CONFIG = EvaluationConfig(scenarios=("clear", "mirror"), episodes=2)


@pytest.fixture
def envs(monkeypatch: pytest.MonkeyPatch) -> list[FakeEnv]:
    made: list[FakeEnv] = []

    def make_env(cell: workers.Cell, render_mode: str, render_view: str) -> FakeEnv:
        assert (render_mode, render_view) == ("rgb_array", "overlay")
        made.append(FakeEnv(length=12))
        return made[-1]

    monkeypatch.setattr(workers, "make_env", make_env)
    monkeypatch.setattr(workers, "make_policy", lambda name, env: FakePolicy())
    return made


def test_a_demo_leaves_video_sheet_episodes_and_summary(tmp_path: Path, envs: list[FakeEnv]) -> None:
    summary = demo.run_demo(CONFIG, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {
        "demo.mp4",
        "contact_sheet.png",
        "episodes.jsonl",
        "run.json",
        "summary.json",
    }
    assert json.loads((tmp_path / "summary.json").read_text()) == summary
    assert summary["scenarios"]["mirror"]["successes"] == 1
    assert all(env.closed for env in envs)
    count, _ = imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "demo.mp4"))
    assert count == 4 * (5 + 10)  # every third of 12 decisions and the end, then the outcome stands
    sheet = cv2.imread(str(tmp_path / "contact_sheet.png"))
    assert sheet.shape[0] == 4 * (31 + 26) + 5 * 4  # one row per episode; frames carry a caption


def test_a_demo_replaces_an_earlier_one(tmp_path: Path, envs: list[FakeEnv]) -> None:
    demo.run_demo(CONFIG, tmp_path)
    assert demo.run_demo(EvaluationConfig(scenarios=("clear",), episodes=1), tmp_path)["scenarios"].keys() == {"clear"}


def test_a_demo_never_replaces_an_evaluation(tmp_path: Path, envs: list[FakeEnv]) -> None:
    (tmp_path / "run.json").write_text('{"command": "evaluate"}')
    with pytest.raises(UsageError, match="results of another command"):
        demo.run_demo(CONFIG, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["run.json"]
