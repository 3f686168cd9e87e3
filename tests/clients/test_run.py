"""The script behind `make clients`, without installing anything."""

import importlib.util
import os
import sys
import time
from pathlib import Path

import pytest

HERE = Path(__file__).parent


@pytest.fixture(scope="module")
def clients():
    spec = importlib.util.spec_from_file_location("clients_run", HERE / "run.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look there
    spec.loader.exec_module(module)
    return module


def test_every_client_has_a_program_and_a_row_in_the_docs(clients):
    keys = {client.key for client in clients.CLIENTS}
    assert {path.stem.removeprefix("use_") for path in HERE.glob("use_*.py")} == keys
    rows = (HERE.parents[1] / "docs" / "clients.md").read_text().splitlines()
    named = {row.split("|")[1].strip() for row in rows if row.startswith("| ")}
    assert {client.name for client in clients.CLIENTS} <= named


def test_a_program_that_fails_says_how_and_one_that_hangs_is_ended_with_all_it_started(clients, tmp_path):
    log = tmp_path / "log"
    assert clients.run([sys.executable, "-c", "print(1)"], log, 60) == ""
    assert clients.run([sys.executable, "-c", "raise ValueError('no such map')"], log, 60).endswith("no such map")
    child = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {CHILD!r}, {str(tmp_path / 'pid')!r}])"
    assert clients.run([sys.executable, "-c", child], log, 2) == "not done after 2 s"
    pid = int((tmp_path / "pid").read_text())
    deadline = time.monotonic() + 10
    while Path(f"/proc/{pid}/cmdline").exists() and Path(f"/proc/{pid}/cmdline").read_bytes():
        assert time.monotonic() < deadline
        os.sched_yield()


CHILD = "import os, sys, time; open(sys.argv[1], 'w').write(str(os.getpid())); time.sleep(600)"


def test_an_unknown_client_is_refused(clients, capsys):
    assert clients.main(clients.Options(only=("sbx3",))) == 2
    assert "unknown client sbx3; choose of gymnasium, sb3" in capsys.readouterr().err
