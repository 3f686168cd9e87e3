"""Agent files: what an agent is as JSON, and the weights that acting needs as NumPy arrays, in one zip.

Nothing in it is executed, and nothing but NumPy is needed to read one. Files of format 1 had PyTorch's weights.
"""

from __future__ import annotations

import io
import json
import pickle
import zipfile
import zlib
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.files import write_file
from fixation_policies.rl.config import ALGORITHMS, BEST_FILE, CONFIGS, FINAL_FILE
from fixation_policies.rl.network import Weights, acting_weights, weight_shapes

FORMAT = 2
_CARD = "agent.json"
_WEIGHTS = {1: "actor.pth", FORMAT: "actor.npz"}
"""Name of the file with the weights, by format."""


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


def write_agent(path: Path, card: AgentCard, weights: Weights) -> None:
    """Write an agent, completely or not at all.

    Args:
        path: of the zip.
        card: what it is.
        weights: from ``network.acting_weights``.
    """
    actor, agent = io.BytesIO(), io.BytesIO()
    np.savez(actor, allow_pickle=False, **weights)  # pyright: ignore[reportArgumentType]
    with zipfile.ZipFile(agent, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr(_CARD, json.dumps(asdict(card), indent=2))
        file.writestr(_WEIGHTS[FORMAT], actor.getvalue())
    write_file(path, agent.getvalue())


def read_card(path: Path) -> AgentCard:
    """What the agent in a file is.

    Raises:
        UsageError: if there is no file, or it is damaged or no agent.
    """
    return _read(path)[0]


def read_agent(path: Path) -> tuple[AgentCard, Weights]:
    """Card and weights of an agent.

    Raises:
        UsageError: if there is no file, or it is damaged or no agent, or has weights of PyTorch, which is not there.
    """
    card, packed = _read(path)
    try:
        weights = _torch_weights(packed) if card.format == 1 else _numpy_weights(packed)
    except ImportError as error:
        raise UsageError(
            f"{path} is an agent of format 1, which needs the package torch: pip install 'fixation-gym[rl]'"
        ) from error
    except (RuntimeError, pickle.UnpicklingError, zipfile.BadZipFile, EOFError, ValueError, OSError) as error:
        raise _damaged(path) from error
    learner = CONFIGS[card.config]
    shapes = weight_shapes(card.algorithm, learner, 2 if learner.residual else 4)
    numbers = {name: np.asarray(weights[name]) for name in shapes if name in weights}
    found = {name: array.shape for name, array in numbers.items() if array.dtype.kind == "f"}
    if found != shapes:
        raise UsageError(f"{path} does not hold the weights of a {card.algorithm} agent; train it again")
    return card, acting_weights(card.algorithm, learner, weights)


def _numpy_weights(packed: bytes) -> Weights:
    # As a zip at once: np.load takes a single array as well, which is no agent's.
    with np.lib.npyio.NpzFile(io.BytesIO(packed), allow_pickle=False) as weights:
        return dict(weights)


def _torch_weights(packed: bytes) -> Weights:
    import torch

    weights = torch.load(io.BytesIO(packed), map_location="cpu", weights_only=True)
    if not isinstance(weights, dict) or not all(isinstance(value, torch.Tensor) for value in weights.values()):
        raise ValueError("no state dict")
    return {name: value.numpy() for name, value in weights.items()}


def _read(path: Path) -> tuple[AgentCard, bytes]:
    try:
        with zipfile.ZipFile(path) as file:
            values = json.loads(file.read(_CARD))
            present = [name for name in _WEIGHTS.values() if name in file.namelist()]
            weights = file.read(present[-1] if present else _WEIGHTS[FORMAT])
    except OSError as error:
        raise UsageError(f"cannot read the agent {path}: {error.strerror or error}") from error
    except (zipfile.BadZipFile, zlib.error, RuntimeError, KeyError, ValueError, EOFError) as error:
        raise _damaged(path) from error
    try:
        card = AgentCard(**{**values, "image_size": tuple(values["image_size"])})
        known = card.config in CONFIGS and card.algorithm in ALGORITHMS
    except (TypeError, KeyError) as error:
        raise _damaged(path) from error
    numbers = (*card.image_size, card.seed, card.decisions, card.env_steps, card.format)
    texts = (card.scenario, *card.versions, *card.versions.values()) if isinstance(card.versions, dict) else (None,)
    if not all(isinstance(number, int) for number in numbers) or not all(isinstance(text, str) for text in texts):
        raise _damaged(path)
    if len(card.image_size) != 2:
        raise _damaged(path)
    if not known or _WEIGHTS.get(card.format) not in present[-1:]:
        raise UsageError(f"{path} is an agent of another version (format {card.format}, here {FORMAT}); train it again")
    return card, weights


def _damaged(path: Path) -> UsageError:
    names = f"{BEST_FILE} and {FINAL_FILE}"
    return UsageError(f"{path} is damaged or no agent: `fixation-gym train` writes those as {names}")
