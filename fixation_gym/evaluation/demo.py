"""The demonstration: a few filmed episodes, an annotated video and a contact sheet."""

from __future__ import annotations

import json
import shutil
import time
from contextlib import closing
from pathlib import Path
from typing import Any

import gymnasium
from tqdm import tqdm

from fixation_gym.errors import UsageError
from fixation_gym.evaluation import workers
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.evaluation.evaluate import summary_of
from fixation_gym.evaluation.files import write_json
from fixation_gym.evaluation.rollout import EpisodeResult, run_episode
from fixation_gym.evaluation.storage import (
    EPISODES_FILE,
    RUN_FILE,
    SUMMARY_FILE,
    EpisodeKey,
    EpisodeStore,
    check_no_folders,
    folder_lock,
    make_folder,
)
from fixation_gym.evaluation.video import VideoWriter, caption, contact_sheet, evenly_spaced, shrink, write_png
from fixation_gym.types import ImageArray
from fixation_policies.base import Policy

VIDEO_FILE = "demo.mp4"
SHEET_FILE = "contact_sheet.png"
_FILES = (RUN_FILE, EPISODES_FILE, VIDEO_FILE, SHEET_FILE, SUMMARY_FILE)
SHEET_COLUMNS = 5
SHEET_CELL_WIDTH = 480
FRAME_STRIDE = 3
"""Every third control step is filmed: two annotated views in full quality take most of the time."""
FRAMES_PER_SECOND = 25 / FRAME_STRIDE
_PART = ".demo.part"  # folder of a demonstration that is not complete yet
_SHEET_STRIDE = 2  # every second frame is kept for the sheet: enough to choose from, little memory
_OUTCOME_FRAMES = 10  # the last frame stands this long, with the outcome


def run_demo(config: EvaluationConfig, out: Path) -> dict[str, Any]:
    """Film every episode, and write video, contact sheet, episodes and summary.

    A demonstration does not resume. It replaces an earlier one in the folder once it is complete; one that fails
    leaves the folder as it was.

    Args:
        config: must have passed ``check``; workers and backend are ignored.
        out: folder; made if needed.

    Returns:
        The summary, as in ``summary.json``.

    Raises:
        UsageError: if the folder cannot be used.
    """
    started = time.monotonic()
    make_folder(out)
    with folder_lock(out):
        _check_replaceable(out)
        part = out / _PART
        shutil.rmtree(part, ignore_errors=True)  # of a demonstration that was killed
        try:
            summary = _film_all(config, part, started)
            for name in _FILES:
                (part / name).replace(out / name)
        finally:
            shutil.rmtree(part, ignore_errors=True)
    return summary


def _film_all(config: EvaluationConfig, out: Path, started: float) -> dict[str, Any]:
    """Write all files of a demonstration to a folder of its own; returns the summary."""
    run = {"command": "demo", **config.run_description()}
    sheet: list[ImageArray] = []
    progress = tqdm(total=len(config.episode_keys()), unit="episode", dynamic_ncols=True)
    with EpisodeStore(out, run) as store, closing(progress):
        with VideoWriter(out / VIDEO_FILE, FRAMES_PER_SECOND) as video:
            for scenario in config.scenarios:
                keys = [key for key in config.episode_keys() if key[0] == scenario]
                # An own environment per scenario, closed at once: each holds a GL context.
                env = workers.make_env(config.cell(keys[0]), render_mode="rgb_array", render_view="overlay")
                with closing(env):
                    policy = workers.make_policy(config.policy, env)
                    for key in keys:
                        result, frames = _film(config, key, env, policy, video)
                        store.append(result)
                        sheet += evenly_spaced(frames, SHEET_COLUMNS)
                        progress.update()
                        progress.set_postfix_str(f"{scenario}: {_outcome(result)}")
        write_png(out / SHEET_FILE, contact_sheet(sheet, SHEET_COLUMNS))
        summary = summary_of(config, list(store.finished.values()), time.monotonic() - started)
        write_json(out / SUMMARY_FILE, summary)
    return summary


def _film(
    config: EvaluationConfig, key: EpisodeKey, env: gymnasium.Env, policy: Policy, video: VideoWriter
) -> tuple[EpisodeResult, list[ImageArray]]:
    """Run one episode into the video; also returns some of its frames, the last one included."""
    scenario, seed = key
    kept: list[ImageArray] = []
    last: list[ImageArray] = []
    count = 0

    def on_frame(frame: ImageArray) -> None:
        nonlocal count
        estimate = getattr(policy, "estimate", None)
        phase = "" if estimate is None else f"   {estimate.phase}"
        text = f"{scenario}   seed {seed}   {count / FRAMES_PER_SECOND:5.1f} s{phase}"
        video.add(caption(frame, text))
        if count % _SHEET_STRIDE == 0:
            kept.append(caption(shrink(frame, SHEET_CELL_WIDTH), text))
        last[:] = [frame]
        count += 1

    result = run_episode(env, policy, seed, on_frame, scenario, config.policy, filmed=_every_stride)
    text = f"{scenario}   seed {seed}   {result.time_s:5.1f} s   {_outcome(result)}"
    for _ in range(_OUTCOME_FRAMES):
        video.add(caption(last[0], text))
    return result, [*kept, caption(shrink(last[0], SHEET_CELL_WIDTH), text)]


def _every_stride(step: int) -> bool:
    return step % FRAME_STRIDE == 0


def _outcome(result: EpisodeResult) -> str:
    outcome = "success" if result.success else "no success"
    return f"{outcome}, collision" if result.collision else outcome


def _check_replaceable(out: Path) -> None:
    """Check that a folder has no results, or those of a demonstration.

    Raises:
        UsageError: if another command's results are there, or a folder has the name of a result.
    """
    check_no_folders(out, _FILES)
    stored = [name for name in (RUN_FILE, EPISODES_FILE, SUMMARY_FILE) if (out / name).exists()]
    try:
        is_demo = json.loads((out / RUN_FILE).read_text(encoding="utf-8"))["command"] == "demo"
    except (OSError, ValueError, TypeError, KeyError):
        is_demo = False
    if stored and not is_demo:
        raise UsageError(f"{out} holds results of another command ({stored[0]}); choose another --out")
