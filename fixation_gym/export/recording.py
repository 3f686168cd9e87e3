"""One episode as a recording: numbers in a file, pictures and maps as videos. Every format is written from it."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from fixation_gym.envs.zfc_observation import fixation_vector
from fixation_gym.evaluation import workers
from fixation_gym.evaluation.files import write_file
from fixation_gym.evaluation.video import VideoWriter
from fixation_gym.perception.percept import Percept
from fixation_gym.perception.zero_flow.evidence_map import CELLS, UNKNOWN
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, ImageArray
from fixation_policies.base import decision

WRIST, MAP = "observation.images.wrist", "observation.images.zero_flow_map"
VIDEOS = (WRIST, MAP)
_TWIST = ("v_X", "v_Y", "v_Z", "w_X", "w_Y", "w_Z")
NAMES: dict[str, tuple[str, ...]] = {
    "observation.state": (*(f"joint_{joint}" for joint in range(1, ROBOT.arm.joints + 1)), "gripper_width"),
    "observation.camera_pose": ("x", "y", "z", "qw", "qx", "qy", "qz"),
    "observation.camera_twist": _TWIST,
    "observation.image_time": ("s",),
    "observation.fixation": ("centroid_x", "centroid_y", "visible", "distance_m", "distance_std_m"),
    "next.reward": ("reward",),
    "next.success": ("success",),
    "next.collision": ("collision",),
    "next.done": ("done",),
}
"""What the numbers of each feature are; the action's depend on the policy."""
FLAGS = ("next.success", "next.collision", "next.done")
CELLS_KEY, TERMINATED_KEY, LAST_IMAGE_KEY = "env:cells", "env:terminated", "env:last_image"
"""Maps of all decisions, whether the task ended, and the picture after the last decision."""
OBSERVED = "env:observation:"
"""Before the keys of the environment's own observation, but for its picture: of all decisions and after the last."""
CHUNK_SIZE = 1000
"""Videos in a folder."""
_CRF = 18
"""Quality of the videos; 0 would be without loss, 23 is what films have."""


@dataclass(frozen=True)
class Recorded:
    """An episode that is in the folder."""

    index: int
    scenario: str
    seed: int
    length: int
    success: bool
    collision: bool

    @property
    def key(self) -> tuple[str, int]:
        """Scenario and seed."""
        return self.scenario, self.seed


@dataclass(frozen=True)
class _Decision:
    """What a policy had, did and got."""

    row: dict[str, Any]
    image: ImageArray
    cells: ImageArray
    observation: dict[str, Any]
    """The environment's own, without its picture."""
    following: dict[str, Any]
    following_image: ImageArray
    terminated: bool


def numbers_file(folder: Path, index: int) -> Path:
    """Where the numbers of an episode are."""
    return folder / "recorded" / f"episode-{index:06d}.npz"


def read_numbers(folder: Path, index: int) -> dict[str, FloatArray]:
    """All numbers of an episode; names with a colon are not features of LeRobot."""
    with np.load(numbers_file(folder, index)) as file:
        return dict(file)


def video_file(folder: Path, video: str, index: int) -> Path:
    """Where a video of an episode is, as LeRobot looks for it."""
    return folder / "videos" / video / f"chunk-{index // CHUNK_SIZE:03d}" / f"file-{index % CHUNK_SIZE:03d}.mp4"


def record(cell: Mapping[str, Any], folder: Path, index: int, fps: int) -> Recorded:
    """Run the episode that a cell describes, and keep it. Files have their names only once they are whole."""
    paths = [video_file(folder, name, index) for name in VIDEOS]
    for path in (*paths, numbers_file(folder, index)):
        path.parent.mkdir(parents=True, exist_ok=True)
    rows, observations, cells, last = [], [], [], None
    sums = {name: _ChannelSums() for name in VIDEOS}
    with VideoWriter(paths[0], fps, _CRF) as wrist, VideoWriter(paths[1], fps, _CRF) as maps:
        for decision in _decisions(cell):
            shown = np.asarray(cv2.cvtColor(decision.cells, cv2.COLOR_GRAY2RGB), np.uint8)
            wrist.add(decision.image)
            maps.add(shown)
            sums[WRIST].add(decision.image)
            sums[MAP].add(shown)
            rows.append(decision.row)
            observations.append(decision.observation)
            cells.append(decision.cells)
            last = decision
    assert last is not None  # no episode is without a decision
    observations.append(last.following)
    numbers = {
        **{name: np.array([row[name] for row in rows], np.float32) for name in rows[0]},
        **{OBSERVED + key: np.array([seen[key] for seen in observations]) for key in observations[0]},
        **{f"sums:{name}": sums[name].moments() for name in VIDEOS},
        CELLS_KEY: np.array(cells),
        TERMINATED_KEY: np.array(last.terminated),
        LAST_IMAGE_KEY: last.following_image,
    }
    packed = io.BytesIO()
    np.savez_compressed(packed, **numbers)  # pyright: ignore[reportArgumentType]
    write_file(numbers_file(folder, index), packed.getvalue())
    success, collision = bool(rows[-1]["next.success"][0]), bool(rows[-1]["next.collision"][0])
    return Recorded(index, cell["scenario"], cell["seed"], len(rows), success, collision)


def _decisions(cell: Mapping[str, Any]) -> Iterator[_Decision]:
    """Every decision of an episode."""
    env, policy = workers.world(dict(cell))
    base: Any = env.unwrapped
    obs, _ = env.reset(seed=cell["seed"])
    policy.reset(cell["seed"])
    done = False
    while not done:
        sensed, seen = base.sensed, _without_picture(obs)
        action = decision(policy, obs)
        percept: Percept | None = getattr(policy, "percept", None) or base.percept
        row = {
            "observation.state": [*sensed["joint_pos"], *sensed["gripper_width"]],
            "observation.camera_pose": sensed["camera_pose"],
            "observation.camera_twist": sensed["camera_twist"],
            "observation.image_time": sensed["image_time"],
            "observation.fixation": np.zeros(5) if percept is None else fixation_vector(percept.fixation),
            "action": np.array(action, np.float32),
        }
        cells = np.full((CELLS, CELLS), UNKNOWN, np.uint8) if percept is None else percept.zfc.cells.copy()
        obs, reward, terminated, truncated, info = env.step(action)
        done = terminated or truncated
        row |= {
            "next.reward": [reward],
            "next.success": [info["success"]],
            "next.collision": [info["collision"]],
            "next.done": [done],
        }
        following, following_image = _without_picture(obs), base.sensed["rgb"]
        yield _Decision(row, sensed["rgb"], cells, seen, following, following_image, bool(terminated))


def _without_picture(observation: Mapping[str, Any]) -> dict[str, Any]:
    """Pictures are kept as video."""
    return {key: value for key, value in observation.items() if key != "rgb"}


class _ChannelSums:
    """Least, largest, sum, sum of squares and count of the values of each channel, as shares of 255."""

    def __init__(self) -> None:
        self._rows = np.array([np.full(3, np.inf), np.full(3, -np.inf), *np.zeros((3, 3))])

    def add(self, image: ImageArray) -> None:
        values = image.reshape(-1, 3) / 255.0
        self._rows[0] = np.minimum(self._rows[0], values.min(axis=0))
        self._rows[1] = np.maximum(self._rows[1], values.max(axis=0))
        self._rows[2:] += [values.sum(axis=0), (values**2).sum(axis=0), np.full(3, len(values))]

    def moments(self) -> FloatArray:
        """Shape (5, 3)."""
        return self._rows
