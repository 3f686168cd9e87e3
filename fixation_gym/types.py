"""What any robot, real or simulated, gives to perception and takes from a policy."""

from __future__ import annotations

import math
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
    z forward). All values belong to the same instant ``time``, but for an image with an ``image_time``.
    """

    time: float
    """Seconds since the episode started."""
    rgb: ImageArray
    """Image of the camera, shape (H, W, 3), or (H, W) if it is grey; top-left origin."""
    joint_pos: FloatArray
    """Arm joint angles, shape (n,), rad; n is 0 for a camera without an arm."""
    joint_vel: FloatArray
    """Arm joint velocities, shape (n,), rad/s."""
    camera_pose: FloatArray
    """Pose of ``cam`` in ``base``, shape (7,): position in m, then unit quaternion (w, x, y, z)."""
    camera_twist: FloatArray
    """Measured twist [v, w] of the camera expressed in ``cam``, shape (6,), m/s and rad/s; NaN: it follows from poses.
    """
    gripper_width: float
    """Opening between the finger pads, m; NaN without a gripper."""
    target_box: FloatArray | None = None
    """Which thing is the target: x, y, width, height of a box around it in the first image, px, shape (4,)."""
    mask: MaskArray | None = None
    """Pixels of the target, shape (H, W), where somebody else finds it."""
    image_time: float | None = None
    """When the image was taken, as its stamp says, s; None: at ``time``."""
    depth: FloatArray | None = None
    """What a depth camera measured with the image, along the optical axis, in the pixels of the pinhole, shape (H, W),
    m; NaN where nothing. None without such a camera."""

    @classmethod
    def of_camera(
        cls,
        time: float,
        rgb: ImageArray,
        camera_pose: FloatArray,
        target_box: FloatArray | None = None,
        mask: MaskArray | None = None,
    ) -> Observation:
        """What a camera gives that is moved by anything whose pose is known: all that perception needs."""
        return cls(time, rgb, np.zeros(0), np.zeros(0), camera_pose, np.full(6, math.nan), math.nan, target_box, mask)

    @classmethod
    def from_dict(cls, obs: Mapping[str, Any]) -> Observation:
        """Convert an observation of ``FixationPick-v0``.

        Raises:
            ValueError: if a key is missing or has a value of another shape or kind; the message names it.
        """
        missing = sorted({"time", "rgb", *_VECTOR_KEYS, "gripper_width"} - set(obs))
        if missing:
            raise ValueError(f"observation lacks {missing}; it needs the keys of FixationPick-v0")
        vectors = {key: _numbers(obs, key, *shape) for key, shape in _VECTOR_KEYS.items()}
        if vectors["joint_pos"].shape != vectors["joint_vel"].shape:
            raise ValueError("observation has joint_pos and joint_vel of different lengths")
        rgb = np.asarray(obs["rgb"])
        if rgb.dtype != np.uint8 or rgb.ndim != 3 or rgb.shape[2] != 3:
            raise ValueError(f"observation rgb must be uint8 of shape (H, W, 3), got {rgb.dtype} of shape {rgb.shape}")
        depth = np.asarray(obs["depth"]) if "depth" in obs else None
        if depth is not None and (depth.dtype.kind not in "fiu" or depth.shape != rgb.shape[:2]):
            raise ValueError(f"observation depth must be a number per pixel of rgb, shape {rgb.shape[:2]}")
        mask = np.asarray(obs["mask"]) if "mask" in obs else None
        if mask is not None and (mask.dtype.kind not in "bui" or mask.shape != rgb.shape[:2]):
            raise ValueError(f"observation mask must be true or false per pixel of rgb, shape {rgb.shape[:2]}")
        return cls(
            time=float(_numbers(obs, "time", 1)[0]),
            rgb=rgb,
            gripper_width=float(_numbers(obs, "gripper_width", 1)[0]),
            target_box=_numbers(obs, "target_box", 4) if "target_box" in obs else None,
            image_time=float(_numbers(obs, "image_time", 1)[0]) if "image_time" in obs else None,
            mask=None if mask is None else mask.astype(np.bool_),
            depth=None if depth is None else np.where(depth > 0, depth, math.nan),
            **vectors,
        )


_VECTOR_KEYS: dict[str, tuple[int, ...]] = {"joint_pos": (), "joint_vel": (), "camera_pose": (7,), "camera_twist": (6,)}
"""Their lengths; an arm has as many joints as it has."""


def _numbers(obs: Mapping[str, Any], key: str, length: int | None = None) -> FloatArray:
    """A finite vector of an observation; a single number is one of length 1."""
    values = np.asarray(obs[key])
    if length == 1 and values.size == 1:
        values = values.reshape(1)
    numbers = values.dtype.kind in "fiu"
    if not numbers or values.ndim != 1 or (length is not None and len(values) != length):
        wanted = "a vector of" if length is None else str(length)
        found = f"{values.dtype} of shape {values.shape}"
        raise ValueError(f"observation {key} must be {wanted} finite numbers, got {found}")
    if not np.isfinite(values).all():
        raise ValueError(f"observation {key} must be finite, got {values.tolist()}")
    return values.astype(np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Command:
    """What a policy asks of a robot for the next control period."""

    camera_twist: FloatArray
    """Desired twist [v, w] of the camera expressed in ``cam``, shape (6,), m/s and rad/s."""
    gripper: float
    """Below 0 opens, above 0 closes, 0: the fingers stay as they are."""
