"""Workers that die, or cannot be had."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.workers import run_cells


def die_at_two(cell):
    if cell["number"] == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return cell


def test_a_killed_worker_ends_with_one_sentence():
    cells = [{"number": number} for number in range(4)]
    with pytest.raises(UsageError, match="the same command goes on"):
        list(run_cells(cells, 2, run=die_at_two))


def test_an_address_without_a_ray_cluster_is_named(monkeypatch):
    monkeypatch.setenv("RAY_ADDRESS", "nowhere")
    with pytest.raises(UsageError, match="there is no Ray cluster at RAY_ADDRESS=nowhere; start or unset it"):
        list(run_cells([{}], 2, "ray", dict))


ENDLESS = """
import os, sys, time
sys.path.insert(0, {folder!r})
from test_worker_death import say_so_and_wait
from fixation_gym.evaluation.workers import run_cells
if __name__ == "__main__":
    list(run_cells([{{"file": sys.argv[1] + str(number)}} for number in range(2)], 2, run=say_so_and_wait))
"""


def say_so_and_wait(cell):
    Path(cell["file"]).write_text(str(os.getpid()))
    time.sleep(60)
    return cell


def wait_until(what, seconds=60.0):
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end
        time.sleep(0.05)


def runs(pid):
    """Whether a process is there and no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def test_workers_end_soon_after_a_run_that_was_killed(tmp_path):
    code = ENDLESS.format(folder=str(Path(__file__).parent))
    main = subprocess.Popen([sys.executable, "-c", code, str(tmp_path / "worker-")])
    files = [tmp_path / f"worker-{number}" for number in range(2)]
    wait_until(lambda: all(file.exists() and file.read_text() for file in files))
    main.kill()
    main.wait()
    workers = [int(file.read_text()) for file in files]
    wait_until(lambda: not any(map(runs, workers)), 20.0)
    assert len(set(workers) | {main.pid}) == 3
