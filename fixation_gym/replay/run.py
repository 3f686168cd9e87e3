"""Run perception over a recording: a line of ``estimates.csv`` per picture, overlay video, figure and summary."""

from __future__ import annotations

import time
from collections import Counter
from contextlib import ExitStack, closing
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from tqdm import tqdm

from fixation_gym.doctor import installed_versions
from fixation_gym.errors import UsageError
from fixation_gym.evaluation.files import write_file, write_json
from fixation_gym.evaluation.source import source_commit
from fixation_gym.evaluation.storage import SUMMARY_FILE, check_no_folders, folder_lock, make_folder
from fixation_gym.evaluation.video import caption
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.distance.calibrating_estimator import CalibratingEstimator
from fixation_gym.perception.drawing import draw_overlay
from fixation_gym.perception.pipeline import Perception
from fixation_gym.perception.settings import PerceptionSettings
from fixation_gym.recordings.catalogue import open_recording
from fixation_gym.recordings.public import located
from fixation_gym.recordings.recording import RecordedFrame
from fixation_gym.recordings.stamps import OrderedFrames, in_order
from fixation_gym.replay import checkpoint
from fixation_gym.replay.alarms import alarms_on, calibration_summary, hand_eye_alarms, hand_eye_summary
from fixation_gym.replay.checkpoint import CHECKPOINT_FILE, State
from fixation_gym.replay.config import ReplayConfig
from fixation_gym.replay.done import Done
from fixation_gym.replay.estimators import chosen_estimator, hand_eye_settings, learning_settings
from fixation_gym.replay.figure import draw_distance
from fixation_gym.replay.looks import Look, Straightener, looks
from fixation_gym.replay.notes import notes_on
from fixation_gym.replay.parted_video import PartedVideo, parts_of
from fixation_gym.replay.pose_check import check_poses, corner_pairs
from fixation_gym.replay.rows import ESTIMATES_FILE, Row, RowWriter
from fixation_gym.replay.target import Target, choose_target
from fixation_gym.replay.time_offset import TimeOffset, put_right, time_offset

VIDEO_FILE, FIGURE_FILE = "overlay.mp4", "distance.png"
FILES = (ESTIMATES_FILE, VIDEO_FILE, FIGURE_FILE, SUMMARY_FILE)
_FPS = (1.0, 60.0)


def replay(config: ReplayConfig, out: Path) -> dict[str, Any]:
    """Run perception over a recording, or go on where the same replay was killed.

    Args:
        config: must have passed ``check``.
        out: folder; made if needed. A replay there that came to its end is replaced.

    Returns:
        The summary, as in ``summary.json``.

    Raises:
        UsageError: if recording or folder cannot be used. If a picture in the middle cannot, all files are written for
            those before it first.
    """
    started = time.monotonic()
    recording = open_recording(located(config.recording, config.data), config, config.reader)
    camera, pictures = recording.camera, len(recording)
    first = next(iter(recording))
    ordered = in_order(recording, str(config.recording))
    straightener = Straightener(camera)
    ordered, left_px, offset = _checked_poses(ordered, camera.pinhole, straightener)
    # After that, which may leave out the first pictures.
    target = choose_target(config, recording.target_box, ordered.frames[0], camera)
    depends_on = {**config.run_description(), "found_by": target.found_by}
    make_folder(out)
    with folder_lock(out):
        check_no_folders(out, FILES)
        provenance = {"versions": installed_versions(), "commit": source_commit()}
        run = checkpoint.fingerprint({**depends_on, **provenance}, ordered.frames)
        state = checkpoint.load(out, run) if config.resumes else None
        resumed = 0 if state is None else len(state.done.rows)
        if state is None:
            _remove_earlier(out)
            state = _begun(config, camera, target, straightener)
        error = _perceive(config, out, run, ordered, target, straightener, state)
        if state.done.rows:
            write_file(out / FIGURE_FILE, draw_distance(state.done.rows))
        summary = {
            "command": "replay",
            **depends_on,
            "pictures": pictures,
            "pictures_resumed": resumed,
            **_outcome(config, ordered, state, left_px, offset),
            "error": None if error is None else str(error),
            **provenance,
            "wall_s": time.monotonic() - started,
        }
        summary["notes"] = notes_on(summary, _is_same(ordered.frames[0], first))
        write_json(out / SUMMARY_FILE, summary)
        (out / CHECKPOINT_FILE).unlink(missing_ok=True)
    if error is not None:
        raise UsageError(f"{error}; {len(state.done.rows)} pictures before it are in {out}")
    return summary


def _begun(config: ReplayConfig, camera: Intrinsics, target: Target, straightener: Straightener) -> State:
    """What is known before the first picture."""
    estimator = chosen_estimator(config)
    settings, height = PerceptionSettings(hand_eye=hand_eye_settings(config)), config.table_height
    unseen, detector = straightener.unseen(), target.detector
    perception = Perception(camera.pinhole, settings, unseen, height, detector, estimator)
    return State(perception, estimator, Done(camera.pinhole, learning_settings(config)))


