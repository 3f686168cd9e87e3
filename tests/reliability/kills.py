"""``kill -9`` at random moments: after going on nothing is lost, nothing is there twice, and the result is the same.

Each command runs undisturbed once. Then it begins in a fresh folder, its main process is killed at a random moment
between the first file, or half of the time, and the end of the undisturbed run, the same command goes on, is killed,
and so on; what is there at the end is compared with the undisturbed result. Moments are in processor time, which a busy
machine does not stretch. Every chain of kills is a line of ``chains.jsonl``: the same command again goes on.
"""

from __future__ import annotations

import os
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from result_folders import content, differences
from small_commands import REFERENCES, SOURCES, main

from fixation_gym.doctor import installed_versions
from fixation_gym.evaluation.source import source_commit
from fixation_gym.evaluation.storage import ResultStore
from fixation_gym.gl import select_backend

KILLS = {
    "evaluate": 7,
    "evaluate_workers": 3,
    "export": 7,
    "export_workers": 3,
    "record": 4,
    "record_workers": 3,
    "report": 5,
    "replay": 3,
    "ablate": 4,
    "ladder": 4,
    "distance": 4,
    "necessity": 4,
    "scenarios": 3,
    "robustness": 3,
    "transfer": 3,
    "demo": 2,
    "train": 2,
    "compare": 2,
}
"""66 in all."""
CHAIN = 4
"""Most kills before a run may end."""
_LOOK_S = 0.04
_TICKS = os.sysconf("SC_CLK_TCK")
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

    import fixation_policies.catalogue  # noqa: F401

    torch.set_num_threads(1)


