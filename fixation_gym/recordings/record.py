"""``record``: a policy's episodes in the environment as recordings in the project's own layout, with exact truth."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fixation_gym.evaluation import workers
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.evaluation.files import write_json
from fixation_gym.evaluation.missing_cells import run_missing
from fixation_gym.evaluation.source import source_commit
from fixation_gym.evaluation.storage import EPISODES_FILE, SUMMARY_FILE, ResultStore
from fixation_gym.geometry.rigid import matrix_to_pose
from fixation_gym.perception.pairing import PoseHistory
from fixation_gym.perception.scratch import Float32Array
from fixation_gym.recordings.pictures import depth_over
from fixation_gym.recordings.writer import LayoutWriter
from fixation_gym.replay.looks import Straightener
from fixation_gym.types import FloatArray, MaskArray, Observation
from fixation_policies.base import decision


@dataclass(frozen=True)
class RecordedEpisode:
    """An episode, or its beginning, that is in the folder; how it went is as of the last picture."""

    scenario: str
    seed: int
    folder: str
    """Name of its folder."""
    pictures: int
    success: bool
    collision: bool

    @property
    def key(self) -> tuple[str, int]:
        """Scenario and seed."""
        return self.scenario, self.seed


def record(config: EvaluationConfig, out: Path, seconds: float | None = None) -> dict[str, Any]:
    """Record the episodes that a folder does not have yet, each in a folder of its own.

    Args:
        config: must have passed ``check``.
        out: folder; made if needed. The same call again resumes, and more episodes come after.
        seconds: length of the recordings, from the beginning of the episodes; None: to their ends.

    Returns:
        The summary, as in ``summary.json``.

    Raises:
        UsageError: if the folder cannot be used, or holds another run.
    """
    description = {"command": "record", **config.run_description()}
    if seconds is not None:
        description["seconds"] = seconds
    cells = {key: config.cell(key) for key in config.episode_keys()}
    store = ResultStore(out, description, EPISODES_FILE, lambda episode: episode.key, _from_json, asdict)
    with store:
        resumed = run_missing(
            store,
            cells,
            partial(_record_episode, out.resolve(), math.inf if seconds is None else seconds),
            parse=_from_json,
            note=lambda episode: episode.folder,
            unit="episode",
            processes=config.workers,
            backend=config.backend,
        )
        workers.close_kept()
        episodes = [store.finished[key] for key in cells]
        summary = {
            **description,
            "recordings": [episode.folder for episode in episodes],
            "pictures": sum(episode.pictures for episode in episodes),
            "episodes_resumed": resumed,
            "commit": source_commit(),
        }
        write_json(out / SUMMARY_FILE, summary)
    return summary


def _from_json(values: Mapping[str, Any]) -> RecordedEpisode:
    return RecordedEpisode(**values)


def _record_episode(out: Path, seconds: float, cell: workers.Cell) -> dict[str, Any]:
    """Run and record the first seconds of a cell's episode, in a worker process if there are several."""
    from fixation_gym.envs.truth_view import TruthView

    env, policy = workers.world(cell)
    base: Any = env.unwrapped
    scenario, seed = cell["scenario"], cell["seed"]
    folder = f"{scenario}-{seed:06d}"
    obs, info = env.reset(seed=seed)
    policy.reset(seed)
    straightener, history = Straightener(base.intrinsics), PoseHistory()
    box = np.asarray(base.sensed["target_box"], np.float64)
    notes = {
        "source": f"fixation-gym, scenario {scenario}, seed {seed}, policy {cell['policy']}",
        "poses": f"forward kinematics with sensor noise '{cell['sensor_noise']}'",
        "truth": "rendered depth of the first surface, glass and mirrors too; its median over the target's pixels",
    }
    count, last, done = 0, -math.inf, False
    with (
        closing(TruthView(base.model, base.intrinsics)) as view,
        LayoutWriter(
            out / folder, base.intrinsics.pinhole, notes, straightener.box(box) if box.any() else None
        ) as writer,
    ):
        while not done:
            sensed = base.sensed
            history = history.with_reading(Observation.from_dict(sensed))
            stamp = float(sensed["image_time"][0])
            if stamp > last:  # not the picture of the step before
                mask, depth = _truth(view, base)
                pose, joints = _at(stamp, sensed, history)
                writer.add(stamp, straightener.image(sensed["rgb"]), pose, joints, mask, depth, depth_over(mask, depth))
                count, last = count + 1, stamp
            obs, _, terminated, truncated, info = env.step(decision(policy, obs))
            done = terminated or truncated or float(base.sensed["time"][0]) >= seconds
    outcome = bool(info["success"]), bool(info["collision"])
    return asdict(RecordedEpisode(scenario, seed, folder, count, *outcome))


def _at(stamp: float, sensed: Mapping[str, Any], history: PoseHistory) -> tuple[FloatArray, FloatArray]:
    """Camera pose (7,) at the stamp of a picture, and the joints (n,) then; none if they were read at another time."""
    if stamp == float(sensed["time"][0]):
        pose, joints = (np.asarray(sensed[name], np.float64) for name in ("camera_pose", "joint_pos"))
        return pose, joints
    return matrix_to_pose(history.at(stamp)[0]), np.full(len(sensed["joint_pos"]), math.nan)


def _truth(view: Any, base: Any) -> tuple[MaskArray, Float32Array]:
    """Pixels of the target and depth in the newest picture, without its lens, both of shape (H, W)."""
    truth = view.look(base.picture_qpos)
    owners = np.array([*(base.model.body(body).name for body in base.model.geom_bodyid), ""])  # -1: nothing
    return owners[truth.geom] == "target", truth.depth.astype(np.float32)
