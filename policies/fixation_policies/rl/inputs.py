"""What the networks see of an observation: a vector, and a view with a short memory. Pure functions on NumPy.

Training and ``Agent`` call them at every control period, so that an agent meets what it was trained on.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from fixation_gym.perception.zero_flow.evidence_map import CELLS
from fixation_gym.robots import ROBOT
from fixation_policies.rl.config import CONFIGS, Configuration

VIEWS: dict[str, str | None] = {
    "zfc": "zfc_map",
    "ways": "ways",
    "blind": None,
    "rgb": "rgb",
    "depth": "depth",
    "privileged": "true_map",
}
"""Key of the view in the observation, by the observation's name."""
PERIODS = 5
"""Control periods for which an action is held: 5 decisions per second."""
_JOINTS = ROBOT.arm.joints
STAGE = slice(_JOINTS + 13, _JOINTS + 17)
"""Of ``proprio``: stage of the manoeuvre."""

_VECTOR = _JOINTS + 21
_LEAK = 0.97
"""Share of remembered evidence that is left after a control period: it halves in a second."""
_GAIN = 0.25
"""A cell that is surely nearer fills the memory in four periods."""
_IMAGE_LEAK = 0.9
_NEARNESS_GAIN = 2.0
"""Two thirds of the target's distance, or twice it, are as near and as far as a cell of depth can say."""

Memory = NDArray[np.float32]
"""Of maps: shape (2, h, w), in [-1, 1], now and what has been seen; of ways, which the environment remembers, as they
are. Of images: grey levels, shape (6, h, w), the newest and a running mean, or (3 n, h, w), those of the last n control
periods, the newest first."""


def input_space(learner: Configuration) -> spaces.Dict:
    """Space of the networks' inputs."""
    channels: dict[str, spaces.Space[Any]] = {"vector": spaces.Box(-10.0, 10.0, (_VECTOR,), np.float32)}
    if VIEWS[learner.observation] == "rgb":
        images = learner.image_frames or 2
        channels["view"] = spaces.Box(0, 255, (3 * images, learner.image_cells, learner.image_cells), np.uint8)
    elif VIEWS[learner.observation] is not None:
        channels["view"] = spaces.Box(0, 255, (2, CELLS, CELLS), np.uint8)
    return spaces.Dict(channels)


def learner_for(space: spaces.Space[Any]) -> Configuration:
    """The plainest configuration whose observation has this space."""
    keys = space.keys() if isinstance(space, spaces.Dict) else ()
    return CONFIGS[next((name for name, key in VIEWS.items() if key in keys), "blind")]


def remember(memory: Memory | None, obs: Mapping[str, Any], learner: Configuration) -> Memory | None:
    """Memory after another observation; ``memory`` is None before the first, and always without a view.

    Of a map, or of depth, it holds the newest, centred so that unknown is 0, and evidence that adds up and fades: what
    one pair of frames says is noisy and sparse, and things leave the image as the camera comes near. Of images it holds
    the newest and a running mean, whose difference shows motion, or the last ones; before the first they were like it.
    Ways are remembered by the environment.
    """
    if "rgb" in obs:
        size = (learner.image_cells, learner.image_cells)
        image = np.moveaxis(cv2.resize(obs["rgb"], size, interpolation=cv2.INTER_AREA), 2, 0).astype(np.float32)
        if learner.image_frames:
            kept = 1 + PERIODS * (learner.image_frames - 1)
            return np.tile(image, (kept, 1, 1)) if memory is None else np.concatenate([image, memory[:-3]])
        mean = image if memory is None else _IMAGE_LEAK * memory[3:] + (1.0 - _IMAGE_LEAK) * image
        return np.concatenate([image, mean])
    if "ways" in obs:
        return 2.0 * obs["ways"] - np.float32(1.0)
    cells = _cells(obs)
    if cells is None:
        return None
    before = np.zeros_like(cells) if memory is None else memory[1:]
    return np.concatenate([cells, np.clip(_LEAK * before + _GAIN * cells, -1.0, 1.0).astype(np.float32)])


