"""The loop that all resumable runs share: do what a result folder lacks, store each piece at once, show progress."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from contextlib import closing
from typing import Any, TypeVar

from tqdm import tqdm

from fixation_gym.evaluation import workers
from fixation_gym.evaluation.storage import ResultStore

Key = TypeVar("Key", bound=Hashable)
Result = TypeVar("Result")


def run_missing(
    store: ResultStore[Key, Result],
    cells: Mapping[Key, workers.Cell],
    run: Callable[[workers.Cell], dict[str, Any]],
    parse: Callable[[dict[str, Any]], Result],
    note: Callable[[Result], str],
    unit: str,
    processes: int = 1,
    backend: str = "loky",
) -> int:
    """Run the cells whose results a store does not have yet.

    Args:
        store: an opened store; results are appended.
        cells: all cells of the run by the keys of their results.
        run: runs one cell, in a worker process if there are several.
        parse: makes a result of what ``run`` returns.
        note: what the progress bar says after a result.
        unit: name of a piece of work.
        processes: number of worker processes.
        backend: where they run, see ``workers``.

    Returns:
        Number of results that were there before.
    """
    missing = [cell for key, cell in cells.items() if key not in store.finished]
    resumed = len(cells) - len(missing)
    progress = tqdm(total=len(cells), initial=resumed, unit=unit, dynamic_ncols=True)
    with closing(progress), closing(workers.run_cells(missing, processes, backend, run)) as values:
        for result in map(parse, values):
            store.append(result)
            progress.update()
            progress.set_postfix_str(note(result))
    return resumed
