"""Joint velocities for a camera twist: damped least squares with a posture in the null space (Whitney 1969)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fixation_gym.types import FloatArray


@dataclass(frozen=True, eq=False)
class JointLimits:
    """Limits of the arm, each of shape (n,)."""

    lower: FloatArray
    """Smallest joint angles, rad."""
    upper: FloatArray
    """Largest joint angles, rad."""
    speed: FloatArray
    """Largest joint speeds, rad/s."""


def joint_velocities(
    jacobian: FloatArray,
    twist: FloatArray,
    joint_pos: FloatArray,
    posture: FloatArray,
    limits: JointLimits,
    damping: float = 0.01,
    posture_gain: float = 0.5,
    limit_gain: float = 5.0,
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
        limit_gain: a joint nears its limit no faster than this rate times the remaining angle, 1/s.

    Returns:
        Shape (n,), rad/s.
    """
    gram = jacobian @ jacobian.T
    gram[np.diag_indices(6)] += damping**2
    drift = posture_gain * (posture - joint_pos)
    # One solve gives both parts: J^T G^-1 (twist - J drift) + drift.
    velocities = jacobian.T @ np.linalg.solve(gram, twist - jacobian @ drift) + drift
    excess = float(np.max(np.abs(velocities) / limits.speed))
    if excess > 1.0:
        velocities = velocities / excess
    return np.clip(velocities, limit_gain * (limits.lower - joint_pos), limit_gain * (limits.upper - joint_pos))
