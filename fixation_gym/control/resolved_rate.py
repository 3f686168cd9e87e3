"""Joint velocities for a camera twist: damped least squares with a posture in the null space (Whitney 1969).

Compiled: it runs at every physics substep.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fixation_gym.compiled import compiled
from fixation_gym.types import FloatArray, MaskArray

DAMPING = 0.01
"""Of the least squares: bounds joint speeds near singular postures."""
POSTURE_GAIN = 0.5
"""Rate of the null-space drift, 1/s."""
_TRANSLATION_WEIGHT = 10.0
"""Where a joint is held back and the twist cannot be had, 1 cm/s off counts as much as 0.1 rad/s: no hand lunges."""
LIMIT_GAIN = 5.0
"""A joint nears its limit no faster than this rate times the remaining angle, 1/s."""


class JointLimits(NamedTuple):
    """Limits of the arm, each of shape (n,)."""

    lower: FloatArray
    """Smallest joint angles, rad."""
    upper: FloatArray
    """Largest joint angles, rad."""
    speed: FloatArray
    """Largest joint speeds, rad/s."""


@compiled
def joint_velocities(
    jacobian: FloatArray,
    twist: FloatArray,
    joint_pos: FloatArray,
    posture: FloatArray,
    limits: JointLimits,
    damping: float = DAMPING,
    posture_gain: float = POSTURE_GAIN,
    limit_gain: float = LIMIT_GAIN,
) -> FloatArray:
    """Joint velocities whose camera twist is nearest to ``twist``.

    Args:
        jacobian: shape (6, n); rows and ``twist`` in the same frame.
        twist: [v, w], shape (6,), m/s and rad/s.
        joint_pos: shape (n,), rad.
        posture: joint angles towards which the redundant motion drifts, shape (n,), rad.
        limits: joint limits; speeds beyond them scale the whole motion down, so its direction is kept.
        damping: of the least squares; bounds joint speeds near singular postures.
        posture_gain: rate of the null-space drift, 1/s.
        limit_gain: a joint nears its limit no faster than this rate times the remaining angle, 1/s. Where that holds
            one back, the others make up for it.

    Returns:
        Shape (n,), rad/s.
    """
    joints = len(joint_pos)
    drift = np.empty(joints)
    held = np.zeros(joints, np.bool_)
    velocities = np.zeros(joints)
    for k in range(joints):
        drift[k] = posture_gain * (posture[k] - joint_pos[k])
    for _ in range(joints):
        _least_squares(jacobian, twist, drift, damping, held, velocities)
        excess = 1.0
        for k in range(joints):
            excess = max(excess, abs(velocities[k]) / limits.speed[k])
        within = True
        for k in range(joints):
            lowest = limit_gain * (limits.lower[k] - joint_pos[k])
            highest = limit_gain * (limits.upper[k] - joint_pos[k])
            velocities[k] /= excess
            if not lowest <= velocities[k] <= highest:
                velocities[k] = min(max(velocities[k], lowest), highest)
                within &= bool(held[k])
                held[k] = True
        if within:
            break
    return velocities


@compiled
def _least_squares(
    jacobian: FloatArray, twist: FloatArray, drift: FloatArray, damping: float, held: MaskArray, velocities: FloatArray
) -> None:
    """Set the velocities of all joints that are not held, shape (n,); the others move as they are told."""
    rows, joints = jacobian.shape
    gram = np.empty((rows, rows))
    rest = np.empty(rows)
    weight = np.ones(rows)
    if held.any():
        weight[:3] = _TRANSLATION_WEIGHT
    for i in range(rows):
        rest[i] = twist[i]
        for k in range(joints):
            rest[i] -= jacobian[i, k] * (velocities[k] if held[k] else drift[k])
        rest[i] *= weight[i]
        for j in range(i + 1):
            gram[i, j] = 0.0
            for k in range(joints):
                if not held[k]:
                    gram[i, j] += jacobian[i, k] * jacobian[j, k]
            gram[i, j] *= weight[i] * weight[j]
        gram[i, i] += damping**2
    # One solve gives both parts: J^T G^-1 (twist - J drift) + drift.
    _solve_in_place(gram, rest)
    for k in range(joints):
        if not held[k]:
            velocities[k] = drift[k]
            for i in range(rows):
                velocities[k] += jacobian[i, k] * weight[i] * rest[i]


@compiled
def _solve_in_place(matrix: FloatArray, vector: FloatArray) -> None:
    """Solve a symmetric positive definite system, of which the lower triangle is given, by Cholesky's method."""
    size = len(vector)
    for i in range(size):
        for j in range(i + 1):
            for k in range(j):
                matrix[i, j] -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = np.sqrt(matrix[i, i]) if i == j else matrix[i, j] / matrix[j, j]
        for k in range(i):
            vector[i] -= matrix[i, k] * vector[k]
        vector[i] /= matrix[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            vector[i] -= matrix[k, i] * vector[k]
        vector[i] /= matrix[i, i]
