"""The demonstration's files, with an environment that is no simulator."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import imageio_ffmpeg
import pytest
from evaluation_fakes import FakeEnv, FakePolicy

from fixation_gym.errors import UsageError
from fixation_gym.evaluation import demo, video, workers
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.evaluation.storage import EpisodeStore

CONFIG = EvaluationConfig(scenarios=("clear", "mirror"), episodes=2)


def use_fakes(monkeypatch: pytest.MonkeyPatch) -> list[FakeEnv]:
    """Films environments that are no simulator; returns those that were made."""
    made: list[FakeEnv] = []

    def make_env(cell: workers.Cell, render_mode: str, render_view: str) -> FakeEnv:
        assert (render_mode, render_view) == ("rgb_array", "overlay")
        made.append(FakeEnv(length=12))
        return made[-1]

    monkeypatch.setattr(workers, "make_env", make_env)
    monkeypatch.setattr(workers, "make_policy", lambda name, env, detector=None: FakePolicy())
    return made


@pytest.fixture
def envs(monkeypatch: pytest.MonkeyPatch) -> list[FakeEnv]:
    return use_fakes(monkeypatch)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a demonstration, to copy and not to write to."""
    out = tmp_path_factory.mktemp("finished")
    with pytest.MonkeyPatch.context() as patch:
        envs = use_fakes(patch)
        demo.run_demo(CONFIG, out)
    assert all(env.closed for env in envs)
    return out


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


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


def test_a_demo_replaces_an_earlier_one(tmp_path: Path, envs: list[FakeEnv], finished: Path) -> None:
    shutil.copytree(finished, tmp_path, dirs_exist_ok=True)
    summary = demo.run_demo(EvaluationConfig(scenarios=("clear",), episodes=1), tmp_path)
    assert summary["scenarios"].keys() == {"clear"}
    assert json.loads((tmp_path / "summary.json").read_text()) == summary
    assert len((tmp_path / "episodes.jsonl").read_text().splitlines()) == 1
    assert imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "demo.mp4"))[0] == 5 + 10


def break_first_env(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(workers, "make_env", raise_broken)


def break_second_scenario(patch: pytest.MonkeyPatch) -> None:
    make_env = workers.make_env

    def make(cell: workers.Cell, **options: Any) -> Any:
        return raise_broken() if cell["scenario"] == "mirror" else make_env(cell, **options)

    patch.setattr(workers, "make_env", make)


def break_encoder(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(video.subprocess, "Popen", raise_broken)


def break_ffmpeg(patch: pytest.MonkeyPatch) -> None:
    """An ffmpeg that accepts every frame, and then writes nothing."""

    def start(writer: video.VideoWriter) -> subprocess.Popen[bytes]:
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
        return subprocess.Popen(["cat"], **pipes)

    patch.setattr(video.VideoWriter, "_start", start)


def break_sheet(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(demo, "contact_sheet", raise_broken)


def raise_broken(*args: Any, **kwargs: Any) -> Any:
    raise OSError("broken")


@pytest.mark.parametrize(
    "break_something", [break_first_env, break_second_scenario, break_encoder, break_ffmpeg, break_sheet]
)
def test_a_demo_that_fails_leaves_the_folder_as_it_was(
    tmp_path: Path,
    envs: list[FakeEnv],
    finished: Path,
    monkeypatch: pytest.MonkeyPatch,
    break_something: Callable[[pytest.MonkeyPatch], None],
) -> None:
    def try_broken(out: Path) -> None:
        with monkeypatch.context() as patch:
            break_something(patch)
            with pytest.raises(OSError, match=r"broken|No such file"):
                demo.run_demo(CONFIG, out)

    try_broken(tmp_path / "new")
    assert list((tmp_path / "new").iterdir()) == []
    shutil.copytree(finished, tmp_path / "old")
    before = contents(tmp_path / "old")
    assert len(before) == 5
    try_broken(tmp_path / "old")
    assert contents(tmp_path / "old") == before
    assert all(env.closed for env in envs)


def test_two_demos_at_once_do_not_meet(tmp_path: Path, envs: list[FakeEnv], monkeypatch: pytest.MonkeyPatch) -> None:
    make_env = workers.make_env
    refused: list[str] = []

    def make(cell: workers.Cell, **options: Any) -> Any:
        before = contents(tmp_path)
        with pytest.raises(UsageError, match="in use by another run") as error:
            demo.run_demo(CONFIG, tmp_path)
        refused.append(str(error.value))
        assert contents(tmp_path) == before
        return make_env(cell, **options)

    monkeypatch.setattr(workers, "make_env", make)
    summary = demo.run_demo(CONFIG, tmp_path)
    assert len(refused) == 2
    assert json.loads((tmp_path / "summary.json").read_text()) == summary
    assert len((tmp_path / "episodes.jsonl").read_text().splitlines()) == 4


def test_a_demo_does_not_enter_a_running_evaluation(tmp_path: Path, envs: list[FakeEnv]) -> None:
    with EpisodeStore(tmp_path, {"command": "evaluate"}), pytest.raises(UsageError, match="in use by another run"):
        demo.run_demo(CONFIG, tmp_path)
    assert envs == []


def test_what_a_killed_demo_left_is_removed(tmp_path: Path, envs: list[FakeEnv]) -> None:
    with EpisodeStore(tmp_path / ".demo.part", {"command": "demo", "policy": "blind"}):
        pass
    demo.run_demo(CONFIG, tmp_path)
    assert not (tmp_path / ".demo.part").exists()


def test_a_folder_in_the_place_of_the_video_is_an_error_before_filming(tmp_path: Path, envs: list[FakeEnv]) -> None:
    (tmp_path / "demo.mp4").mkdir()
    with pytest.raises(UsageError, match=r"demo\.mp4 is a folder"):
        demo.run_demo(CONFIG, tmp_path)
    assert envs == []


def test_a_demo_never_replaces_an_evaluation(tmp_path: Path, envs: list[FakeEnv]) -> None:
    (tmp_path / "run.json").write_text('{"command": "evaluate"}')
    with pytest.raises(UsageError, match="results of another command"):
        demo.run_demo(CONFIG, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["run.json"]