def start(name: str, folder: Path, log_file: Path | None = None) -> int:
    """Run a command in a forked process, in a session of its own; returns its id. What it says is beside its folder."""
    pid = os.fork()
    if pid:
        return pid
    os.setsid()
    log = os.open(log_file or folder.with_suffix(".log"), os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.dup2(log, 1)
    os.dup2(log, 2)
    code = 1
    try:
        code = main(name, folder)
    except Exception:
        traceback.print_exc()  # the process ends below, before Python would
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def session_of(leader: int) -> dict[int, float]:
    """Processes of a session that run, and the processor time that each has used, s."""
    found = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            values = stat.read_text().rpartition(")")[2].split()
        except OSError:  # it ended meanwhile
            continue
        if int(values[3]) == leader and values[0] != "Z":
            found[int(stat.parent.name)] = (int(values[11]) + int(values[12])) / _TICKS
    return found


def ended(pid: int) -> int | None:
    """Exit code of a child; None if it still runs."""
    done, status = os.waitpid(pid, os.WNOHANG)
    return os.waitstatus_to_exitcode(status) if done else None


def undisturbed(name: str, folder: Path) -> tuple[float, float]:
    """Run a command to its end.

    Returns:
        Processor time when its first file was there, or half of all if that is earlier, and all of it, s.
    """
    shutil.rmtree(folder, ignore_errors=True)
    pid = start(name, folder)
    first, used, code = None, 0.0, None
    while code is None:
        time.sleep(_LOOK_S)
        used = max(used, sum(session_of(pid).values()))
        if first is None and folder.exists() and any(folder.iterdir()):
            first = used
        code = ended(pid)
    if code != 0:
        raise SystemExit(f"{name} ends with {code} without being disturbed; see {folder.with_suffix('.log')}")
    return min(first or 0.0, 0.5 * used), used


def disturbed(name: str, folder: Path, moment: float) -> tuple[int | None, dict[str, Any]]:
    """Run a command, or go on with it, and kill its main process after so much processor time.

    Returns:
        Its exit code, None if it was killed, and what was there then.
    """
    pid, code = start(name, folder), None
    while code is None and sum(session_of(pid).values()) < moment:
        time.sleep(_LOOK_S)
        code = ended(pid)
    if code is not None:
        return code, {}
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    files = sum(path.is_file() for path in folder.rglob("*"))
    end = time.monotonic() + ENDS_WITHIN_S
    while (left := len(session_of(pid))) and time.monotonic() < end:
        time.sleep(_LOOK_S)
    return None, {"cpu_s": round(moment, 2), "files": files, "processes_left": left}


def chain(name: str, times: tuple[float, float], folder: Path, rng: np.random.Generator, most: int) -> dict[str, Any]:
    """Kill a command up to ``most`` times, and let it end."""
    shutil.rmtree(folder, ignore_errors=True)
    kills: list[dict[str, Any]] = []
    code = None
    while code is None:
        moment = float(rng.uniform(*times)) if len(kills) < most else np.inf
        code, kill = disturbed(name, folder, moment)
        kills += [kill] if kill else []
    return {"command": name, "kills": kills, "exit_code": code}


class Reference:
    """The undisturbed run of each command, when it is first asked for."""

    def __init__(self, out: Path) -> None:
        self._out = out
        self._times: dict[str, tuple[float, float]] = {}

    def of(self, name: str) -> tuple[Path, tuple[float, float]]:
        """Folder, and times as ``undisturbed`` gives them."""
        self._have_source(name)
        folder = self._out / REFERENCES.get(name, name)
        if name not in self._times:
            self._times[name] = undisturbed(name, self._out / name)
        if not folder.exists():
            undisturbed(folder.name, folder)
        return folder, self._times[name]

    def _have_source(self, name: str) -> None:
        """The folder that a command reads, by an undisturbed run of the command that writes it."""
        if name in SOURCES and not (source := self._out / SOURCES[name][1]).exists():
            shutil.copytree(self.of(SOURCES[name][0])[0], source)

    def forget(self, name: str) -> None:
        """Time a command again: the first run of an installation also compiles, which takes longer than the rest."""
        self._times.pop(name, None)


def left(name: str, rows: Iterable[dict[str, Any]]) -> int:
    """How many kills a command lacks."""
    return KILLS[name] - sum(len(row["kills"]) for row in rows if row["command"] == name)


def kill_all(args: Args, store: ResultStore[tuple[str, int], dict[str, Any]]) -> None:
    """Round by round, a chain of every command that lacks kills."""
    reference = Reference(args.out)
    while missing := [name for name in args.only if left(name, store.finished.values()) > 0]:
        for name in missing:
            number = sum(command == name for command, _ in store.finished)
            whole, times = reference.of(name)
            rng = np.random.default_rng([args.seed, list(KILLS).index(name), number])
            most = min(CHAIN, left(name, store.finished.values()))
            row = {"chain": number, **chain(name, times, args.out / f"{name}-{number}", rng, most)}
            row["differences"] = differences(content(whole), content(args.out / f"{name}-{number}"))
            store.append(row)
            if not row["kills"]:
                reference.forget(name)
            print(
                f"{name}: {len(row['kills'])} kills, ends with {row['exit_code']}, {row['differences'] or 'the same'}"
            )


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Rows as Markdown."""
    lines = ["| command | kills | of these with files in the folder | runs | differences | processes left |"]
    lines.append("|---|---|---|---|---|---|")
    for name in KILLS:
        if not (mine := [row for row in rows if row["command"] == name and row["kills"]]):
            continue
        kills = [kill for row in mine for kill in row["kills"]]
        files, left_over = sum(kill["files"] > 0 for kill in kills), sum(kill["processes_left"] for kill in kills)
        differing = sum(len(row["differences"]) + (row["exit_code"] != 0) for row in mine)
        lines.append(f"| `{name}` | {len(kills)} | {files} | {len(mine)} | {differing} | {left_over} |")
    return "\n".join(lines)


def run(args: Args) -> int:
    """Kill, compare and print the table; exit code 1 if anything differs."""
    load_what_children_share()
    described = {"seed": args.seed, "commit": source_commit(), "versions": installed_versions()}
    with ResultStore(
        args.out, described, "chains.jsonl", lambda row: (row["command"], row["chain"]), dict, dict
    ) as store:
        kill_all(args, store)
        rows = list(store.finished.values())
    print(f"\n{table(rows)}\n")
    bad = [row for row in rows if row["exit_code"] or row["differences"]]
    bad += [row for row in rows if any(kill["processes_left"] for kill in row["kills"])]
    print(f"{sum(len(row['kills']) for row in rows)} kills, {len(bad)} runs that did not end as they should")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(run(tyro.cli(Args, description=__doc__)))
