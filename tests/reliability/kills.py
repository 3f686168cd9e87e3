"""``kill -9`` at random moments: after going on nothing is lost, nothing is there twice, and the result is the same.

Each command runs undisturbed once. Then it begins in a fresh folder, its main process is killed at a moment drawn
between the first file, or half of the time, and the end of the undisturbed run, the same command goes on, is killed, and so on; what is there
at the end is compared with the undisturbed result. Every chain of kills is a line of ``chains.jsonl``: the same
command again goes on.
"""

from __future__ import annotations

import os
import shutil
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from result_folders import content, differences
from small_commands import COMMANDS, REFERENCES, SOURCE, main

from fixation_gym.doctor import installed_versions
from fixation_gym.evaluation.source import source_commit
from fixation_gym.evaluation.storage import ResultStore
from fixation_gym.gl import select_backend

KILLS = {
    "evaluate": 7,
    "evaluate_workers": 3,
    "export": 7,
    "export_workers": 3,
    "report": 5,
    "ablate": 4,
    "ladder": 4,
    "distance": 4,
    "necessity": 4,
    "scenarios": 3,
    "demo": 2,
    "train": 2,
    "compare": 2,
}
"""50 in all."""
CHAIN = 4
"""Most kills before a run may end."""
ENDS_WITHIN_S = 20.0
"""Within this time after a kill the worker processes of the run are gone, too."""


@dataclass(frozen=True)
class Args:
    """What to kill."""

    only: tuple[str, ...] = tuple(KILLS)
    """Names of commands."""
    seed: int = 0
    """Of the moments."""
    out: Path = Path("out/kills")
    """Folder of the results."""


def load_what_children_share() -> None:
    """Import once what every command imports: children are forked, and do not spend their time on that."""
    select_backend()
    import stable_baselines3  # noqa: F401
    import torch

    import fixation_gym.envs.pick_sim
    import fixation_gym.envs.rendering
    import fixation_policies.catalogue  # noqa: F401

    torch.set_num_threads(1)


def start(name: str, folder: Path) -> int:
    """Run a command in a forked process, in a session of its own; returns its id."""
    pid = os.fork()
    if pid:
        return pid
    os.setsid()
    log = os.open(folder.with_suffix(".log"), os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.dup2(log, 1)
    os.dup2(log, 2)
    code = 1
    try:
        code = main(name, folder)
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def wait(pid: int, seconds: float) -> int | None:
    """Exit code of a child; None if it runs on after so many seconds."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        done, status = os.waitpid(pid, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.01)
    return None


def left_in_session(session: int) -> list[int]:
    """Processes of a session that run."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, of = stat.read_text().rpartition(")")[2].split()[:4]
        except OSError:  # it ended meanwhile
            continue
        if int(of) == session and state != "Z":
            found.append(int(stat.parent.name))
    return found


def undisturbed(name: str, folder: Path) -> tuple[float, float]:
    """Run a command to its end; returns when its first file was there, or half of its time was over, and
    when it ended, s after the start."""
    shutil.rmtree(folder, ignore_errors=True)
    began, pid = time.monotonic(), start(name, folder)
    first, code = None, None
    while code is None:
        code = wait(pid, 0.02)
        if first is None and folder.exists() and any(folder.iterdir()):
            first = time.monotonic() - began
    if code != 0:
        raise SystemExit(f"{name} ends with {code} without being disturbed; see {folder.with_suffix('.log')}")
    took = time.monotonic() - began
    return min(first or 0.0, 0.5 * took), took  # some commands write everything at their end


def chain(name: str, times: tuple[float, float], folder: Path, rng: np.random.Generator, most: int) -> dict[str, Any]:
    """Kill a command up to ``most`` times, let it end, and say how its folder differs from that of ``reference``."""
    shutil.rmtree(folder, ignore_errors=True)
    kills: list[dict[str, Any]] = []
    stayed = 0
    code = None
    while code is None and len(kills) < most:
        pid = start(name, folder)
        moment = float(rng.uniform(*times))
        code = wait(pid, moment)
        if code is None:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            kills.append({"s": round(moment, 2), "files": sum(path.is_file() for path in folder.rglob("*"))})
            end = time.monotonic() + ENDS_WITHIN_S
            while left_in_session(pid) and time.monotonic() < end:
                time.sleep(0.05)
            stayed += len(left_in_session(pid))
    if code is None:
        code = wait(start(name, folder), 3600.0)
    return {"kills": kills, "exit_code": code, "processes_left": stayed}


def check(name: str, args: Args, store: ResultStore[tuple[str, int], dict[str, Any]]) -> None:
    """Kill a command as often as the table says."""
    reference = args.out / REFERENCES.get(name, name)
    done = [row for (command, _), row in store.finished.items() if command == name]
    left = KILLS[name] - sum(len(row["kills"]) for row in done)
    if left <= 0:
        return
    times = undisturbed(REFERENCES.get(name, name), reference)
    if name == "evaluate":
        shutil.rmtree(args.out / SOURCE, ignore_errors=True)
        shutil.copytree(reference, args.out / SOURCE)
    while left > 0:
        number = len(done)
        rng = np.random.default_rng([args.seed, list(KILLS).index(name), number])
        folder = args.out / f"{name}-{number}"
        row = chain(name, times, folder, rng, min(CHAIN, left))
        row |= {"command": name, "chain": number, "differences": differences(content(reference), content(folder))}
        store.append(row)
        done.append(row)
        left -= len(row["kills"])
        print(f"{name}: {len(row['kills'])} kills, exit code {row['exit_code']}, {row['differences'] or 'the same'}")


def run(args: Args) -> int:
    """Kill, compare and print the table; exit code 1 if anything differs."""
    load_what_children_share()
    described = {"seed": args.seed, "commit": source_commit(), "versions": installed_versions()}
    args.out.mkdir(parents=True, exist_ok=True)
    with ResultStore(
        args.out, described, "chains.jsonl", lambda row: (row["command"], row["chain"]), dict, dict
    ) as store:
        for name in args.only:
            check(name, args, store)
        rows = list(store.finished.values())
    bad = [row for row in rows if row["exit_code"] or row["differences"] or row["processes_left"]]
    print("\n| command | kills | ends | differences | processes left |\n|---|---|---|---|---|")
    for name in COMMANDS:
        mine = [row for row in rows if row["command"] == name]
        if mine:
            counts = (sum(len(row["kills"]) for row in mine), len(mine), sum(len(row["differences"]) for row in mine))
            print(f"| `{name}` | {' | '.join(map(str, counts))} | {sum(row['processes_left'] for row in mine)} |")
    print(f"\n{sum(len(row['kills']) for row in rows)} kills, {len(bad)} chains that did not end as they should")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(run(tyro.cli(Args, description=__doc__)))
