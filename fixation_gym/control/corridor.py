"""Which straight approaches to the target are free: geometry of the hand swept along the line of sight.

Used by the servo on what it has seen, by the scene sampler, so that every scene can be solved, and by the oracle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fixation_gym.robot import TOOL_IN_CAMERA
from fixation_gym.types import FloatArray, MaskArray

# Boxes around the parts of the Panda's hand, in the camera's axes (x right, y down, z forward) with the origin between
# the finger pads, m; measured on the collision meshes. The last one is the wrist, wherever the arm turns it.
_PARTS = np.array(
    [
        [[-0.067, -0.011, -0.044], [0.067, 0.011, 0.010]],  # fingers
        [[-0.104, -0.033, -0.123], [0.104, 0.033, -0.031]],  # hand
        [[-0.046, -0.084, -0.084], [0.046, -0.057, -0.058]],  # camera
        [[-0.055, -0.045, -0.152], [0.090, 0.045, -0.097]],  # flange
        [[-0.140, -0.130, -0.285], [0.075, 0.045, -0.152]],  # wrist
    ]
)
_LAST_STRETCH = 0.12
"""Length of the open-loop motion, m; before it, the target is on the camera's axis and the tool below it."""


def _swept_boxes() -> FloatArray:
    """Boxes swept by every part: on the approach, below the camera's axis, and on the last stretch, shape (n, 2, 3)."""
    last, approach = _PARTS.copy(), _PARTS.copy()
    last[:, 0, 2] -= _LAST_STRETCH
    approach[:, :, 1] += TOOL_IN_CAMERA[1]
    approach[:, 1, 2] -= _LAST_STRETCH
    approach[:, 0, 2] = -_SWEEP_LENGTH
    return np.concatenate([last, approach])


_SWEEP_LENGTH = 0.45
_BOXES = _swept_boxes()


@dataclass(frozen=True)
class Box:
    """An upright box around an object, in the robot base frame."""

    centre: FloatArray
    half_extent: FloatArray
    yaw: float

    def surface_points(self, spacing: float = 0.02) -> FloatArray:
        """Points in the box, shape (n, 3), m; ``spacing`` is below the thickness of the fingers."""
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
    local = (points @ axes.reshape(-1, 3).T).reshape(len(points), len(directions), 3)
    hit = in_corridor(local, margin)
    return np.asarray(~np.any(hit, axis=0))


def in_corridor(points: FloatArray, margin: float) -> MaskArray:
    """Tell which points the hand sweeps on its last straight way.

    Args:
        points: in the camera's axes (x right, y down, z forward) with the origin at the target, shape (..., 3), m.
        margin: extra room around the hand, m.

    Returns:
        Mask of shape (...).
    """
    hit: MaskArray = np.zeros(points.shape[:-1], dtype=np.bool_)
    x, y, z = (np.ascontiguousarray(points[..., i]) for i in range(3))
    for low, high in zip(_BOXES[:, 0] - margin, _BOXES[:, 1] + margin, strict=True):
        inside = (x > low[0]) & (x < high[0])
        inside &= (y > low[1]) & (y < high[1])
        inside &= (z > low[2]) & (z < high[2])
        np.logical_or(hit, inside, out=hit)
    return hit
