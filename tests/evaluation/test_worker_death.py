"""Workers that die, or cannot be had."""

import contextlib
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
    list(run_cells([{{"file": sys.argv[1]}}], 2, run=say_so_and_wait))
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


def session_of(leader):
    """Processes of a session that are there and no zombies, by what they were started with."""
    found = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            values = stat.read_text().rpartition(")")[2].split()
            if int(values[3]) == leader and values[0] != "Z":
                found[int(stat.parent.name)] = (stat.parent / "cmdline").read_text()
    return found


def test_workers_at_work_and_without_work_end_soon_after_a_run_that_was_killed(tmp_path):
    code, at_work = ENDLESS.format(folder=str(Path(__file__).parent)), tmp_path / "worker"
    main = subprocess.Popen([sys.executable, "-c", code, str(at_work)], start_new_session=True)
    wait_until(lambda: at_work.exists() and at_work.read_text())
    wait_until(lambda: sum("LokyProcess" in line for line in session_of(main.pid).values()) == 2)
    main.kill()
    main.wait()
    wait_until(lambda: not session_of(main.pid), 20.0)
    assert int(at_work.read_text()) != main.pid


def test_a_process_whose_starter_is_gone_ends_at_once():
    code = "import time; from fixation_gym.evaluation.starter import end_with; end_with(-1); time.sleep(60)"
    assert subprocess.run([sys.executable, "-c", code], timeout=50).returncode == 1
