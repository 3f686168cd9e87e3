"""What any robot, real or simulated, gives to perception and takes from a policy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.floating[Any]]
"""Real numbers; float64 unless said otherwise."""
ImageArray = NDArray[np.uint8]
MaskArray = NDArray[np.bool_]
Vector = tuple[float, float, float]
"""x, y and z."""


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """One synchronised reading of camera and joints.

    Frames: ``base`` is the robot's base link; ``cam`` is the optical frame of the wrist camera (x right, y down,
    z forward). All values belong to the same instant ``time``.
    """

    time: float
    """Seconds since the episode started."""
    rgb: ImageArray
    """Wrist image, shape (H, W, 3), top-left origin."""
    joint_pos: FloatArray
    """Arm joint angles, shape (n,), rad."""
    joint_vel: FloatArray
    """Arm joint velocities, shape (n,), rad/s."""
    camera_pose: FloatArray
    """Pose of ``cam`` in ``base``, shape (7,): position in m, then unit quaternion (w, x, y, z)."""
    camera_twist: FloatArray
    """Measured twist [v, w] of the camera expressed in ``cam``, shape (6,), m/s and rad/s."""
    gripper_width: float
    """Opening between the finger pads, m."""
    target_box: FloatArray | None = None
    """Which thing is the target: x, y, width, height of a box around it in the first image, px, shape (4,)."""
    mask: MaskArray | None = None
    """Pixels of the target, shape (H, W), where somebody else finds it."""

    @classmethod
    def from_dict(cls, obs: Mapping[str, Any]) -> Observation:
        """Convert an observation of ``FixationPick-v0``.

        Raises:
            KeyError: if a key is missing, naming the missing ones.
        """
        missing = sorted({"time", "rgb", *_VECTOR_KEYS, "gripper_width"} - set(obs))
        if missing:
            raise KeyError(f"observation lacks {missing}; it needs the keys of FixationPick-v0")
        vectors = {key: np.asarray(obs[key], dtype=np.float64) for key in _VECTOR_KEYS}
        return cls(
            time=float(np.asarray(obs["time"]).item()),
            rgb=np.asarray(obs["rgb"], dtype=np.uint8),
            gripper_width=float(np.asarray(obs["gripper_width"]).item()),
            target_box=np.asarray(obs["target_box"], np.float64) if "target_box" in obs else None,
            mask=np.asarray(obs["mask"], np.bool_) if "mask" in obs else None,
            **vectors,
        )


_VECTOR_KEYS = ("joint_pos", "joint_vel", "camera_pose", "camera_twist")


@dataclass(frozen=True, slots=True, eq=False)
class Command:
    """What a policy asks of a robot for the next control period."""

    camera_twist: FloatArray
    """Desired twist [v, w] of the camera expressed in ``cam``, shape (6,), m/s and rad/s."""
    gripper: float
    """-1 opens, +1 closes."""
