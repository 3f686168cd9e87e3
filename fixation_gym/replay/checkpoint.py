"""What a replay knows after some pictures, on the disk, so that a killed one goes on from there."""

from __future__ import annotations

import hashlib
import json
import pickle
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fixation_gym.evaluation.files import write_file
from fixation_gym.perception.distance.estimator import DistanceEstimator
from fixation_gym.perception.pipeline import Perception
from fixation_gym.recordings.recording import RecordedFrame
from fixation_gym.replay.done import Done
from fixation_gym.replay.looks import Truth

CHECKPOINT_FILE = "checkpoint.pickle"
EVERY = 100
"""Pictures from one checkpoint to the next."""


@dataclass(slots=True, eq=False)
class State:
    """All that later pictures depend on. It is one pickle, so that what is shared stays shared."""

    perception: Perception
    estimator: DistanceEstimator
    """The one that ``perception`` has."""
    done: Done
    before: Truth | None = None
    """Of the last picture."""


def fingerprint(description: Mapping[str, Any], frames: Sequence[RecordedFrame]) -> str:
    """Digest of what a replay depends on; of pictures it knows names, times and poses."""
    pictures = [(f.name, f.time, None if f.camera_pose is None else f.camera_pose.tolist()) for f in frames]
    return hashlib.sha256(json.dumps([dict(description), pictures]).encode()).hexdigest()


def save(out: Path, run: str, state: State) -> None:
    """Put a checkpoint in place of the one before.

    Raises:
        OSError: if it cannot be written.
    """
    write_file(out / CHECKPOINT_FILE, f"{run}\n".encode() + pickle.dumps(state))


def load(out: Path, run: str) -> State | None:
    """The checkpoint of the same replay; None if there is none. One of another replay is not even unpickled."""
    try:
        stored, _, state = (out / CHECKPOINT_FILE).read_bytes().partition(b"\n")
    except FileNotFoundError:
        return None
    return pickle.loads(state) if stored == run.encode() else None
