"""What the filters on twist and flow take the camera and its target for: two models behind one interface.

* ``Hard``, the paper's, has 9 states [v (3), w_Z, a (3), alpha_Z, d] and knows that the fixated point stands still in
  the image, so w_X = d v_Y and w_Y = -d v_X: the distance is the ratio of translation and rotation.
* ``Free`` has 15 states [v (3), w (3), a (3), alpha (3), n (3)] and no constraint. n is the target's plane, n . P = 1,
  so the inverse depth at (x, y) is n . (x, y, 1), exact for any slant, and n_dot = (n . v) n - w x n.

Units: m, rad, s; twists in the camera frame, image coordinates normalised.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from fixation_gym.geometry.rigid import cross
from fixation_gym.geometry.twist import skew
from fixation_gym.types import FloatArray

Kind = Literal["hard", "free"]


class FlowModel(Protocol):
    """States of a filter: first the motion, then as many accelerations, then the inverse depth, its last one too."""

    @property
    def motion(self) -> int:
        """Number of states of the motion."""
        ...

    @property
    def size(self) -> int:
        """Number of all states."""
        ...

    @property
    def fixates(self) -> bool:
        """Whether the target stands still in the image and faces the camera; what violates that is noise."""
        ...

    def depth_rate(self, mean: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rate of the states of depth, shape (k,), and its derivative by all states, shape (k, size)."""
        ...

    def twist(self, mean: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Expected twist, shape (6,), and its derivative by the state, shape (6, size)."""
        ...

    def inverse_depths(self, mean: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Inverse depths at points, shape (m, 2), 1/m, and their derivatives by the state, shape (m, size)."""
        ...

    def tilted(self, mean: FloatArray, factor: float) -> FloatArray:
        """The state with the slant of what is moved to another inverse depth, ``factor`` times the old one."""
        ...


@dataclass(frozen=True)
class Hard:
    """With the fixation constraint."""

    motion: int = 4
    size: int = 9
    fixates: bool = True

    def depth_rate(self, mean: FloatArray) -> tuple[FloatArray, FloatArray]:
        """d_dot = d^2 v_Z."""
        d, forward = mean[8], mean[2]
        by_state = np.zeros((1, 9))
        by_state[0, 8], by_state[0, 2] = 2.0 * d * forward, d * d
        return np.array([d * d * forward]), by_state

    def twist(self, mean: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The rotation follows from the translation, but for the roll."""
        v, roll, d = mean[:3], mean[3], mean[8]
        H = np.zeros((6, 9))
        H[:3, :3] = np.eye(3)
        H[3, 1], H[3, 8] = d, v[1]
        H[4, 0], H[4, 8] = -d, -v[0]
        H[5, 3] = 1.0
        return np.array([*v, d * v[1], -d * v[0], roll]), H

    def inverse_depths(self, mean: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The same everywhere."""
        by_state = np.zeros((len(points), 9))
        by_state[:, 8] = 1.0
        return np.full(len(points), mean[8]), by_state

    def tilted(self, mean: FloatArray, factor: float) -> FloatArray:
        """There is no slant."""
        return mean


@dataclass(frozen=True)
class Free:
    """Without a constraint."""

    motion: int = 6
    size: int = 15
    fixates: bool = False

    def depth_rate(self, mean: FloatArray) -> tuple[FloatArray, FloatArray]:
        """n_dot = (n . v) n - w x n."""
        v, w, n = mean[:3], mean[3:6], mean[12:]
        by_state = np.zeros((3, 15))
        by_state[:, :3], by_state[:, 3:6] = np.outer(n, n), skew(n)
        by_state[:, 12:] = (n @ v) * np.eye(3) + np.outer(n, v) - skew(w)
        return (n @ v) * n - cross(w, n), by_state

    def twist(self, mean: FloatArray) -> tuple[FloatArray, FloatArray]:
        """All of it is state."""
        H = np.zeros((6, 15))
        H[:6, :6] = np.eye(6)
        return mean[:6], H

    def inverse_depths(self, mean: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Of the target's plane."""
        rays = np.column_stack([points, np.ones(len(points))])
        by_state = np.zeros((len(points), 15))
        by_state[:, 12:] = rays
        return rays @ mean[12:], by_state

    def tilted(self, mean: FloatArray, factor: float) -> FloatArray:
        """The plane keeps its slant."""
        turned = mean.copy()
        turned[12:14] *= factor
        return turned


MODELS: dict[Kind, FlowModel] = {"hard": Hard(), "free": Free()}
