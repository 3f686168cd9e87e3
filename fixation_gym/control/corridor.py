"""Which straight approaches to the target are free: geometry of the hand swept along the line of sight.

Used by the servo on what it has seen, by the scene sampler, so that every scene can be solved, and by the oracle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache

import numpy as np

from fixation_gym.compiled import compiled
from fixation_gym.control.box_tests import Aligned, aligned, any_meets
from fixation_gym.geometry.boxes import Box, BoxSet, box_set
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, MaskArray

_PARTS = ROBOT.hand.parts
_MIDDLES, _HALVES = 0.5 * (_PARTS[:, 0] + _PARTS[:, 1]), 0.5 * (_PARTS[:, 1] - _PARTS[:, 0])
"""Centres and half sizes of the boxes around the parts of the hand, shape (n, 3), from the tool's point, m."""
_LAST_STRETCH = 0.12
"""Length of the open-loop motion, m; before it, the target is on the camera's axis and the tool below it."""


def near_hand(points: FloatArray, margin: float) -> MaskArray:
    """Which points, shape (n, 3), in ``cam``, m, are within about ``margin`` m of the hand, shape (n,)."""
    beyond = np.abs(points[:, None] - ROBOT.tool_in_camera - _MIDDLES) - _HALVES
    return np.any(np.all(beyond < margin, axis=-1), axis=-1)


def _swept_boxes(parts: FloatArray) -> FloatArray:
    """Boxes swept by parts: on the approach, below the camera's axis, and on the last stretch, shape (n, 2, 3)."""
    last, approach = parts.copy(), parts.copy()
    last[:, 0, 2] -= _LAST_STRETCH
    approach[:, :, 1] += ROBOT.tool_in_camera[1]
    approach[:, 1, 2] -= _LAST_STRETCH
    approach[:, 0, 2] = -_SWEEP_LENGTH
    return np.concatenate([last, approach])


_SWEEP_LENGTH = 0.45
_BOXES, _SOLID_BOXES = _swept_boxes(_PARTS), _swept_boxes(_PARTS[:-1])


def approach_directions(azimuths: FloatArray, elevations: FloatArray) -> FloatArray:
    """Unit vectors from target to camera for every pair of angles, shape (n, 3), in base.

    Azimuth 0 looks along base +x (camera on the robot's side); elevation is measured from the table. Angles in rad.
    """
    azimuth, elevation = (grid.ravel() for grid in np.meshgrid(azimuths, elevations, indexing="ij"))
    return np.stack([-np.cos(elevation) * np.cos(azimuth), -np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], -1)


def free_directions(
    target: FloatArray,
    obstacles: Sequence[Box] | BoxSet,
    directions: FloatArray,
    margin: float,
    rolls: FloatArray | None = None,
) -> MaskArray:
    """Tell for each direction whether the hand can come straight in without touching an obstacle.

    Args:
        target: point the finger tips go to, shape (3,), in base, m.
        obstacles: boxes around the obstacles.
        directions: unit vectors from target to camera, shape (n, 3), in base.
        margin: extra room around the hand, m.
        rolls: how far the hand is turned about its approach axis, clockwise seen from it, shape (n,), rad; None: level.

    Returns:
        Mask of shape (n,).
    """
    boxes = obstacles if isinstance(obstacles, BoxSet) else box_set(obstacles)
    return np.asarray(~any_meets(target, hand_axes(directions, rolls), boxes, swept_hand(margin)))


def hand_axes(directions: FloatArray, rolls: FloatArray | None = None) -> FloatArray:
    """Rows x, y, z of cameras that look against the directions, shape (n, 3, 3): level, or turned by ``rolls``, (n,).

    A roll is clockwise, seen along the approach, in rad.
    """
    axes = level_axes(directions)
    if rolls is None:
        return axes
    c, s = np.cos(rolls)[:, None], np.sin(rolls)[:, None]
    right, down = axes[:, 0], axes[:, 1]
    return np.stack([c * right + s * down, c * down - s * right, axes[:, 2]], axis=1)


def in_corridor(points: FloatArray, margin: float) -> MaskArray:
    """Tell which points the hand sweeps on its last straight way.

    Args:
        points: in the camera's axes (x right, y down, z forward) with the origin at the target, shape (..., 3), m.
        margin: extra room around the hand, m.

    Returns:
        Mask of shape (...).
    """
    flat = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
    hand = swept_hand(margin)
    return np.asarray(_any_holds(flat, hand.centres, hand.halves).reshape(points.shape[:-1]))


@cache
def swept_hand(margin: float, wrist: bool = True) -> Aligned:
    """Boxes swept on a straight way, widened by a margin, m.

    Without the wrist they are of what the hand is sure to fill; the wrist's box holds it however the arm turns it.
    """
    boxes = _BOXES if wrist else _SOLID_BOXES
    return aligned(0.5 * (boxes[:, 0] + boxes[:, 1]), 0.5 * (boxes[:, 1] - boxes[:, 0]) + margin)


def level_axes(directions: FloatArray) -> FloatArray:
    """Rows x (right), y (down), z (forward) of level cameras that look against the directions, shape (n, 3, 3)."""
    return _level_axes(np.ascontiguousarray(directions, dtype=np.float64))


@compiled
def _level_axes(directions: FloatArray) -> FloatArray:
    axes = np.zeros((len(directions), 3, 3))
    for i in range(len(directions)):
        x, y, z = -directions[i, 0], -directions[i, 1], -directions[i, 2]
        length = math.hypot(x, y)
        right_x, right_y = y / length, -x / length  # forward x up
        axes[i, 0, 0], axes[i, 0, 1] = right_x, right_y
        # forward x right
        axes[i, 1, 0], axes[i, 1, 1], axes[i, 1, 2] = -z * right_y, z * right_x, x * right_y - y * right_x
        axes[i, 2, 0], axes[i, 2, 1], axes[i, 2, 2] = x, y, z
    return axes


@compiled
def _any_holds(points: FloatArray, centres: FloatArray, halves: FloatArray) -> MaskArray:
    """Which points, shape (n, 3), are inside one of the aligned boxes."""
    inside = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        for box in range(len(centres)):
            held = True
            for axis in range(3):
                held &= abs(points[i, axis] - centres[box, axis]) < halves[box, axis]
            if held:
                inside[i] = True
                break
    return inside


def hand_boxes(T_base_cam: FloatArray) -> BoxSet:
    """Boxes around the parts of the hand of a camera at a pose, shape (4, 4)."""
    rotation = T_base_cam[:3, :3]
    tool = T_base_cam[:3, 3] + rotation @ ROBOT.tool_in_camera
    return BoxSet(tool + _MIDDLES @ rotation.T, np.repeat(rotation[None], len(_MIDDLES), axis=0), _HALVES)
