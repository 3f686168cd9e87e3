"""Recorded episodes as a data set of LeRobot, version 3.0, which ``LeRobotDataset(repo_id, root=folder)`` reads.

The layout is written here and not by LeRobot, whose releases ask for other versions of torch and OpenCV.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fixation_gym.envs.config import CONTROL_FREQUENCY, TASK
from fixation_gym.evaluation.files import write_file, write_json
from fixation_gym.export.config import ExportConfig
from fixation_gym.export.recording import CHUNK_SIZE, FLAGS, NAMES, VIDEOS, Recorded, read_numbers
from fixation_gym.perception.zero_flow.evidence_map import CELLS
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray

_VERSION = "v3.0"
_DATA_FILE, _EPISODES_FILE = "data/chunk-000/file-000.parquet", "meta/episodes/chunk-000/file-000.parquet"
_COUNTERS = {"timestamp": "float32", "frame_index": "int64", "episode_index": "int64", "index": "int64"}
_COUNTERS |= {"task_index": "int64"}


def write_dataset(folder: Path, episodes: Sequence[Recorded], config: ExportConfig) -> None:
    """Write numbers, features, statistics and the list of episodes beside the videos that are there.

    Args:
        folder: with the recordings.
        episodes: in the order of their numbers.
        config: that they were recorded with.
    """
    fps = CONTROL_FREQUENCY
    recorded = [_features_of(folder, episode.index) for episode in episodes]
    columns = {name: np.concatenate([part[name] for part in recorded]) for name in recorded[0] if ":" not in name}
    features = _features(columns, fps, config.needed_environment.image_size)
    stats = {name: _statistics(values) for name, values in columns.items() if name not in FLAGS}
    for video in VIDEOS:
        stats[video] = _picture_statistics(np.array([part[f"sums:{video}"] for part in recorded]))
    (folder / "meta").mkdir(exist_ok=True)
    _write_parquet(folder / _DATA_FILE, _frames(columns, episodes, fps))
    _write_parquet(folder / _EPISODES_FILE, _episode_rows(episodes, fps))
    _write_tasks(folder / "meta" / "tasks.parquet")
    write_json(folder / "meta" / "stats.json", stats)
    total = sum(episode.length for episode in episodes)
    info = {
        "codebase_version": _VERSION,
        "robot_type": ROBOT.simulated.robot.lower(),
        "total_episodes": len(episodes),
        "total_frames": total,
        "total_tasks": 1,
        "chunks_size": CHUNK_SIZE,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": fps,
        "splits": {"train": f"0:{len(episodes)}"},
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "video_path": "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4",
        "features": features,
    }
    write_json(folder / "meta" / "info.json", info)  # last: a reader begins with it


def _features_of(folder: Path, index: int) -> dict[str, FloatArray]:
    """What is a feature of the recording, and the sums of its pictures; the rest takes memory that is not needed."""
    return {name: values for name, values in read_numbers(folder, index).items() if not name.startswith("env:")}


def _features(columns: dict[str, FloatArray], fps: int, image_size: tuple[int, int]) -> dict[str, Any]:
    sizes = dict(zip(VIDEOS, (image_size, (CELLS, CELLS)), strict=True))
    features: dict[str, Any] = {}
    for name, (height, width) in sizes.items():
        features[name] = {
            "dtype": "video",
            "shape": [height, width, 3],
            "names": ["height", "width", "channels"],
            "info": {
                "video.height": height,
                "video.width": width,
                "video.codec": "h264",
                "video.pix_fmt": "yuv420p",
                "video.is_depth_map": False,
                "video.fps": fps,
                "video.channels": 3,
                "has_audio": False,
            },
        }
    for name, values in columns.items():
        names = NAMES.get(name) or tuple(f"action_{index}" for index in range(values.shape[1]))
        features[name] = {"dtype": "bool" if name in FLAGS else "float32", "shape": [len(names)], "names": list(names)}
    for name, dtype in _COUNTERS.items():
        features[name] = {"dtype": dtype, "shape": [1], "names": None}
    return features


def _frames(columns: dict[str, FloatArray], episodes: Sequence[Recorded], fps: int) -> dict[str, Any]:
    """One row per decision: vectors as lists, single numbers as they are."""
    lengths = [episode.length for episode in episodes]
    within = np.concatenate([np.arange(length) for length in lengths])
    rows: dict[str, Any] = {}
    for name, values in columns.items():
        single = values[:, 0] if values.shape[1] == 1 else None
        rows[name] = list(values) if single is None else single.astype(bool) if name in FLAGS else single
    rows["timestamp"] = (within / fps).astype(np.float32)
    rows["frame_index"] = within
    rows["episode_index"] = np.repeat([episode.index for episode in episodes], lengths)
    rows["index"] = np.arange(len(within))
    rows["task_index"] = np.zeros(len(within), np.int64)
    return rows


def _episode_rows(episodes: Sequence[Recorded], fps: int) -> dict[str, Any]:
    """One row per episode: where it is, and from which scene it comes."""
    ends = np.cumsum([episode.length for episode in episodes])
    count = len(episodes)
    indices = np.array([episode.index for episode in episodes])
    rows: dict[str, Any] = {
        "episode_index": indices,
        "tasks": [[TASK]] * count,
        "length": np.array([episode.length for episode in episodes]),
        "data/chunk_index": np.zeros(count, np.int64),
        "data/file_index": np.zeros(count, np.int64),
        "dataset_from_index": ends - [episode.length for episode in episodes],
        "dataset_to_index": ends,
        "meta/episodes/chunk_index": np.zeros(count, np.int64),
        "meta/episodes/file_index": np.zeros(count, np.int64),
        "scenario": [episode.scenario for episode in episodes],
        "scene_seed": np.array([episode.seed for episode in episodes]),
        "success": np.array([episode.success for episode in episodes]),
        "collision": np.array([episode.collision for episode in episodes]),
    }
    for video in VIDEOS:
        rows[f"videos/{video}/chunk_index"] = indices // CHUNK_SIZE
        rows[f"videos/{video}/file_index"] = indices % CHUNK_SIZE
        rows[f"videos/{video}/from_timestamp"] = np.zeros(count)
        rows[f"videos/{video}/to_timestamp"] = rows["length"] / fps
    return rows


def _statistics(values: FloatArray) -> dict[str, Any]:
    """What LeRobot normalises with, of each number of a feature."""
    wide = values.astype(np.float64)
    quantiles = {f"q{percent:02d}": np.percentile(wide, percent, axis=0).tolist() for percent in (1, 10, 50, 90, 99)}
    return {
        "min": wide.min(axis=0).tolist(),
        "max": wide.max(axis=0).tolist(),
        "mean": wide.mean(axis=0).tolist(),
        "std": wide.std(axis=0).tolist(),
        "count": [len(wide)],
        **quantiles,
    }


def _picture_statistics(sums: FloatArray) -> dict[str, Any]:
    """The same of the channels of a video, shape (3, 1, 1) each, from the sums of all episodes, shape (n, 5, 3)."""
    count = sums[:, 4].sum(axis=0)
    mean = sums[:, 2].sum(axis=0) / count
    std = np.sqrt(np.maximum(sums[:, 3].sum(axis=0) / count - mean**2, 0.0))
    values = {"min": sums[:, 0].min(axis=0), "max": sums[:, 1].max(axis=0), "mean": mean, "std": std}
    return {**{name: value.reshape(3, 1, 1).tolist() for name, value in values.items()}, "count": [int(count[0])]}


def _write_parquet(path: Path, rows: dict[str, Any]) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    packed = io.BytesIO()
    parquet.write_table(pa.table(rows), packed)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, packed.getvalue())


def _write_tasks(path: Path) -> None:
    import pandas as pd

    packed = io.BytesIO()
    pd.DataFrame({"task_index": [0]}, index=pd.Index([TASK])).to_parquet(packed)
    write_file(path, packed.getvalue())
