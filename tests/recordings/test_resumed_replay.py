"""A replay that was killed goes on, and ends with the files of one that was left in peace."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import cv2
import pytest
from made_recordings import COUNT, write_layout

from fixation_gym.replay import checkpoint
from fixation_gym.replay.config import ReplayConfig
from fixation_gym.replay.run import FILES, replay

EVERY, KILLED_AFTER = 5, 13
KILL = f"""
import os, signal, sys
from pathlib import Path
from fixation_gym.replay import checkpoint, run
from fixation_gym.replay.config import ReplayConfig

checkpoint.EVERY = {EVERY}
written = 0

class Killed(run.RowWriter):
    def write(self, row):
        global written
        super().write(row)
        written += 1
        if written == {KILLED_AFTER}:
            os.kill(os.getpid(), signal.SIGKILL)

run.RowWriter = Killed
run.replay(ReplayConfig(recording=Path(sys.argv[1]), detector=sys.argv[3]), Path(sys.argv[2]))
"""


@pytest.fixture(autouse=True)
def often(monkeypatch):
    monkeypatch.setattr(checkpoint, "EVERY", EVERY)


def killed(recording: Path, out: Path, detector: str) -> None:
    ended = subprocess.run([sys.executable, "-c", KILL, recording, out, detector], capture_output=True)
    assert ended.returncode == -signal.SIGKILL
    assert len((out / "estimates.csv").read_text().splitlines()) == 1 + KILLED_AFTER
    assert not (out / "overlay.mp4").exists()


def files(out: Path) -> dict:
    """Bytes of all files; the summary without times."""
    found: dict = {path.name: path.read_bytes() for path in out.iterdir()}
    summary = json.loads(found["summary.json"])
    for name in ("wall_s", "perception_ms", "pictures_resumed"):
        del summary[name]
    del summary["triangulation"]["wall_ms"]
    return {**found, "summary.json": summary}


@pytest.mark.parametrize("detector", ["box", "mean_shift"])
def test_a_killed_replay_goes_on_and_ends_as_if_nothing_had_been(detector, tmp_path):
    recording = write_layout(tmp_path / "recording")
    config = ReplayConfig(recording=recording, detector=detector)
    assert replay(config, tmp_path / "undisturbed")["pictures_resumed"] == 0
    killed(recording, tmp_path / "out", detector)
    assert replay(config, tmp_path / "out")["pictures_resumed"] == KILLED_AFTER // EVERY * EVERY
    assert set(files(tmp_path / "undisturbed")) == set(FILES)
    assert files(tmp_path / "out") == files(tmp_path / "undisturbed")
    film = cv2.VideoCapture(str(tmp_path / "out" / "overlay.mp4"))
    assert film.get(cv2.CAP_PROP_FRAME_COUNT) == COUNT


def test_another_replay_or_a_finished_one_begins_again(tmp_path):
    recording, out = write_layout(tmp_path / "recording"), tmp_path / "out"
    killed(recording, out, "box")
    another = ReplayConfig(recording=recording, detector="box", estimator="pose")
    for _ in range(2):
        assert replay(another, out)["pictures_resumed"] == 0
        assert {path.name for path in out.iterdir()} == set(FILES)
