"""What moves objects: a spring and a damper of limited force that take them along a planned ``Motion``.

It acts like a hand that slides an object over the table: the object stays solid, stays upright, and yields to what
is stronger. Nothing but forces is set.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fixation_gym.envs.motion import Motion, planned
from fixation_gym.types import FloatArray

LARGEST_FORCE = 10.0
"""Horizontal force at most, N."""
_LARGEST_TORQUE = 1.0
"""Torque at most, N m."""
_RATE = 40.0
"""Rate at which deviations decay, critically damped, 1/s."""
_HOLD_SECONDS = 0.3
"""Time for which a pushed object is held at the end, so that it rests there and no ball rolls on, s."""
_HOVER = 0.001
"""Height above the table at which objects are moved, m. Without weight, MuJoCo's convex routine may find a cylinder
that just touches the table's box to be deep inside it."""
_MOVED_BEFORE = 0.005
"""A push does not happen to an object that was taken from its place by more than this, m: it may be in the gripper."""


class Mover:
    """Moves one pool body. ``model`` and ``data`` are an ``mjModel`` and its ``mjData``, just reset to the scene."""

    def __init__(self, model: Any, data: Any, body: str, motion: Motion, *, spares_taken: bool) -> None:
        """Remember where the body stands.

        Args:
            model: compiled model with the scene loaded.
            data: its state at reset.
            body: name of the body.
            motion: what to do with it.
            spares_taken: leave it alone if, when its motion begins, it is no longer where it stood.
        """
        joint, body_id = model.joint(f"{body}_joint"), model.body(body).id
        position, velocity = joint.qposadr[0], joint.dofadr[0]
        self.motion = motion
        self._data = data
        self._place, self._attitude = (data.qpos[position + a : position + b] for a, b in ((0, 3), (3, 7)))
        self._velocity, self._spin = (data.qvel[velocity + a : velocity + b] for a, b in ((0, 3), (3, 6)))
        self._wrench = data.xfrc_applied[body_id]
        self._start, self._start_attitude = self._place.copy(), self._attitude.copy()
        self._hovering = self._start + np.array([0.0, 0.0, _HOVER])
        self._mass, self._inertia = float(model.body_mass[body_id]), model.body_inertia[body_id].copy()
        self._weight = -self._mass * model.opt.gravity
        self._until = motion.end_s + _HOLD_SECONDS
        self._spares_taken = spares_taken
        self._acting = False

    @property
    def state(self) -> tuple[bool, float]:
        """Whether it acts, and until when, s."""
        return self._acting, self._until

    @state.setter
    def state(self, value: tuple[bool, float]) -> None:
        self._acting, self._until = value

    def apply(self) -> None:
        """Set the wrench on the body for the next physics substep."""
        time = self._data.time
        if not self._acting:
            if not self.motion.start_s <= time < self._until:
                return
            taken = float(np.linalg.norm(self._place - self._start)) > _MOVED_BEFORE
            if taken and self._spares_taken:
                self._until = -math.inf
                return
            self._acting = True
        if time >= self._until:
            self._acting = False
            self._wrench[:] = 0.0
            return
        offset, velocity = planned(self.motion, time)
        lag = self._hovering - self._place
        lag[:2] += offset
        slower = -self._velocity
        slower[:2] += velocity
        force = self._mass * (_RATE**2 * lag + 2.0 * _RATE * slower)
        self._wrench[:3] = self._weight + _limited(force, LARGEST_FORCE)
        self._wrench[3:] = self._upright_torque()

    def _upright_torque(self) -> FloatArray:
        """Torque in the world frame that keeps the attitude it had at reset, shape (3,), N m."""
        w, *xyz = self._attitude.tolist()
        start_w, *start_xyz = self._start_attitude.tolist()
        # conj(attitude) * start, in the body's axes
        cosine = w * start_w + float(np.dot(xyz, start_xyz))
        error = w * np.array(start_xyz) - start_w * np.array(xyz) - np.cross(xyz, start_xyz)
        turn = 2.0 * math.copysign(1.0, cosine) * error
        torque = self._inertia * (_RATE**2 * turn - 2.0 * _RATE * self._spin)
        return _rotated(_limited(torque, _LARGEST_TORQUE), w, np.array(xyz))


def _limited(vector: FloatArray, largest: float) -> FloatArray:
    return vector * min(1.0, largest / max(float(np.linalg.norm(vector)), 1e-12))


def _rotated(vector: FloatArray, w: float, xyz: FloatArray) -> FloatArray:
    """Vector turned by a unit quaternion."""
    across = 2.0 * np.cross(xyz, vector)
    return vector + w * across + np.cross(xyz, across)