def _outcome(
    config: ReplayConfig, ordered: OrderedFrames, state: State, left_px: float | None, offset: TimeOffset | None
) -> dict[str, Any]:
    """What came out, as in the summary."""
    done, estimator, learning = state.done, state.estimator, learning_settings(config)
    gaps = ordered.gaps(PerceptionSettings().max_gap_s)
    found = estimator.calibration if isinstance(estimator, CalibratingEstimator) else None
    by_table = None if config.table_height is None else state.perception.hand_eye
    return {
        "perceived": len(done.rows),
        "duplicate_times": ordered.duplicates,
        "times_out_of_order": ordered.backwards,
        "without_pose": ordered.without_pose,
        "gaps": len(gaps),
        "longest_gap_s": max(gaps, default=0.0),
        "seen": sum(row["visible"] for row in done.rows),
        "without_map": dict(Counter(row["no_map"] for row in done.rows if row["no_map"])),
        "unexplained_px": left_px,
        "pose_delay_ms": None if offset is None else 1e3 * offset.offset_s,
        "pose_delay_std_ms": None if offset is None else 1e3 * offset.std_s,
        **done.scores(),
        "calibration": None if found is None else calibration_summary(found, learning),
        "hand_eye_by_table": None if by_table is None else hand_eye_summary(by_table),
        "alarms": [*alarms_on(found, learning, left_px, offset), *hand_eye_alarms(by_table)],
        "perception_ms": 1000.0 * median(done.seconds) if done.seconds else None,
    }


def _is_same(a: RecordedFrame, b: RecordedFrame) -> bool:
    """Whether two frames are of one picture, whatever their poses."""
    return (a.name, a.time) == (b.name, b.time)


def _checked_poses(
    ordered: OrderedFrames, camera: Intrinsics, straightener: Straightener
) -> tuple[OrderedFrames, float | None, TimeOffset | None]:
    """Frames with the poses of their own moments, what these leave unexplained, px, and how late they came."""
    pairs = corner_pairs(ordered.frames, camera, straightener.image)
    left_px, offset = check_poses(pairs, camera), time_offset(ordered.frames, pairs, camera)
    if offset is not None and offset.counts:
        ordered = put_right(ordered, offset.offset_s)
        left_px = check_poses(corner_pairs(ordered.frames, camera, straightener.image), camera)
    return ordered, left_px, offset


def _remove_earlier(out: Path) -> None:
    """Remove the files of an earlier replay.

    Raises:
        UsageError: if another command's results are there.
    """
    if (out / SUMMARY_FILE).exists() and not (out / ESTIMATES_FILE).exists():
        raise UsageError(f"{out} holds results of another command ({SUMMARY_FILE}); choose another --out")
    for path in (*(out / name for name in (*FILES, CHECKPOINT_FILE)), *parts_of(out / VIDEO_FILE)):
        path.unlink(missing_ok=True)


def _perceive(
    config: ReplayConfig,
    out: Path,
    run: str,
    ordered: OrderedFrames,
    target: Target,
    straightener: Straightener,
    state: State,
) -> UsageError | None:
    """Perceive all frames that are left; returns what was wrong with one, after which nothing more is perceived."""
    frames, done, start = ordered.frames, state.done, len(state.done.rows)
    periods = np.diff([frame.time for frame in frames]) if len(frames) > 1 else np.ones(1)
    fps = float(np.clip(1.0 / np.median(periods), *_FPS))
    progress = tqdm(total=len(frames), initial=start, unit="picture", dynamic_ncols=True)
    with ExitStack() as opened:
        opened.enter_context(closing(progress))
        rows = opened.enter_context(RowWriter(out / ESTIMATES_FILE))
        for row in done.rows:
            rows.write(row)
        video = opened.enter_context(PartedVideo(out / VIDEO_FILE, fps, start // checkpoint.EVERY))
        log = None
        if config.rerun is not None:
            from fixation_gym.replay.rerun_log import RerunLog

            log = opened.enter_context(RerunLog(config.rerun, state.perception.flow_intrinsics))
        try:
            for look in looks(frames[start:], state.perception, target, straightener, state.before):
                row = done.add(look)
                rows.write(row)
                video.add(caption(draw_overlay(look.rgb, look.percept), _caption(look, row)))
                if log is not None:
                    log.add(look)
                progress.update()
                state.before = look.truth
                if config.resumes and len(done.rows) % checkpoint.EVERY == 0 and len(done.rows) < len(frames):
                    video.end_part()  # first, so that whatever is in a checkpoint is in the parts
                    checkpoint.save(out, run, state)
        except UsageError as error:
            return error
    return None


def _caption(look: Look, row: Row) -> str:
    truth = "" if row["distance_true_m"] is None else f"   truth {100 * row['distance_true_m']:.1f} cm"
    why = f"   no map: {row['no_map']}" if row["no_map"] else ""
    return f"{look.percept.time:.2f} s   {look.name}{truth}{why}"
