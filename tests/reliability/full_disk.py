"""A disk that gets full: every command ends with one sentence, and goes on when there is room again.

Every command runs once as it is, then in a file system in memory that holds a part of its results (needs root, for it
is mounted), then again with room. Its end is compared with the undisturbed result.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import tyro
from kills import ended, load_what_children_share, start
from result_folders import content, differences
from small_commands import COMMANDS, REFERENCES, SOURCES

SHARES = (0.1, 0.6)
"""Parts of the results that find room."""
_PAGE = 4096


@dataclass(frozen=True)
class Args:
    """What to run."""

    only: tuple[str, ...] = tuple(name for name in COMMANDS if name not in REFERENCES)
    """Names of commands."""
    out: Path = Path("out/full_disk")
    """Folder of the results."""


def mount(place: Path, size: int, again: bool = False) -> None:
    """Mount a file system of so many bytes, or change its size."""
    place.mkdir(parents=True, exist_ok=True)
    options = f"{'remount,' if again else ''}size={max(size // _PAGE, 2) * _PAGE}"
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(place)], check=True)


def wait(name: str, folder: Path, log: Path) -> int:
    """Exit code of a command."""
    pid, code = start(name, folder, log), None
    while code is None:
        time.sleep(0.05)
        code = ended(pid)
    return code


def run_undisturbed(name: str, out: Path) -> None:
    """Run a command whose folder is not there yet."""
    if not (out / name).exists() and wait(name, out / name, out / f"{name}.log") != 0:
        raise SystemExit(f"{name} does not end without being disturbed; see {out / name}.log")


def check(name: str, share: float, out: Path) -> str:
    """Run a command on a disk that gets full, then with room; returns what is wrong."""
    reference, place, log = out / name, out / "disk", out / f"{name}-full.log"
    log.unlink(missing_ok=True)
    mount(place, int(share * sum(path.stat().st_size for path in reference.rglob("*") if path.is_file())))
    try:
        if name in SOURCES:
            (place / SOURCES[name][1]).symlink_to(out / SOURCES[name][1])
        code = wait(name, place / name, log)
        lines = [line for line in log.read_text().replace("\r", "\n").splitlines() if "error" in line.lower()]
        print(f"{name}, room for {share:.0%}: exit code {code}; {' / '.join(lines)}")
        if code != 2 or len(lines) != 1 or "Traceback" in log.read_text():
            return f"ends with {code} and {len(lines)} lines"
        mount(place, 256 << 20, again=True)
        if (code := wait(name, place / name, log)) != 0:
            return f"does not go on with room: {code}"
        return ", ".join(differences(content(reference), content(place / name)))
    finally:
        subprocess.run(["umount", str(place)], check=True)


def run(args: Args) -> int:
    """Check all; exit code 1 if anything is wrong."""
    load_what_children_share()
    out = args.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    wrong = 0
    for name in args.only:
        if name in SOURCES and not (source := out / SOURCES[name][1]).exists():
            run_undisturbed(SOURCES[name][0], out)
            shutil.copytree(out / SOURCES[name][0], source)
        run_undisturbed(name, out)
        for share in SHARES:
            text = check(name, share, out)
            wrong += bool(text)
            print(f"{name}, room for {share:.0%}: {text or 'the same in the end'}", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(run(tyro.cli(Args, description=__doc__)))
