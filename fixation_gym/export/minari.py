"""Recorded episodes as a data set of Minari, written by Minari itself: ``minari.load_dataset(DATASET_ID)`` reads it.

Observations, actions and rewards are those of the environment, which ``recover_environment()`` makes again.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import imageio_ffmpeg
import numpy as np
from gymnasium import spaces

from fixation_gym.evaluation import workers
from fixation_gym.export.config import ExportConfig
from fixation_gym.export.recording import (
    CELLS_KEY,
    LAST_IMAGE_KEY,
    OBSERVED,
    TERMINATED_KEY,
    WRIST,
    Recorded,
    read_numbers,
    video_file,
)
from fixation_gym.perception.zero_flow.evidence_map import UNKNOWN
from fixation_gym.types import FloatArray, ImageArray

DATASET_ID = "fixation/pick-v0"
"""Of the data set in the folder that ``MINARI_DATASETS_PATH`` names."""
ROOT = "minari"
"""That folder, in the folder of the recordings."""


def write_dataset(folder: Path, episodes: Sequence[Recorded], config: ExportConfig) -> None:
    """Write all episodes; the data set has its place only once it is whole, and replaces the one that is there.

    Args:
        folder: with the recordings.
        episodes: in the order of their numbers.
        config: that they were recorded with.
    """
    from minari.dataset.minari_storage import MinariStorage  # pyright: ignore[reportMissingImports]

    place = folder / ROOT / DATASET_ID
    part = place.with_name(f"{place.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    env = workers.make_env(config.cell(config.episode_keys()[0]))
    storage = MinariStorage.new(
        part / "data",
        observation_space=env.observation_space,
        action_space=env.action_space,
        env_spec=env.spec,
        data_format="arrow",
    )
    env.close()
    about = f"Picks by the policy {config.policy} in {', '.join(config.scenarios)}."
    storage.update_metadata({"dataset_id": DATASET_ID, "minari_version": metadata.version("minari")})
    storage.update_metadata({"algorithm_name": config.policy, "description": about})
    pictures = isinstance(env.observation_space, spaces.Dict) and "rgb" in env.observation_space.spaces
    storage.update_episodes(_buffer(folder, episode, pictures) for episode in episodes)
    notes = ("scenario", "success", "collision")
    storage.update_episode_metadata({note: getattr(episode, note) for note in notes} for episode in episodes)
    shutil.rmtree(place, ignore_errors=True)
    part.replace(place)


def _buffer(folder: Path, episode: Recorded, pictures: bool) -> Any:
    """An episode as Minari takes it: one observation more than actions, and infos that go with observations."""
    from minari.data_collector import EpisodeBuffer  # pyright: ignore[reportMissingImports]

    numbers = read_numbers(folder, episode.index)
    observations: dict[str, Any] = {
        key.removeprefix(OBSERVED): numbers[key] for key in numbers if key.startswith(OBSERVED)
    }
    if pictures:
        shown = _frames(video_file(folder, WRIST, episode.index), numbers[LAST_IMAGE_KEY].shape)
        observations["rgb"] = np.array([*shown, numbers[LAST_IMAGE_KEY]], np.uint8)
    last = np.arange(episode.length) == episode.length - 1
    ended = bool(numbers[TERMINATED_KEY])
    return EpisodeBuffer(
        id=episode.index,
        seed=episode.seed,
        observations=observations,
        actions=numbers["action"],  # pyright: ignore[reportArgumentType]  (an array works; the hint leaves it out)
        rewards=numbers["next.reward"][:, 0].tolist(),
        terminations=(last & ended).tolist(),
        truncations=(last & (not ended)).tolist(),
        infos=_infos(numbers),
    )


def _infos(numbers: dict[str, FloatArray]) -> dict[str, Any]:
    """Per observation: success and collision so far, and what the policy perceived; nobody looked at the last one."""
    fixation, cells = numbers["observation.fixation"], numbers[CELLS_KEY]
    return {
        "success": [False, *numbers["next.success"][:, 0].astype(bool).tolist()],
        "collision": [False, *numbers["next.collision"][:, 0].astype(bool).tolist()],
        "fixation": np.concatenate([fixation, np.zeros_like(fixation[:1])]),
        "zero_flow_map": np.concatenate([cells, np.full_like(cells[:1], UNKNOWN)]),
    }


def _frames(video: Path, shape: tuple[int, ...]) -> Iterator[ImageArray]:
    """Frames of a video in the shape in which they were recorded; the file pads odd sizes."""
    frames = imageio_ffmpeg.read_frames(str(video))
    width, height = next(frames)["size"]  # pyright: ignore[reportArgumentType, reportCallIssue, reportIndexIssue]
    for frame in frames:
        yield np.frombuffer(frame, np.uint8).reshape(height, width, 3)[: shape[0], : shape[1]]  # pyright: ignore
