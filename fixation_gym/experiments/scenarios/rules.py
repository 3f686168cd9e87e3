"""The rules that are compared, and the one without motion. Knows no simulator."""

from __future__ import annotations

from typing import Literal

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.types import FloatArray, MaskArray

Rule = Literal["plane", "behind", "paper", "exact"]
RULES: tuple[Rule, ...] = ("plane", "behind", "paper", "exact")
"""In front is where the table would be nearer than the fixated object; nothing is in front; the sign of flow times
lateral velocity; the residual along the epipolar line. The first two use no motion: what they get right is what the
instances give away."""

SURFACES = ("see_through", "curved_mirror", "flat_mirror")
"""Surfaces in which something else is seen."""


def plane_front(
    T_base_cam: FloatArray, intrinsics: Intrinsics, table_height: float, inverse_distance: float
) -> MaskArray:
    """Pixels in front by the table alone: where its plane would be nearer than the fixated object.

    Whatever stands on the table is nearer than the table behind it, so this never calls in front what is not, but for
    mirror images.

    Args:
        T_base_cam: pose of the camera, shape (4, 4).
        intrinsics: of the pixels.
        table_height: in base, m.
        inverse_distance: of the fixated object along the optical axis, 1/m.

    Returns:
        Shape (h, w).
    """
    x, y = intrinsics.grid
    right, down, forward = T_base_cam[2, :3]  # how much each axis of the camera rises in base
    # Negative where the ray misses the plane, which is then not in front.
    inverse_depth = (right * x + down * y + forward) / (table_height - T_base_cam[2, 3])
    return inverse_depth > inverse_distance
