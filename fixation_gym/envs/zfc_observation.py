"""The observation of ``FixationPickZFC-v0``: what perception makes of a frame, as small arrays. Pure functions."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from fixation_gym.control.open_loop import Stage
from fixation_gym.envs.arguments import WIDEST, depth_space
from fixation_gym.perception.distance.pose_filter import Fixation
from fixation_gym.perception.zero_flow.evidence_map import CELLS
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, ImageArray, Observation

OBSERVATIONS = ("zfc", "ways", "blind", "rgb", "depth", "privileged")
"""What the learner gets beside ``fixation`` and ``proprio``."""
_STAGES = tuple(Stage)

_FIXATION = spaces.Box(
    np.array([-2.0, -2.0, 0.0, 0.0, 0.0], np.float32), np.array([2.0, 2.0, 1.0, 5.0, 5.0], np.float32)
)
_SIZES = [ROBOT.arm.joints, 3, 3, 3, 3, 1, len(_STAGES)]
_PROPRIO_HIGH = np.repeat(np.array([4.0, 2.0, 1.0, 5.0, 20.0, WIDEST, 1.0], np.float32), _SIZES)
_PROPRIO_LOW = np.repeat(np.array([-4.0, -2.0, -1.0, -5.0, -20.0, 0.0, 0.0], np.float32), _SIZES)
_PROPRIO = spaces.Box(_PROPRIO_LOW, _PROPRIO_HIGH)


def zfc_observation_space(observation: str, image_size: tuple[int, int]) -> spaces.Dict:
    """Space of the observation; ``observation`` is one of ``OBSERVATIONS``, ``image_size`` (height, width) in px."""
    cells = spaces.Box(0.0, 1.0, (1, CELLS, CELLS), np.float32)
    views: dict[str, dict[str, spaces.Space[Any]]] = {
        "zfc": {"zfc_map": cells},
        "ways": {"ways": spaces.Box(0.0, 1.0, (2, CELLS, CELLS), np.float32)},
        "blind": {},
        "rgb": {"rgb": spaces.Box(0, 255, (*image_size, 3), np.uint8)},
        "depth": {"depth": depth_space(image_size)},
        "privileged": {"true_map": cells},
    }
    return spaces.Dict({**views[observation], "fixation": _FIXATION, "proprio": _PROPRIO})


def map_levels(cells: ImageArray) -> NDArray[np.float32]:
    """A map as learners get it, shape (1, 32, 32), 0..1, from one of grey levels, shape (32, 32)."""
    return cells[None].astype(np.float32) / np.float32(255.0)


def fixation_vector(fixation: Fixation) -> NDArray[np.float32]:
    """Centroid x, y in normalised image coordinates, visible 0 or 1, distance and its std in m; shape (5,)."""
    values = [*fixation.centroid, float(fixation.visible), fixation.distance_m, fixation.distance_std_m]
    return _within(_FIXATION, values)


def proprio_vector(reading: Observation, T_base_cam: FloatArray, stage: Stage | None) -> NDArray[np.float32]:
    """What the robot knows of itself, shape (24,), in the order of the environment's table.

    Args:
        reading: of camera and joints.
        T_base_cam: its camera pose, shape (4, 4).
        stage: of the open-loop manoeuvre that will ignore the next action; None if that action counts.
    """
    return _within(
        _PROPRIO,
        [
            *reading.joint_pos,
            *T_base_cam[:3, 3],
            *T_base_cam[:3, 2],
            *reading.camera_twist,
            reading.gripper_width,
            *(float(stage is known) for known in _STAGES),
        ],
    )


def _within(box: spaces.Box, values: list[float]) -> NDArray[np.float32]:
    return np.clip(np.array(values, np.float32), box.low, box.high)
