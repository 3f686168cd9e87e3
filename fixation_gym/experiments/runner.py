"""What the experiments share: a resumable folder of results, and a summary of how it came about.

Each has a function ``measure(config, out, run=run_cell)`` in its ``run.py``. It runs the cells that the folder ``out``
does not have yet, writes summary, tables and figure, and returns the summary, as in ``summary.json``. ``config`` must
have passed ``check``; ``run`` runs one cell, and tests replace it. A folder that cannot be used raises ``UsageError``.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fixation_gym.doctor import installed_versions
from fixation_gym.evaluation import workers
from fixation_gym.evaluation.files import write_json
from fixation_gym.evaluation.missing_cells import run_missing
from fixation_gym.evaluation.storage import SUMMARY_FILE, ResultStore, check_no_folders

Cell = dict[str, Any]
"""One piece of work, JSON-able and picklable."""
Result = dict[str, Any]
"""What came of a cell, JSON-able; the cell's key is in it."""
Key = tuple[Any, ...]


@dataclass(frozen=True)
class Experiment:
    """How the results of an experiment are told apart, kept and shown."""

    command: str
    unit: str
    """Name of a piece of work."""
    file: str
    """Results, one per line."""
    outputs: tuple[str, ...]
    """Files that are written at the end, beside the summary."""
    key: Callable[[Cell], Key]
    """What tells the results of one run apart."""
    content: frozenset[str]
    """Names that every result has."""
    note: Callable[[Result], str]
    """What the progress bar says after a result."""
    table: Callable[[Mapping[str, Any]], str]
    """The summary as plain text."""

    @contextmanager
    def opened(
        self, out: Path, settings: Mapping[str, Any], run: Callable[[Cell], Result], processes: int
    ) -> Iterator[Folder]:
        """Keep a folder for one run, until all its files are written.

        Args:
            out: folder; made if needed.
            settings: what a result depends on, apart from its key, GL library and versions.
            run: runs one cell, in a worker process if there are several.
            processes: number of worker processes.

        Raises:
            UsageError: if the folder cannot be used.
        """
        gl = os.environ.get("MUJOCO_GL")
        description = {"command": self.command, **settings, "gl": gl, "versions": installed_versions()}
        store: ResultStore[Key, Result] = ResultStore(out, description, self.file, self.key, self._checked, dict)
        with store:
            check_no_folders(out, self.outputs)
            yield Folder(self, store, description, run, processes, time.monotonic())
        workers.close_kept()

    def show(self, summary: Mapping[str, Any], out: Path) -> int:
        """Print the table and where the files are; returns the exit code."""
        files = (out / name for name in (SUMMARY_FILE, *self.outputs))
        print(self.table(summary), "", *(file for file in files if file.exists()), sep="\n")
        return 0

    def _checked(self, value: Any) -> Result:
        """A stored result.

        Raises:
            ValueError: if something of it is missing.
        """
        if not isinstance(value, dict) or not self.content <= set(value):
            raise ValueError(f"not a result of {self.command}")
        return value


@dataclass
class Folder:
    """The results of one run, while their folder is open."""

    experiment: Experiment
    store: ResultStore[Key, Result]
    description: Mapping[str, Any]
    run: Callable[[Cell], Result]
    processes: int
    started: float
    resumed: int = 0
    """How many of the results asked for were there before."""

    def results(self, cells: Iterable[Cell]) -> list[Result]:
        """Results of cells, in their order; those that the folder does not have yet are run."""
        by_key = {self.experiment.key(cell): cell for cell in cells}
        note, unit = self.experiment.note, self.experiment.unit
        self.resumed += run_missing(self.store, by_key, self.run, dict, note, unit, self.processes)
        return [self.store.finished[key] for key in by_key]

    def write_summary(self, statistics: Mapping[str, Any], settings: Mapping[str, Any]) -> dict[str, Any]:
        """Write and return statistics, what was run and ``wall_s``, the time of this call without earlier ones."""
        summary = {**statistics, **self.description, **settings, "wall_s": time.monotonic() - self.started}
        write_json(self.store.folder / SUMMARY_FILE, summary)
        return summary
