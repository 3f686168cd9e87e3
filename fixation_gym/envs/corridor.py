"""Which straight approaches to the target are free: geometry of the hand swept along the line of sight.

Used by the scene sampler, so that every scene can be solved, and by the privileged oracle policy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fixation_gym.types import FloatArray, MaskArray

# Boxes that enclose fingers, hand, camera and wrist when the finger tips are at the target, in the camera's axes
# (x right, y down, z forward) with the tips at the origin, m; they extend backwards along the whole approach.
_FINGERS = np.array([[-0.060, -0.015, -np.inf], [0.060, 0.015, 0.010]])
_HAND_AND_CAMERA = np.array([[-0.110, -0.090, -np.inf], [0.110, 0.040, -0.040]])
_WRIST = np.array([[-0.110, -0.100, -np.inf], [0.110, 0.110, -0.150]])
_SWEEP_LENGTH = 0.40


@dataclass(frozen=True)
class Box:
    """An upright box around an object, in the robot base frame."""

    centre: FloatArray
    half_extent: FloatArray
    yaw: float

    def surface_points(self, spacing: float = 0.02) -> FloatArray:
        """Points on the box surface and inside, shape (n, 3), m; ``spacing`` is well below the width of a finger."""
        axes = [np.linspace(-h, h, max(2, int(np.ceil(2.0 * h / spacing)) + 1)) for h in self.half_extent]
        local = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        return local @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) + self.centre


def approach_directions(azimuths: FloatArray, elevations: FloatArray) -> FloatArray:
    """Unit vectors from target to camera for every pair of angles, shape (n, 3), in base.

    Azimuth 0 looks along base +x (camera on the robot's side); elevation is measured from the table. Angles in rad.
    """
    azimuth, elevation = (grid.ravel() for grid in np.meshgrid(azimuths, elevations, indexing="ij"))
    return np.stack([-np.cos(elevation) * np.cos(azimuth), -np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], -1)


def free_directions(target: FloatArray, obstacles: list[Box], directions: FloatArray, margin: float) -> MaskArray:
    """Tell for each direction whether the hand can come straight in without touching an obstacle.

    Args:
        target: point the finger tips go to, shape (3,), in base, m.
        obstacles: boxes around the obstacles.
        directions: unit vectors from target to camera, shape (n, 3), in base.
        margin: extra room around the hand, m.

    Returns:
        Mask of shape (n,).
    """
    if not obstacles:
        return np.ones(len(directions), dtype=bool)
    points = np.concatenate([box.surface_points() for box in obstacles]) - target
    forward = -directions
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right, axis=-1, keepdims=True)
    down = np.cross(forward, right)
    axes = np.stack([right, down, forward], axis=1)
    local = np.einsum("dij,pj->dpi", axes, points)
    hit = np.zeros(local.shape[:2], dtype=bool)
    for low, high in (_FINGERS, _HAND_AND_CAMERA, _WRIST):
        hit |= np.all((local > low - margin) & (local < high + margin), axis=-1)
    hit &= local[..., 2] > -_SWEEP_LENGTH
    return ~hit.any(axis=-1)
