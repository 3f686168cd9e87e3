"""Checkpoints of a training run: model, replay buffer and progress, in a folder that is whole or not there."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.buffers import DictReplayBuffer
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.files import write_json

_MODEL, _REPLAY, _PROGRESS = "model.zip", "replay.npz", "progress.json"
_PREFIX, _UNFINISHED = "checkpoint-", ".unfinished"


@dataclass
class Progress:
    """How far a run has come. Changes as it goes on."""

    decisions: int = 0
    env_steps: int = 0
    """The same in control periods."""
    seconds: dict[str, float] = field(default_factory=dict)
    """Wall time by what it was spent on: "learning", "waiting" for the environments, "evaluating", "saving"."""
    curve: list[dict[str, Any]] = field(default_factory=list)
    """One entry per evaluation."""

    def spend(self, what: str, seconds: float) -> None:
        """Add wall time."""
        self.seconds[what] = self.seconds.get(what, 0.0) + seconds

    def move(self, source: str, target: str, seconds: float) -> None:
        """Count wall time that was spent on one thing for another."""
        self.spend(source, -seconds)
        self.spend(target, seconds)

    @property
    def wall_s(self) -> float:
        """All of the wall time, s."""
        return sum(self.seconds.values())


def save_checkpoint(folder: Path, model: BaseAlgorithm, progress: Progress) -> Path:
    """Add a checkpoint to a run, then remove all others.

    Raises:
        UsageError: if it cannot be written; the ones before it stay.
    """
    target = folder / f"{_PREFIX}{progress.decisions:010d}"
    unfinished = target.with_name(target.name + _UNFINISHED)
    try:
        shutil.rmtree(unfinished, ignore_errors=True)
        unfinished.mkdir()
        model.save(unfinished / _MODEL)
        if isinstance(model, OffPolicyAlgorithm):
            _save_replay(unfinished / _REPLAY, _replay_of(model))
        write_json(unfinished / _PROGRESS, asdict(progress))
        shutil.rmtree(target, ignore_errors=True)
        os.replace(unfinished, target)
    except (OSError, RuntimeError) as error:  # torch reports a failed write as a RuntimeError
        shutil.rmtree(unfinished, ignore_errors=True)
        kept = _checkpoints(folder)
        last = f"the last one, {kept[-1].name}, is intact" if kept else "there is none yet"
        raise UsageError(f"cannot write a checkpoint to {folder} ({_reason(error)}); {last}") from error
    for old in folder.glob(f"{_PREFIX}*"):  # what a kill left unfinished, too
        if old != target:
            shutil.rmtree(old, ignore_errors=True)
    return target


def latest_checkpoint(folder: Path) -> Path | None:
    """The last checkpoint of a run; None if there is none."""
    found = _checkpoints(folder)
    return found[-1] if found else None


def read_progress(checkpoint: Path) -> Progress:
    """How far a run had come.

    Raises:
        UsageError: if the checkpoint is damaged.
    """
    with _reading(checkpoint):
        return Progress(**json.loads((checkpoint / _PROGRESS).read_text(encoding="utf-8")))


def load_model(checkpoint: Path, kind: type[BaseAlgorithm], **arguments: Any) -> BaseAlgorithm:
    """The model of a checkpoint, with its replay buffer.

    Args:
        checkpoint: its folder.
        kind: SAC or PPO.
        arguments: of SB3's ``load``, such as ``env``.

    Raises:
        UsageError: if the checkpoint is damaged or was made by something else.
    """
    with _reading(checkpoint):
        model = kind.load(checkpoint / _MODEL, **arguments)
        if isinstance(model, OffPolicyAlgorithm):
            _load_replay(checkpoint / _REPLAY, _replay_of(model))
    return model


def _checkpoints(folder: Path) -> list[Path]:
    return sorted(path for path in folder.glob(f"{_PREFIX}*") if path.suffix != _UNFINISHED and path.is_dir())


@contextlib.contextmanager
def _reading(checkpoint: Path) -> Iterator[None]:
    try:
        yield
    except UsageError:
        raise
    except Exception as error:  # a damaged pickle raises anything
        raise UsageError(f"the checkpoint {checkpoint} is damaged ({_reason(error)}); choose another --out") from error


def _reason(error: BaseException) -> str:
    return (getattr(error, "strerror", None) or str(error) or type(error).__name__).splitlines()[0]


def _replay_of(model: OffPolicyAlgorithm) -> DictReplayBuffer:
    assert isinstance(model.replay_buffer, DictReplayBuffer)
    return model.replay_buffer


def _arrays(replay: DictReplayBuffer) -> dict[str, np.ndarray]:
    """All arrays of a replay buffer, views of its memory."""
    return {
        **{f"observations/{key}": array for key, array in replay.observations.items()},
        **{f"next_observations/{key}": array for key, array in replay.next_observations.items()},
        **{name: getattr(replay, name) for name in ("actions", "rewards", "dones", "timeouts")},
    }


def _save_replay(path: Path, replay: DictReplayBuffer) -> None:
    """Only what is filled: SB3's own pickle also writes, and so takes memory for, the rest."""
    used = replay.buffer_size if replay.full else replay.pos
    arrays = {name: array[:used] for name, array in _arrays(replay).items()}
    np.savez(path, allow_pickle=False, position=replay.pos, full=replay.full, **arrays)  # pyright: ignore[reportArgumentType]


def _load_replay(path: Path, replay: DictReplayBuffer) -> None:
    with np.load(path, allow_pickle=False) as stored:
        replay.pos, replay.full = int(stored["position"]), bool(stored["full"])
        for name, array in _arrays(replay).items():
            array[: len(stored[name])] = stored[name]
