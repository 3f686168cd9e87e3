"""Run a small program of every library that people use the environments with, each in an environment of its own.

    make clients [ARGS="--only torchrl sbx"]

An environment lies in .venv/clients, sees the packages of .venv behind its own, and takes the newest release of the
library with all that it asks for. The table goes to out/clients/table.md, what the programs print beside it.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import sysconfig
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

import tyro

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
ENVIRONMENTS = ROOT / ".venv" / "clients"
INSTALL_SECONDS, RUN_SECONDS = 3600, 1800
TABLE_HEAD = ("| library | version | what | result |", "|---|---|---|---|")
TOO_NEW = "requires a different Python"


@dataclass(frozen=True)
class Client:
    """A library and the program in this folder that uses it."""

    name: str
    package: str
    """Whose version is shown."""
    requirements: tuple[str, ...]
    """What pip is asked for; nothing if .venv has it."""
    what: str
    """What the program does."""
    pip_options: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """Names the program, the environment and the log."""
        return self.name.lower().replace("-", "_")


CLIENTS = (
    Client(
        "Gymnasium",
        "gymnasium",
        ("gymnasium[other]",),
        "`check_env`, `make_vec` in one process and several, `RecordVideo` and others",
    ),
    Client("SB3", "stable-baselines3", (), "`PPO` in two processes, `SAC`, `evaluate_policy`, saved and loaded"),
    Client("sb3-contrib", "sb3-contrib", ("sb3-contrib",), "`TQC`, `RecurrentPPO`"),
    Client("sbx", "sbx-rl", ("sbx-rl",), "`SAC`, `PPO` after `FlattenObservation`: its policies take one vector"),
    Client("rl-zoo3", "rl-zoo3", ("rl-zoo3",), "`train`, `enjoy`, `record_video`"),
    Client(
        "TorchRL",
        "torchrl",
        ("torchrl",),
        "`auto_register_info_dict`, `check_env_specs`, `rollout`, `Collector`, `ReplayBuffer`",
    ),
    Client("Tianshou", "tianshou", ("tianshou",), "`PPO` after `FlattenObservation`, both vector environments"),
    Client("RLlib", "ray", ("ray[rllib]",), "`PPO` with its connector `FlattenObservations`"),
    Client("d3rlpy", "d3rlpy", ("d3rlpy",), "`CQL` off line, `SAC` on line, after `FlattenObservation`"),
    Client("Minari", "minari", ("minari[create,hdf5]",), "`DataCollector`; reads what `export` wrote"),
    Client(
        "LeRobot",
        "lerobot",
        ("lerobot[training,evaluation,diffusion]",),  # 0.4.4 has no such extras and all in it
        "`lerobot-train` (ACT, diffusion) on what `export` wrote, `lerobot-eval`",
    ),
    Client(
        "CleanRL",
        "cleanrl",
        ("cleanrl==1.2.0", "gymnasium==0.29.1"),
        "`ppo_continuous_action.py` with its Gymnasium, 0.29.1",
        # Its release asks for Python 3.10, Gym and an SB3 of 2021; the script needs none of them.
        ("--no-deps", "--ignore-requires-python"),
    ),
)


@dataclass(frozen=True)
class Options:
    """Which clients to run."""

    only: tuple[str, ...] = ()
    """Their keys, such as sb3_contrib; all by default."""
    out: Path = ROOT / "out" / "clients"
    """Folder of the table and the logs."""


def environment(client: Client, log: Path) -> Path | None:
    """The interpreter of a client's environment, made and filled if needed; None if that failed."""
    folder = ENVIRONMENTS / client.key
    python, ready = folder / "bin" / "python", folder / ".ready"
    if ready.exists():
        return python
    shutil.rmtree(folder, ignore_errors=True)
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    site = subprocess.run([python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"], **TEXT)
    ours = sysconfig.get_path("purelib")
    Path(site.stdout.strip(), "ours.pth").write_text(f"import site; site.addsitedir({ours!r})\n")
    command = [python, "-m", "pip", "install", "--quiet", *client.pip_options, *client.requirements]
    if client.requirements and run(command, log, INSTALL_SECONDS):
        return None
    ready.touch()
    return python


TEXT = {"check": True, "capture_output": True, "text": True}


def run(command: Sequence[str | Path], log: Path, seconds: float) -> str:
    """Run a command with its output in a log; what went wrong, empty if nothing did. It has an end."""
    with log.open("w") as file:
        process = subprocess.Popen(command, stdout=file, stderr=subprocess.STDOUT, start_new_session=True, cwd=ROOT)
        try:
            code = process.wait(seconds)
        except subprocess.TimeoutExpired:
            return f"not done after {seconds:.0f} s"
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
    lines = [line for line in log.read_text(errors="replace").splitlines() if line.strip()]
    return "" if code == 0 else f"exit {code}: {lines[-1][:200] if lines else 'no output'}"


def version_of(python: Path, package: str) -> str:
    """Version of a package in an environment."""
    code = f"from importlib import metadata; print(metadata.version({package!r}))"
    return subprocess.run([python, "-c", code], **TEXT).stdout.strip()


def row_of(client: Client, out: Path) -> tuple[str, bool]:
    """A line of the table, and whether the program ran."""
    log = out / f"{client.key}.log"
    python = environment(client, log)
    if python is None:
        return f"| {client.name} | - | installation | **failed**, see {log.name} |", False
    failure = run([python, HERE / f"use_{client.key}.py"], log, RUN_SECONDS)
    version = version_of(python, client.package)
    return f"| {client.name} | {version} | {client.what} | {failure or 'unchanged'} |", not failure


def newer_python_row(out: Path) -> tuple[str, bool]:
    """What pip says on a Python that NumPy 1.26 has no wheels for."""
    python = shutil.which("python3.13")
    what = "`pip install`"
    if python is None or subprocess.run([python, "-c", ""], capture_output=True).returncode:  # pyenv's may be empty
        return f"| Python 3.13 | - | {what} | not at hand |", True
    log = out / "python_3_13.log"
    run([python, "-m", "pip", "install", "--dry-run", "--no-deps", ROOT], log, INSTALL_SECONDS)
    said = next((line for line in log.read_text().splitlines() if TOO_NEW in line), None)
    result = "installed, which it should not be" if said is None else f"refused: {said.removeprefix('ERROR: ')}"
    return f"| Python | 3.13 | {what} | {result} |", said is not None


def table(rows: Iterable[str]) -> str:
    """The table as Markdown."""
    return "\n".join([*TABLE_HEAD, *rows]) + "\n"


def main(options: Options) -> int:
    """Run the programs and write the table; 1 if one failed."""
    keys = [client.key for client in CLIENTS]
    unknown = set(options.only) - set(keys)
    if unknown:
        print(f"unknown client {', '.join(sorted(unknown))}; choose of {', '.join(keys)}", file=sys.stderr)
        return 2
    options.out.mkdir(parents=True, exist_ok=True)
    print(f"fixation-gym {metadata.version('fixation-gym')}, Python {sys.version.split()[0]}\n" + table(()), end="")
    rows, good = [], True
    for client in CLIENTS:
        if not options.only or client.key in options.only:
            row, ran = row_of(client, options.out)
            print(row, flush=True)
            rows.append(row)
            good = good and ran
    if not options.only:
        row, refused = newer_python_row(options.out)
        print(row)
        rows.append(row)
        good = good and refused
    (options.out / "table.md").write_text(table(rows))
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Options)))