def _cells(obs: Mapping[str, Any]) -> Memory | None:
    """The newest map, or what a depth camera says in its place, shape (1, 32, 32), in [-1, 1]; above 0 is nearer."""
    if "depth" in obs:
        return nearness_cells(obs["depth"], float(obs["fixation"][3]))
    for key in ("zfc_map", "true_map"):
        if key in obs:
            return (255.0 * obs[key] - 128.0) / np.float32(127.0)
    return None


def nearness_cells(depth: NDArray[np.float32], distance_m: float) -> Memory:
    """The nearest depth of every cell against the target's distance, shape (1, 32, 32), in [-1, 1]; 0 if unknown.

    Args:
        depth: a depth camera's picture, shape (H, W), m; 0 where it says nothing.
        distance_m: of the target, m.
    """
    known = depth > 0.0
    ratio = distance_m / np.where(known, depth, 1.0)
    nearness = np.where(known, np.clip(_NEARNESS_GAIN * (ratio - 1.0), -1.0, 1.0), -np.inf)
    rows, columns = (np.arange(CELLS) * length // CELLS for length in depth.shape)
    cells = np.maximum.reduceat(np.maximum.reduceat(nearness, rows, axis=0), columns, axis=1)
    return np.where(np.isfinite(cells), cells, 0.0)[None].astype(np.float32)


def network_inputs(obs: Mapping[str, Any], memory: Memory | None, learner: Configuration) -> dict[str, NDArray[Any]]:
    """What the networks get, an element of ``input_space``, with the memory that includes the observation."""
    inputs: dict[str, NDArray[Any]] = {"vector": _vector(obs["fixation"], obs["proprio"])}
    if memory is not None:
        levels = memory if "rgb" in obs else 128.0 + 127.0 * memory
        if "rgb" in obs and learner.image_frames:
            levels = levels.reshape(-1, 3, *levels.shape[1:])[::PERIODS].reshape(-1, *levels.shape[1:])
        inputs["view"] = np.clip(np.rint(levels), 0.0, 255.0).astype(np.uint8)
    return inputs


def busy(obs: Mapping[str, Any]) -> bool:
    """Whether a manoeuvre goes on, so that actions are ignored."""
    return bool(obs["proprio"][STAGE].any())


def blind_stage(obs: Mapping[str, Any]) -> bool:
    """Whether no decision needs what is seen: all of a manoeuvre but the recovery, after which the hand looks again."""
    return bool(obs["proprio"][STAGE][:3].any())


def _vector(fixation: NDArray[np.float32], proprio: NDArray[np.float32]) -> NDArray[np.float32]:
    """Fixation and proprioception, each value of the order of 1; the stage is left out: decisions are made in none."""
    x, y, visible, distance, std = fixation
    joints, (position, axis, twist, width) = proprio[:_JOINTS], np.split(proprio[_JOINTS:], [3, 6, 12, 13])[:4]
    position = (position - (0.35, 0.0, 0.2)) / 0.2
    twist = twist / np.repeat([0.15, 0.5], 3)
    relative_std = np.log10(np.clip(std / max(distance, 1e-3), 1e-3, 1.0)) + 1.5
    values = [
        *(5.0 * x, 5.0 * y, visible, 5.0 * (distance - 0.3), 1.0 / max(distance, 0.1) - 3.0, relative_std),
        *joints / 2.0,
        *position,
        *2.0 * axis,
        *twist,
        *(width[0] / 0.04 - 1.0, np.arctan2(-axis[2], np.hypot(axis[0], axis[1])) * 2.0 - 1.5),
    ]
    # The product of the camera's bearing is what tells the way around the object from the way above it.
    return np.clip(np.array([*values, np.arctan2(axis[1], axis[0])], np.float32), -10.0, 10.0)
