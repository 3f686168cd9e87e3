"""The pictures behind a flow, for front rules that look at them themselves."""

from __future__ import annotations

from dataclasses import dataclass

from fixation_gym.perception.scratch import Float32Array
from fixation_gym.types import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Pictures:
    """Three pictures in their order, of the camera ``flow.frame_intrinsics``; the flow is at the middle one."""

    grey: tuple[Float32Array, Float32Array, Float32Array]
    """Grey levels 0..255, each of shape (H, W)."""
    T_base_cam: tuple[FloatArray, FloatArray, FloatArray]
    """Poses of the camera, each of shape (4, 4)."""
    depth: FloatArray | None = None
    """What a depth camera measured with the middle one, any size (H', W') of the same view, m; NaN where nothing. None
    without such a camera."""
