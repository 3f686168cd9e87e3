"""What is remembered around the target: points of obstacles, and which places were looked at."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from fixation_gym.control.ways import SeenSpace
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.percept import Percept
from fixation_gym.perception.zero_flow.obstacle_memory import (
    MemorySettings,
    ObstacleMemory,
    believed_points,
    remember,
    seen_places,
)
from fixation_gym.perception.zero_flow.zero_flow import unknown_zero_flow
from fixation_gym.types import FloatArray

_OWN_RADIUS = 0.05
"""Points so near to the fixated point are the target's own, m."""
_HIDING = 0.06
"""A thing hides what is behind it if it is nearer by this share."""


class Obstacles(NamedTuple):
    """Points of obstacles that are believed in one control step."""

    points: FloatArray
    """Shape (n, 3), in base, m."""
    evidence: FloatArray
    """Of each point, shape (n,), in frames."""


class Surroundings:
    """Adds up what every zero-flow test says of the work space.

    State: the obstacle memory, the places that were looked at, the time of the last test, and whether a hand-eye error
    was proven by then.
    """

    def __init__(self, settings: MemorySettings | None = None) -> None:
        """Start without knowledge; ``settings`` say how evidence is kept."""
        self._settings = settings or MemorySettings()
        _run_once()
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._time, self._corrected = -math.inf, False
        self._forget()

    def _forget(self) -> None:
        self._memory = ObstacleMemory.empty()
        self.seen: SeenSpace | None = None
        """Which places around the target were looked at; None before the first test."""

    def look(self, percept: Percept, support_height_m: float | None) -> None:
        """Take in a zero-flow test, and which places around the target are in view.

        Args:
            percept: of this control step; a test that was taken in before tells nothing twice.
            support_height_m: height of the table in base, m; None: unknown.
        """
        if not percept.flow.valid or percept.flow.time <= self._time:
            return
        self._time = percept.flow.time
        corrected = percept.hand_eye is not None and percept.hand_eye.proven
        if corrected and not self._corrected:  # what was seen so far was seen by a camera that is somewhere else
            self._forget()
        self._corrected = corrected
        camera = (percept.flow.intrinsics, percept.T_base_flow)
        self._memory = remember(self._memory, percept.zfc, *camera, self._time, self._settings, support_height_m)
        target = percept.fixation.point_base
        if self.seen is None:
            self.seen = SeenSpace.empty(math.atan2(target[1], target[0]))
        self.seen = self.seen.with_seen(seen_places(self.seen.places(target), percept.zfc, *camera, _HIDING))

    def obstacles(self, target: FloatArray) -> Obstacles:
        """What is believed to stand there, without the own points of the target, in base, shape (3,), m."""
        points, evidence = believed_points(self._memory, self._settings)
        others = np.linalg.norm(points - target, axis=1) > _OWN_RADIUS
        return Obstacles(points[others], evidence[others])


@lru_cache(maxsize=1)
def _run_once() -> None:
    """Remember nothing once, so that no control step waits for compiled code to be made."""
    camera, nothing = Intrinsics.from_fovy(8, 8, 0.7), unknown_zero_flow(8, 8)
    remember(ObstacleMemory.empty(), nothing, camera, np.eye(4), 0.0, MemorySettings(), 0.0)
