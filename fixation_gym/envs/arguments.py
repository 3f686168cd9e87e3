"""Checks of the environment's arguments, and the spaces that follow from them."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from fixation_gym.envs.depth_camera import FARTHEST_M
from fixation_gym.envs.object_pool import SLOTS
from fixation_gym.envs.pool_slots import fits_pool
from fixation_gym.envs.scene import SceneSpec
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray

WIDEST = 1.25 * ROBOT.hand.opening
"""Bound of the measured opening between the finger pads, m."""
_LONGEST_DELAY = 10.0
"""Age of the first image, at most, s."""
FREQUENCIES = (10, 20, 25, 50, 100)
"""Control steps per second that whole physics steps allow."""


def checked_image_size(image_size: Any) -> tuple[int, int] | None:
    """Return (height, width) as plain integers, or None.

    Raises:
        ValueError: if it is neither None nor two whole numbers within 32..2048.
    """
    if image_size is None:
        return None
    sizes = tuple(image_size) if isinstance(image_size, (tuple, list)) else ()
    whole = all(isinstance(size, (int, np.integer)) and not isinstance(size, bool) for size in sizes)
    if len(sizes) != 2 or not whole or not all(32 <= size <= 2048 for size in sizes):
        raise ValueError(
            f"image_size must be None or (height, width), two whole numbers within 32..2048, got {image_size!r}"
        )
    return int(sizes[0]), int(sizes[1])


def checked_frequency(frequency: Any) -> int:
    """Return a control frequency as a plain integer.

    Raises:
        ValueError: if it is none of the allowed ones.
    """
    if not isinstance(frequency, (int, float, np.number)) or frequency not in FREQUENCIES:
        raise ValueError(f"control_frequency must be 10, 20, 25, 50 or 100 Hz, got {frequency!r}")
    return int(frequency)


def checked_depth_camera(depth_camera: Any, image_size: tuple[int, int] | None) -> bool:
    """Return whether there is a depth camera.

    Raises:
        ValueError: if it is not said, or there is no image whose pixels it measures in.
    """
    if not isinstance(depth_camera, (bool, np.bool_)):
        raise ValueError(f"depth_camera must be true or false, got {depth_camera!r}")
    if depth_camera and image_size is None:
        raise ValueError("depth_camera=True needs an image_size: it measures in the pixels of the wrist image")
    return bool(depth_camera)


def require_choice(name: str, value: Any, allowed: tuple[str | None, ...]) -> None:
    """Check an argument that has a few allowed values.

    Raises:
        ValueError: for another value; the message lists the allowed ones.
    """
    if not (value is None or isinstance(value, str)) or value not in allowed:
        raise ValueError(f"{name} must be one of {', '.join(repr(choice) for choice in allowed)}, got {value!r}")


def check_rendering(render_mode: Any, render_view: Any, image_size: tuple[int, int] | None) -> None:
    """Check what ``render`` shall show.

    Raises:
        ValueError: for another value than those that are allowed, or an overlay on no image.
    """
    require_choice("render_mode", render_mode, (None, "rgb_array", "human"))
    require_choice("render_view", render_view, ("wrist", "front", "overlay"))
    if image_size is None and render_view == "overlay":
        raise ValueError('render_view="overlay" shows what perception sees, so it needs an image_size')


def checked_scene(options: dict[str, Any] | None) -> SceneSpec | None:
    """The scene among the options of a reset; None if there is none, and one is to be drawn.

    Raises:
        ValueError: if it is no scene, or the pool of bodies has no room for its obstacles.
    """
    scene = (options or {}).get("scene")
    if scene is None:
        return None
    if not isinstance(scene, SceneSpec):
        raise ValueError(f'options["scene"] must be a fixation_gym.envs.scene.SceneSpec, got {type(scene).__name__}')
    if not fits_pool(scene.obstacles):
        parts = [len(obstacle.shape.parts) for obstacle in scene.obstacles]
        raise ValueError(f"obstacles may have {', '.join(map(str, SLOTS))} parts, in any order, got {parts}")
    return scene


def checked_action(action: Any, size: int) -> FloatArray:
    """Return an action of ``size`` numbers clipped to [-1, 1].

    Raises:
        ValueError: if it has another shape or holds NaN or infinity.
    """
    values = np.asarray(action, dtype=np.float64)
    if values.shape != (size,) or not np.isfinite(values).all():
        found = values.ravel()[: size + 1].tolist()
        raise ValueError(f"action must be {size} finite numbers in [-1, 1], got shape {values.shape}: {found}")
    return np.minimum(np.maximum(values, -1.0), 1.0)  # several times as fast as np.clip on a few numbers


def limits(space: spaces.Dict) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Lowest and highest values of all vectors and images of a space."""
    return {key: (box.low, box.high) for key, box in space.items() if isinstance(box, spaces.Box)}


def within(vectors: dict[str, Any], bounds: dict[str, tuple[FloatArray, FloatArray]]) -> dict[str, FloatArray]:
    """Vectors as float32, within their bounds."""
    pairs = ((key, value, *bounds[key]) for key, value in vectors.items())
    return {key: np.minimum(np.maximum(value, low), high).astype(np.float32) for key, value, low, high in pairs}


def depth_space(image_size: tuple[int, int]) -> spaces.Box:
    """Space of a depth camera's picture of (height, width) px; m, 0 where it says nothing."""
    return spaces.Box(0.0, FARTHEST_M, image_size, np.float32)


def observation_space(image_size: tuple[int, int] | None, depth_camera: bool = False) -> spaces.Dict:
    """Observation space of ``FixationPick-v0`` with a wrist image of that size, or without; units as in its table."""

    def box(*bounds: float) -> spaces.Box:
        high = np.array(bounds, dtype=np.float32)
        return spaces.Box(-high, high, dtype=np.float32)

    image: dict[str, spaces.Space[Any]] = {}
    if image_size is not None:
        height, width = image_size
        image["rgb"] = spaces.Box(0, 255, (height, width, 3), np.uint8)
        image["image_time"] = spaces.Box(-_LONGEST_DELAY, 3600.0, (1,), np.float32)
        if depth_camera:
            image["depth"] = depth_space(image_size)
        image["target_box"] = spaces.Box(0.0, np.array([width, height] * 2, np.float32), dtype=np.float32)
    return spaces.Dict(
        image
        | {
            "joint_pos": box(*[4.0] * ROBOT.arm.joints),
            "joint_vel": box(*[10.0] * ROBOT.arm.joints),
            "gripper_width": spaces.Box(0.0, WIDEST, (1,), np.float32),
            "camera_pose": box(*[2.0] * 3, *[1.0] * 4),
            "camera_twist": box(*[5.0] * 3, *[20.0] * 3),
            "time": spaces.Box(0.0, 3600.0, (1,), np.float32),
        }
    )
