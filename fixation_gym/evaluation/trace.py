"""What happened in an episode step by step, small enough to keep for every episode: one ``.npz`` file, below 30 kB.

Lengths are stored as whole tenths of a millimetre in 16 bits, so they reach 3.27 m.
"""

from __future__ import annotations

import io
import json
import math
import zipfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.files import write_file
from fixation_gym.types import FloatArray, MaskArray
from fixation_policies.base import Estimate

TRACES_FOLDER = "traces"
_UNIT = 1e-4
_LARGEST = np.iinfo(np.int16).max
_NONE = np.iinfo(np.int16).min  # stands for NaN
_META = "meta"


@dataclass(frozen=True)
class SceneBox:
    """Upright box around a thing in the scene; where it stands is in the trace."""

    name: str
    """"target", or the kind of obstacle."""
    half_extent: tuple[float, float, float]
    """Half sizes, m."""
    yaw: float
    """Rotation about the vertical at the start, rad."""


class SceneReader(Protocol):
    """Truth about the scene of the running episode; see ``scene_truth``."""

    @property
    def boxes(self) -> tuple[SceneBox, ...]:
        """The target first, then the obstacles."""
        ...

    def tool_position(self) -> FloatArray:
        """Point between the finger pads in base, shape (3,), m."""
        ...

    def positions(self) -> FloatArray:
        """Centres of the boxes in base, shape (len(boxes), 3), m."""
        ...


@dataclass(frozen=True, eq=False)
class Trace:
    """One row per decision and one for the end; n rows. Positions are in base. NaN where nothing is known."""

    time_s: FloatArray
    """Time of the observation, shape (n,), s."""
    phases: tuple[str, ...]
    """What the policy said it was doing, shape (n,); "" without a policy that says so."""
    distance_m: FloatArray
    """Estimated distance, shape (n,), m."""
    distance_std_m: FloatArray
    """Its stated standard deviation, shape (n,), m."""
    distance_true_m: FloatArray
    """True depth of the target's centre, shape (n,), m."""
    clearance_m: FloatArray
    """Distance between robot and obstacles, shape (n,), m; saturates at 0.5."""
    gripper_width_m: FloatArray
    """Opening between the finger pads, shape (n,), m."""
    camera_m: FloatArray
    """Measured position of the camera, shape (n, 3), m."""
    tool_m: FloatArray
    """Point between the finger pads, shape (n, 3), m."""
    things_m: FloatArray
    """Centres of target and obstacles, in the order of ``boxes``, shape (n, k, 3), m."""
    collided: MaskArray
    """Whether there has been a collision so far, shape (n,)."""
    boxes: tuple[SceneBox, ...]
    """The target first, then the obstacles; empty if the scene is not known."""

    @property
    def target_rise_m(self) -> FloatArray:
        """Height of the target above its first place, shape (n,), m; NaN if the scene is not known."""
        if not self.boxes:
            return np.full(len(self.time_s), math.nan)
        return self.things_m[:, 0, 2] - self.things_m[0, 0, 2]


class TraceRecorder:
    """Collects the rows of one episode."""

    def __init__(self, scene: SceneReader | None) -> None:
        """Start after the environment's reset; ``scene`` is None if its truth cannot be had."""
        self._scene = scene
        self._rows: dict[str, list[Any]] = {field.name: [] for field in fields(Trace) if field.name != "boxes"}

    def add(self, obs: Mapping[str, Any], info: Mapping[str, Any], estimate: Estimate | None) -> None:
        """Add a row: an observation, what is true at its time, and what the policy made of it."""
        scene = self._scene
        row = {
            "time_s": _scalar(obs, "time"),
            "phases": "" if estimate is None else str(estimate.phase),
            "distance_m": math.nan if estimate is None else float(estimate.distance_m),
            "distance_std_m": math.nan if estimate is None else float(estimate.distance_std_m),
            "distance_true_m": float(info["distance_true_m"]),
            "clearance_m": float(info["clearance_m"]),
            "gripper_width_m": _scalar(obs, "gripper_width"),
            "camera_m": np.array(obs["camera_pose"][:3], float) if "camera_pose" in obs else np.full(3, math.nan),
            "tool_m": np.full(3, math.nan) if scene is None else scene.tool_position(),
            "things_m": np.zeros((0, 3)) if scene is None else scene.positions(),
            "collided": bool(info["collision"]),
        }
        for name, value in row.items():
            self._rows[name].append(value)

    def add_end(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Add the row of the last observation, on which the policy did not act; it stays in its last phase."""
        self.add(obs, info, None)
        if len(self._rows["phases"]) > 1:
            self._rows["phases"][-1] = self._rows["phases"][-2]

    def trace(self) -> Trace:
        """All rows so far."""
        arrays = {name: np.array(rows) for name, rows in self._rows.items() if name != "phases"}
        boxes = () if self._scene is None else self._scene.boxes
        return Trace(phases=tuple(self._rows["phases"]), boxes=boxes, **arrays)


def trace_file(folder: Path, scenario: str, seed: int) -> Path:
    """Where the trace of an episode of the run in ``folder`` is, whether or not there is one."""
    return folder / TRACES_FOLDER / f"{scenario}-{seed}.npz"


def write_trace(path: Path, trace: Trace) -> None:
    """Write a trace, completely or not at all; the same trace gives the same bytes."""
    path.parent.mkdir(exist_ok=True)
    write_file(path, _pack(trace))


def read_trace(path: Path) -> Trace | None:
    """The trace in a file; None if there is no file: episodes of older versions have none.

    Raises:
        UsageError: if the file cannot be read or holds something else.
    """
    if not path.exists():
        return None
    try:
        with np.load(path, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
        meta = json.loads(str(arrays.pop(_META)))
        names = np.array(meta["phase_names"], dtype=str)
        boxes = tuple(SceneBox(box["name"], tuple(box["half_extent"]), box["yaw"]) for box in meta["boxes"])
        phases = tuple(names[arrays.pop("phases")].tolist())
        return Trace(phases=phases, boxes=boxes, **{name: _unpacked(array) for name, array in arrays.items()})
    except (OSError, ValueError, TypeError, KeyError, IndexError, EOFError, zipfile.BadZipFile) as error:
        raise UsageError(f"{path} is no trace of an episode ({error})") from error


def _pack(trace: Trace) -> bytes:
    names, indices = np.unique(np.array(trace.phases, dtype=str), return_inverse=True)
    meta = {"phase_names": names.tolist(), "boxes": [asdict(box) for box in trace.boxes]}
    arrays: dict[str, Any] = {
        field.name: getattr(trace, field.name) for field in fields(Trace) if field.name not in ("phases", "boxes")
    }
    packed: dict[str, Any] = {
        name: _tenths_of_mm(array) if name.endswith("_m") else array for name, array in arrays.items()
    }
    packed["time_s"] = np.asarray(trace.time_s, np.float32)
    packed["phases"] = indices.reshape(-1).astype(np.uint8)
    packed[_META] = np.array(json.dumps(meta))
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **packed)
    return buffer.getvalue()


def _tenths_of_mm(lengths: FloatArray) -> np.ndarray:
    whole = np.clip(np.rint(np.asarray(lengths) / _UNIT), -_LARGEST, _LARGEST)
    return np.where(np.isnan(whole), _NONE, whole).astype(np.int16)


def _unpacked(array: np.ndarray) -> np.ndarray:
    if array.dtype != np.int16:
        return array
    return np.where(array == _NONE, np.nan, array * _UNIT)


def _scalar(obs: Mapping[str, Any], key: str) -> float:
    return float(np.asarray(obs[key]).item()) if key in obs else math.nan
