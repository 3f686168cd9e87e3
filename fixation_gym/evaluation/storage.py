"""Result folders: one line per finished piece of work, so that a killed run resumes where it stopped.

``run.json`` says what the run is, ``episodes.jsonl`` (or another such file) has one finished piece per line,
``summary.json`` the outcome.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import tempfile
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Generic, TypeVar

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.files import UNFINISHED, write_json
from fixation_gym.evaluation.rollout import EpisodeKey, EpisodeResult
from fixation_gym.evaluation.trace import TRACES_FOLDER, trace_file, write_trace

RUN_FILE = "run.json"
EPISODES_FILE = "episodes.jsonl"
SUMMARY_FILE = "summary.json"

Key = TypeVar("Key", bound=Hashable)
Result = TypeVar("Result")
Store = TypeVar("Store", bound="ResultStore[Any, Any]")


def make_folder(folder: Path) -> None:
    """Create a folder that files can be written to.

    Raises:
        UsageError: if that is not possible.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        reason = error.strerror or str(error)
        raise UsageError(f"cannot write to the output folder {folder}: {reason}; choose another --out") from error


@contextlib.contextmanager
def folder_lock(folder: Path) -> Iterator[None]:
    """Keep every other run out of a folder, and remove what killed ones left half-written in it.

    The lock is on the folder itself, so that it leaves no file behind.

    Raises:
        UsageError: if another run has the lock, or the folder cannot be opened.
    """
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise UsageError(f"cannot open the output folder {folder}: {error.strerror}; choose another --out") from error
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise UsageError(f"{folder} is in use by another run; choose another --out") from error
        except OSError:  # network file systems may not lock folders; there the user has to take care
            pass
        _remove_unfinished(folder)
        yield
    finally:
        os.close(descriptor)


def _remove_unfinished(folder: Path) -> None:
    """Remove the files that killed processes left half-written; the folder must be locked.

    Folders below are searched only in one that holds a run, and not those that hold a run of their own.
    """
    for place, below, names in os.walk(folder):
        for name in names:
            if name.startswith(".") and name.endswith(UNFINISHED):
                (Path(place) / name).unlink(missing_ok=True)
        if RUN_FILE in names or Path(place) != folder:
            below[:] = [name for name in below if not (Path(place) / name / RUN_FILE).exists()]
        else:
            below.clear()


def check_no_folders(folder: Path, names: Iterable[str]) -> None:
    """Check that files with these names can be put into a folder, replacing files only.

    Raises:
        UsageError: naming the first that is a folder.
    """
    for name in names:
        if (folder / name).is_dir():
            raise UsageError(f"{folder / name} is a folder where a file is needed; choose another --out")


class ResultStore(Generic[Key, Result]):
    """The finished pieces of one run, in memory and in its folder. Use as a context manager.

    Attributes:
        folder: where the files are.
        finished: results by key, in the order in which they were stored.
    """

    def __init__(
        self,
        folder: Path,
        run: Mapping[str, Any],
        file: str,
        key: Callable[[Result], Key],
        from_json: Callable[[Any], Result],
        to_json: Callable[[Result], Any],
    ) -> None:
        """Start a run in a folder, or resume the one that is there.

        Args:
            folder: is made if needed.
            run: JSON-able description of everything the results depend on, except their keys.
            file: name of the file of results.
            key: tells results apart.
            from_json: makes a result of a line; raises ValueError or TypeError if the line is damaged.
            to_json: the reverse.

        Raises:
            UsageError: if the folder cannot be written, is in use, or holds another run or a damaged file.
        """
        make_folder(folder)
        self.folder = folder
        self._path, self._key, self._from_json, self._to_json = folder / file, key, from_json, to_json
        with contextlib.ExitStack() as opened:
            opened.enter_context(folder_lock(folder))
            check_no_folders(folder, (RUN_FILE, file, SUMMARY_FILE))
            try:
                _check_run(self._path, run)
                self._file = opened.enter_context(self._path.open("a+b"))
                self.finished = self._read()
                if not (folder / RUN_FILE).exists():
                    write_json(folder / RUN_FILE, dict(run))
            except OSError as error:
                raise UsageError(f"cannot use the results in {folder} ({error}); choose another --out") from error
            self._opened = opened.pop_all()

    def __enter__(self: Store) -> Store:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._opened.close()

    def append(self, result: Result) -> None:
        """Store a finished piece; it is on the disk when this returns."""
        self._file.write(json.dumps(self._to_json(result), allow_nan=False).encode() + b"\n")
        self._file.flush()
        os.fsync(self._file.fileno())
        self.finished[self._key(result)] = result

    def _read(self) -> dict[Key, Result]:
        """Read all results, and cut off a last line that a kill tore."""
        self._file.seek(0)
        finished: dict[Key, Result] = {}
        lines = self._file.read().splitlines(keepends=True)
        good = 0
        for number, line in enumerate(lines, start=1):
            result = self._parse(line)
            if result is None:
                if number == len(lines):
                    break
                raise UsageError(f"{self._path}, line {number} is damaged; choose another --out")
            finished.setdefault(self._key(result), result)
            good += len(line)
        self._file.truncate(good)
        return finished

    def _parse(self, line: bytes) -> Result | None:
        if not line.endswith(b"\n"):
            return None  # every stored line was written together with its end
        with contextlib.suppress(ValueError, TypeError):
            return self._from_json(json.loads(line))
        return None


class EpisodeStore(ResultStore[EpisodeKey, EpisodeResult]):
    """The finished episodes of one run, by (scenario, seed)."""

    def __init__(self, folder: Path, run: Mapping[str, Any]) -> None:
        """Start or resume a run; see ``ResultStore``. ``run`` leaves out scenario and seed of the episodes."""
        if (folder / TRACES_FOLDER).is_file():
            raise UsageError(f"{folder / TRACES_FOLDER} is a file where a folder is needed; choose another --out")
        super().__init__(
            folder,
            run,
            EPISODES_FILE,
            key=lambda result: result.key,
            from_json=EpisodeResult.from_json,
            to_json=EpisodeResult.to_json,
        )

    def append(self, result: EpisodeResult) -> None:
        """Store a finished episode, its trace first: whatever has a line also has its trace."""
        if result.trace is not None:
            write_trace(trace_file(self.folder, *result.key), result.trace)
        super().append(replace(result, trace=None))


def check_same_run(path: Path, run: Mapping[str, Any]) -> None:
    """Check that the run that a file describes is this one.

    Raises:
        UsageError: if the file cannot be read, or naming what differs.
    """
    try:
        stored = dict(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError) as error:
        raise UsageError(f"{path} cannot be read ({error}); choose another --out") from error
    wanted = json.loads(json.dumps(dict(run)))  # tuples become lists, as in the file
    differing = [key for key in {**stored, **wanted} if stored.get(key) != wanted.get(key)]
    if differing:
        differences = ", ".join(f"{key} {stored.get(key)} instead of {wanted.get(key)}" for key in differing)
        raise UsageError(f"{path.parent} holds another run, with {differences}; choose another --out")


def _check_run(results: Path, run: Mapping[str, Any]) -> None:
    path = results.with_name(RUN_FILE)
    if path.exists():
        check_same_run(path, run)
    elif results.exists() and results.stat().st_size > 0:
        raise UsageError(f"{path.parent} has {results.name} but no {RUN_FILE}; choose another --out")
