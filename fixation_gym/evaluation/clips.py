"""Pictures of failed episodes: each is run again, which gives the same episode, and six moments are kept."""

from __future__ import annotations

from collections.abc import Callable, Collection
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from fixation_gym.evaluation import workers
from fixation_gym.evaluation.failures import classify
from fixation_gym.evaluation.files import write_file
from fixation_gym.evaluation.folders import Evaluation, read_evaluation
from fixation_gym.evaluation.rollout import EpisodeKey, EpisodeResult, run_episode
from fixation_gym.evaluation.storage import folder_lock, make_folder
from fixation_gym.evaluation.trace import Trace
from fixation_gym.evaluation.video import caption, contact_sheet, jpeg, shrink
from fixation_gym.types import ImageArray

CLIPS_FOLDER = "clips"
MOMENTS = 6
_COLUMNS = 3
_FRAME_WIDTH = 400
_QUALITY = 80


def clip_file(folder: Path, scenario: str, seed: int) -> Path:
    """Where the contact sheet of an episode of the run in ``folder`` is, whether or not there is one."""
    return folder / CLIPS_FOLDER / f"{scenario}-{seed}.jpg"


def film_failures(
    folder: Path,
    keys: Collection[EpisodeKey] | None = None,
    processes: int = 1,
    backend: str = "loky",
    run: Callable[[workers.Cell], dict[str, Any]] | None = None,
) -> list[EpisodeResult]:
    """Make the contact sheets that the failed episodes of an evaluation lack.

    Args:
        folder: of a finished evaluation; must not be in use.
        keys: (scenario, seed) of the episodes asked for; None for all.
        processes: number of worker processes.
        backend: where they run, see ``workers``.
        run: films one cell; tests replace it.

    Returns:
        Episodes that came out differently, for example because of another version; they have no sheet.

    Raises:
        UsageError: if the folder cannot be used.
    """
    with folder_lock(folder):
        evaluation = read_evaluation(folder, keys)
        failed = [result for result in evaluation.results if not result.collision_free_success]
        missing = {result.key: result for result in failed if not clip_file(folder, *result.key).exists()}
        if missing:
            make_folder(folder / CLIPS_FOLDER)
        cells = [_cell(evaluation, result) for result in missing.values()]
        progress = tqdm(total=len(cells), unit="failure", dynamic_ncols=True, disable=not cells)
        films = workers.run_cells(cells, processes, backend, run or film_cell)
        different = []
        with closing(progress), closing(films):
            for film in films:
                sheet = film.pop("sheet")
                again = EpisodeResult.from_json(film)
                if again == missing[again.key]:
                    write_file(clip_file(folder, *again.key), sheet)
                else:
                    different.append(again)
                progress.update()
        workers.close_kept()
    return different


def film_cell(cell: workers.Cell) -> dict[str, Any]:
    """Run the episode of a cell and return its ``EpisodeResult`` as a dict, and its ``sheet`` as JPEG.

    The cell also has ``decisions``: numbers of the decisions to show beside the end.
    """
    cell = dict(cell)
    wanted = cell.pop("decisions")
    env, policy = workers.world(cell, render_mode="rgb_array")
    frames: list[ImageArray] = []

    def on_frame(frame: ImageArray) -> None:
        frames.append(shrink(frame, _FRAME_WIDTH))

    result = run_episode(
        env, policy, cell["seed"], on_frame, cell["scenario"], cell["policy"], filmed=set(wanted).__contains__
    )
    return {**result.to_json(), "sheet": jpeg(_sheet(result, frames, wanted), _QUALITY)}


def moments(result: EpisodeResult, trace: Trace | None) -> list[int]:
    """Decisions to show beside the end: evenly spaced, the nearest one moved to when the episode failed."""
    chosen = np.linspace(0, result.steps, MOMENTS).round().astype(int)[:-1]
    failure = classify(result, trace)
    if trace is not None and failure is not None and failure.time_s is not None:
        event = min(int(np.searchsorted(trace.time_s, failure.time_s - 1e-3)), result.steps - 1)
        if event < result.steps - 1:
            inner = 1 + int(np.argmin(np.abs(chosen[1:] - event)))
            chosen[inner] = event
    return sorted(set(chosen.tolist()))


def _cell(evaluation: Evaluation, result: EpisodeResult) -> workers.Cell:
    run = evaluation.run
    return {
        "env_id": run["env_id"],
        "scenario": result.scenario,
        "policy": result.policy,
        "seed": result.seed,
        "sensor_noise": run["sensor_noise"],
        "image_size": run["image_size"],
        "detector": run.get("detector"),
        "renderer": run.get("renderer", "mujoco"),
        "decisions": moments(result, evaluation.trace(result)),
    }


def _sheet(result: EpisodeResult, frames: list[ImageArray], decisions: list[int]) -> ImageArray:
    trace = result.trace
    assert trace is not None, "run_episode records one"
    rows = [*decisions, result.steps]
    texts = [f"{trace.time_s[row]:.1f} s  {trace.phases[row]}" for row in rows]
    return contact_sheet([caption(frame, text) for frame, text in zip(frames, texts, strict=True)], _COLUMNS)
