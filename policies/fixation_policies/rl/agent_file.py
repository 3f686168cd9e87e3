"""Agent files: what an agent is as JSON, and the weights of its actor, in one zip. Nothing in it is executed."""

from __future__ import annotations

import io
import json
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.files import write_file
from fixation_policies.rl.config import ALGORITHMS, CONFIGS

FORMAT = 1
_CARD, _WEIGHTS = "agent.json", "actor.pth"


@dataclass(frozen=True)
class AgentCard:
    """What an agent is and where it comes from."""

    config: str
    """Name of its configuration."""
    algorithm: str
    image_size: tuple[int, int]
    """Height and width of the wrist image it was trained with, px."""
    scenario: str
    """What it was trained on."""
    seed: int
    decisions: int
    """What it had learned from."""
    env_steps: int
    """The same in control periods."""
    versions: dict[str, str]
    format: int = FORMAT


def write_agent(path: Path, card: AgentCard, weights: Mapping[str, Any]) -> None:
    """Write an agent, completely or not at all.

    Args:
        path: of the zip.
        card: what it is.
        weights: state dict of SAC's actor, or of PPO's policy.
    """
    import torch

    actor, agent = io.BytesIO(), io.BytesIO()
    torch.save(dict(weights), actor)
    with zipfile.ZipFile(agent, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr(_CARD, json.dumps(asdict(card), indent=2))
        file.writestr(_WEIGHTS, actor.getvalue())
    write_file(path, agent.getvalue())


def read_card(path: Path) -> AgentCard:
    """What the agent in a file is, without loading torch.

    Raises:
        UsageError: if there is no file, or it is damaged or no agent.
    """
    return _read(path)[0]


def read_agent(path: Path) -> tuple[AgentCard, dict[str, Any]]:
    """Card and weights of an agent.

    Raises:
        UsageError: if there is no file, or it is damaged or no agent.
    """
    import pickle

    import torch

    card, weights = _read(path)
    try:
        return card, torch.load(io.BytesIO(weights), map_location="cpu", weights_only=True)
    except (RuntimeError, pickle.UnpicklingError, EOFError, ValueError) as error:
        raise _damaged(path) from error


def _read(path: Path) -> tuple[AgentCard, bytes]:
    try:
        with zipfile.ZipFile(path) as file:
            values, weights = json.loads(file.read(_CARD)), file.read(_WEIGHTS)
    except OSError as error:
        raise UsageError(f"cannot read the agent {path}: {error.strerror or error}") from error
    except (zipfile.BadZipFile, zlib.error, RuntimeError, KeyError, ValueError, EOFError) as error:
        raise _damaged(path) from error
    try:
        card = AgentCard(**{**values, "image_size": tuple(values["image_size"])})
        known = card.config in CONFIGS and card.algorithm in ALGORITHMS
    except (TypeError, KeyError) as error:
        raise _damaged(path) from error
    numbers = (*card.image_size, card.seed, card.decisions, card.env_steps)
    texts = (card.scenario, *card.versions, *card.versions.values()) if isinstance(card.versions, dict) else (None,)
    if not all(isinstance(number, int) for number in numbers) or not all(isinstance(text, str) for text in texts):
        raise _damaged(path)
    if len(card.image_size) != 2:
        raise _damaged(path)
    if card.format != FORMAT or not known:
        raise UsageError(f"{path} is an agent of another version (format {card.format}, here {FORMAT}); train it again")
    return card, weights


def _damaged(path: Path) -> UsageError:
    return UsageError(f"{path} is damaged or no agent: `fixation-gym train` writes those as best.zip and final.zip")
