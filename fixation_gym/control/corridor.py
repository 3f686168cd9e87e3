"""Which straight approaches to the target are free: geometry of the hand swept along the line of sight.

Used by the servo on what it has seen, by the scene sampler, so that every scene can be solved, and by the oracle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fixation_gym.geometry.boxes import Box, BoxSet, box_set, joined
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
    return np.asarray(~any_meets(target, hand_axes(directions, rolls), *boxes, *swept_hand(margin)))


def barred_directions(target: FloatArray, obstacles: BoxSet, directions: FloatArray, depth: float) -> MaskArray:
    """Tell for each direction whether a hand that comes straight in surely touches an obstacle.

    Between free and barred are the ways on which it depends on the wrist's turn, or on millimetres.

    Args:
        target: point the finger tips go to, shape (3,), in base, m.
        obstacles: boxes around the obstacles.
        directions: unit vectors from target to camera, shape (n, 3), in base.
        depth: by which the hand is taken to be smaller than it is, m.

    Returns:
        Mask of shape (n,).
    """
    return any_meets(target, hand_axes(directions), *obstacles, *swept_hand(-depth, wrist=False))


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
    return np.asarray(_any_holds(flat, *swept_hand(margin)).reshape(points.shape[:-1]))


def swept_hand(margin: float, wrist: bool = True) -> tuple[FloatArray, FloatArray]:
    """Centres and half sizes of the boxes swept on a straight way, widened by a margin; each of shape (n, 3), m.

    Without the wrist they are of what the hand is sure to fill; the wrist's box holds it however the arm turns it.
    """
    boxes = _BOXES if wrist else _SOLID_BOXES
    return 0.5 * (boxes[:, 0] + boxes[:, 1]), 0.5 * (boxes[:, 1] - boxes[:, 0]) + margin


def level_axes(directions: FloatArray) -> FloatArray:
    """Rows x (right), y (down), z (forward) of level cameras that look against the directions, shape (n, 3, 3)."""
    x, y, z = -directions.T
    length = np.hypot(x, y)
    right_x, right_y = y / length, -x / length  # forward x up
    down = (-z * right_y, z * right_x, x * right_y - y * right_x)  # forward x right
    rows = (right_x, right_y, np.zeros_like(x), *down, x, y, z)
    return np.stack(rows, axis=1).reshape(-1, 3, 3)


@njit(cache=True)
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


@njit(cache=True)
def _length(vector: FloatArray) -> float:
    return math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)


@njit(cache=True)
def _turn(axes: FloatArray, place: FloatArray, origin: FloatArray, out: FloatArray) -> None:
    """A place in the frame at ``origin`` whose axes are the rows of ``axes``."""
    for k in range(3):
        out[k] = 0.0
        for axis in range(3):
            out[k] += axes[k, axis] * (place[axis] - origin[axis])


@njit(cache=True)
def _multiply(first: FloatArray, second: FloatArray, out: FloatArray) -> None:
    for k in range(3):
        for axis in range(3):
            out[k, axis] = 0.0
            for m in range(3):
                out[k, axis] += first[k, m] * second[m, axis]


@njit(cache=True)
def _is_outside(place: FloatArray, low: FloatArray, high: FloatArray, margin: float) -> bool:
    outside = False
    for k in range(3):
        outside |= place[k] < low[k] - margin or place[k] > high[k] + margin
    return outside


@njit(cache=True)
def any_meets(
    target: FloatArray,
    axes: FloatArray,
    places: FloatArray,
    turns: FloatArray,
    turned_halves: FloatArray,
    centres: FloatArray,
    halves: FloatArray,
) -> MaskArray:
    """For each of n cameras, axes (n, 3, 3), whether one of m turned boxes meets one of the aligned ones."""
    hit = np.zeros(len(axes), np.bool_)
    low, high = centres[0] - halves[0], centres[0] + halves[0]
    for box in range(1, len(centres)):
        low, high = np.minimum(low, centres[box] - halves[box]), np.maximum(high, centres[box] + halves[box])
    offset, rotation = np.empty(3), np.empty((3, 3))
    for camera in range(len(axes)):
        for i in range(len(places)):
            radius = _length(turned_halves[i])
            _turn(axes[camera], places[i], target, offset)
            if _is_outside(offset, low, high, radius):  # of the box around all aligned ones, as most are
                continue
            _multiply(axes[camera], turns[i], rotation)
            for box in range(len(centres)):
                if _boxes_meet(offset, centres[box], rotation, turned_halves[i], halves[box]):
                    hit[camera] = True
                    break
            if hit[camera]:
                break
    return hit


@njit(cache=True)
def _boxes_meet(
    offset: FloatArray, centre: FloatArray, rotation: FloatArray, turned: FloatArray, half: FloatArray
) -> bool:
    """Whether a box turned by ``rotation`` at ``offset`` meets an aligned one (separating axes, Gottschalk).

    Without temporary arrays, since sampling a scene asks for it a million times.
    """
    d = (offset[0] - centre[0], offset[1] - centre[1], offset[2] - centre[2])
    for i in range(3):
        reach = half[i]
        for k in range(3):
            reach += abs(rotation[i, k]) * turned[k]
        if abs(d[i]) > reach:
            return False
    for i in range(3):
        along, reach = 0.0, turned[i]
        for k in range(3):
            along += d[k] * rotation[k, i]
            reach += abs(rotation[k, i]) * half[k]
        if abs(along) > reach:
            return False
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            k, m = (j + 1) % 3, (j + 2) % 3
            reach = half[a] * abs(rotation[b, j]) + half[b] * abs(rotation[a, j])
            reach += turned[k] * abs(rotation[i, m]) + turned[m] * abs(rotation[i, k])
            # Parallel edges have no cross product: their axis is none, which the small number says.
            if abs(d[b] * rotation[a, j] - d[a] * rotation[b, j]) > reach + 1e-9:
                return False
    return True


def boxes_meet(first: BoxSet, second: BoxSet, gap: float) -> bool:
    """Whether a box of one set comes nearer than about ``gap`` m to one of the other."""
    return bool(any_pair_meets(first.centres, first.rotations, first.halves + gap, *second))


def meeting_pairs(sets: Sequence[BoxSet], gap: float) -> MaskArray:
    """For n sets of boxes, which of them come nearer than about ``gap`` m to each other, shape (n, n)."""
    owners = np.repeat(np.arange(len(sets)), [len(boxes.centres) for boxes in sets])
    return np.asarray(_meeting_pairs(*joined(sets), owners, len(sets), gap))


@njit(cache=True)
def _meeting_pairs(
    places: FloatArray, turns: FloatArray, halves: FloatArray, owners: NDArray[np.int64], count: int, gap: float
) -> MaskArray:
    """The compiled part of ``meeting_pairs``; ``owners`` are the sets of the boxes, shape (m,)."""
    meets = np.zeros((count, count), np.bool_)
    reach, origin = np.sqrt(np.sum(halves**2, axis=1)) + gap, np.zeros(3)
    offset, rotation = np.empty(3), np.empty((3, 3))
    for i in range(len(places)):
        for j in range(i):
            first, second = owners[i], owners[j]
            if first == second or meets[first, second]:
                continue
            _turn(turns[i].T, places[j], places[i], offset)
            if _length(offset) > reach[i] + reach[j]:
                continue
            _multiply(turns[i].T, turns[j], rotation)
            if _boxes_meet(offset, origin, rotation, halves[j], halves[i] + gap):
                meets[first, second] = meets[second, first] = True
    return meets


def hand_boxes(T_base_cam: FloatArray) -> BoxSet:
    """Boxes around the parts of the hand of a camera at a pose, shape (4, 4)."""
    rotation = T_base_cam[:3, :3]
    tool = T_base_cam[:3, 3] + rotation @ ROBOT.tool_in_camera
    return BoxSet(tool + _MIDDLES @ rotation.T, np.repeat(rotation[None], len(_MIDDLES), axis=0), _HALVES)


@njit(cache=True)
def any_pair_meets(
    places: FloatArray,
    turns: FloatArray,
    halves: FloatArray,
    others: FloatArray,
    other_turns: FloatArray,
    other_halves: FloatArray,
) -> bool:
    """Whether one of n turned boxes, (n, 3), (n, 3, 3), (n, 3), meets one of m others."""
    origin, offset, rotation = np.zeros(3), np.empty(3), np.empty((3, 3))
    for i in range(len(places)):
        reach = _length(halves[i])
        for j in range(len(others)):
            _turn(turns[i].T, others[j], places[i], offset)
            if _length(offset) > reach + _length(other_halves[j]):
                continue
            _multiply(turns[i].T, other_turns[j], rotation)
            if _boxes_meet(offset, origin, rotation, other_halves[j], halves[i]):
                return True
    return False
