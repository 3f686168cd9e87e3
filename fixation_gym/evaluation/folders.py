"""Reading the folders that ``evaluate`` writes."""

from __future__ import annotations

import json
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.rollout import EpisodeKey, EpisodeResult
from fixation_gym.evaluation.storage import EPISODES_FILE, RUN_FILE, SUMMARY_FILE
from fixation_gym.evaluation.trace import Trace, read_trace, trace_file


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A finished evaluation of one policy."""

    folder: Path
    run: dict[str, Any]
    """What the results depend on, as in ``run.json``."""
    summary: dict[str, Any]
    """As in ``summary.json``; it may leave out episodes that an earlier call with more of them left."""
    results: tuple[EpisodeResult, ...]
    """By scenario, in the order of the summary, then by seed; without traces."""

    @property
    def keys(self) -> list[EpisodeKey]:
        """(scenario, seed) of every result."""
        return [result.key for result in self.results]

    def trace(self, result: EpisodeResult) -> Trace | None:
        """The trace of one of the results, read from its file; None if the episode has none.

        Raises:
            UsageError: if the file is damaged.
        """
        return read_trace(trace_file(self.folder, *result.key))


def read_evaluation(folder: Path, keys: Collection[EpisodeKey] | None = None) -> Evaluation:
    """Read what ``evaluate`` left in a folder.

    Args:
        folder: of a finished evaluation.
        keys: (scenario, seed) of the episodes asked for; None for all, also those that an earlier call left.

    Raises:
        UsageError: if something is missing or damaged, naming it.
    """
    run = _object(folder / RUN_FILE)
    summary = _object(folder / SUMMARY_FILE)
    for name in ("policy", "sensor_noise", "image_size", "seed"):
        if name not in run:
            raise UsageError(f"{folder / RUN_FILE} lacks '{name}'; give a folder that evaluate wrote")
    if not isinstance(summary.get("scenarios"), dict):
        raise UsageError(f"{folder / SUMMARY_FILE} lacks 'scenarios'; give a folder that evaluate wrote")
    results = _episodes(folder / EPISODES_FILE)
    if keys is not None:
        wanted = set(keys)
        results = [result for result in results if result.key in wanted]
    if not results:
        raise UsageError(f"{folder / EPISODES_FILE} has no episodes")
    order = list(dict.fromkeys([*summary["scenarios"], *(result.scenario for result in results)]))
    results.sort(key=lambda result: (order.index(result.scenario), result.seed))
    return Evaluation(folder, run, summary, tuple(results))


def evaluation_folders(folders: Sequence[Path]) -> list[Path]:
    """Replace each folder that only holds folders of evaluations, as ``ablate`` leaves it, by those.

    The folder of the full servo comes first, the others by name.

    Raises:
        UsageError: without folders, or if one does not exist or has neither.
    """
    if not folders:
        raise UsageError("name one or more folders that evaluate or ablate wrote")
    found: list[Path] = []
    for folder in folders:
        if not folder.is_dir():
            raise UsageError(f"{folder} is no folder")
        if (folder / EPISODES_FILE).exists():
            found.append(folder)
            continue
        inner = sorted(path.parent for path in folder.glob(f"*/{EPISODES_FILE}"))
        if not inner:
            raise UsageError(f"{folder} has no {EPISODES_FILE}; give folders that evaluate or ablate wrote")
        found += sorted(inner, key=lambda path: path.name != "servo")
    twice = [folder for index, folder in enumerate(found) if folder.resolve() in [f.resolve() for f in found[:index]]]
    if twice:
        raise UsageError(f"{twice[0]} is given twice")
    return found


def _object(path: Path) -> dict[str, Any]:
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        reason = "it is missing" if isinstance(error, FileNotFoundError) else error.strerror
        raise UsageError(f"cannot read {path}: {reason}; is the evaluation finished?") from error
    except ValueError as error:
        raise UsageError(f"{path} is damaged ({error})") from error
    if not isinstance(value, dict):
        raise UsageError(f"{path} is damaged: it holds no JSON object")
    return value


def _episodes(path: Path) -> list[EpisodeResult]:
    try:
        lines = path.read_bytes().splitlines(keepends=True)
    except OSError as error:
        raise UsageError(f"cannot read {path}: {error.strerror}") from error
    if lines and not lines[-1].endswith(b"\n"):
        del lines[-1]  # being written, or torn by a kill
    results: dict[EpisodeKey, EpisodeResult] = {}
    for number, line in enumerate(lines, start=1):
        try:
            result = EpisodeResult.from_json(json.loads(line))
        except (ValueError, TypeError) as error:
            raise UsageError(f"{path}, line {number} is damaged") from error
        results.setdefault(result.key, result)
    return list(results.values())
