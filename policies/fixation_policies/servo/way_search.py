"""Which way the hand takes, while the servo learns what stands around the target."""

from __future__ import annotations

import math

import numpy as np

from fixation_gym.control.ways import chosen_way, grasp_axes, known_ways, lateral_direction, way_costs
from fixation_gym.perception.percept import Percept
from fixation_gym.surroundings import Obstacles, Surroundings
from fixation_gym.types import FloatArray
from fixation_policies.servo.gains import ServoGains


class WaySearch:
    """Keeps the way that is taken, and those that were tried in vain."""

    def __init__(self, gains: ServoGains, surroundings: Surroundings) -> None:
        """Start without a way; ``surroundings`` know what was looked at."""
        self._gains = gains
        self._surroundings = surroundings
        self._way: int | None = None
        self._arrived = math.inf
        self._tried = np.zeros((0, 3))
        self._widths: FloatArray | None = None

    @property
    def has_way(self) -> bool:
        """Whether a way was chosen."""
        return self._way is not None

    def choose(
        self, percept: Percept, T_base_cam: FloatArray, obstacles: Obstacles, blocked: bool
    ) -> tuple[FloatArray, float]:
        """Lateral direction, shape (2,), in ``cam``, that leads to the way that is best now, and the angle to it, rad.

        Args:
            percept: of this control step.
            T_base_cam: camera pose, shape (4, 4).
            obstacles: what is believed to stand there.
            blocked: whether something is surely in the corridor along the present line of sight.
        """
        gains, target, seen = self._gains, percept.fixation.point_base, self._surroundings.seen
        if seen is None:
            return np.zeros(2), 0.0
        present = T_base_cam[:3, 3] - target
        present /= np.linalg.norm(present)
        ways = known_ways(*obstacles, target, seen, gains.way_margin)
        near = percept.fixation.distance_m < 0.9 * gains.orbit_distance
        waited = percept.time - self._arrived > gains.wait_seconds
        if blocked and (near or waited) and self._way is not None and self._arrived < math.inf:
            self._tried = np.vstack([self._tried, ways.directions[self._way]])
            self._arrived = math.inf
        if percept.body is not None:  # while it is lost for a moment, the last one stands
            axes = grasp_axes(ways.directions, gains.gaze.max_roll)
            self._widths = percept.body.widths(axes.reshape(-1, 3)).reshape(axes.shape[:2]).min(axis=1)
        cost = way_costs(ways, present, self._tried, gains.obstacle_evidence, gains.costs, self._widths)
        way = chosen_way(cost, self._way, gains.costs)
        if way != self._way:
            self._way, self._arrived = way, math.inf
        direction, angle = lateral_direction(T_base_cam, present, ways.directions[way])
        if angle < gains.on_way and self._arrived == math.inf:
            self._arrived = percept.time
        if near or self._arrived == math.inf or self.may_enter(percept.time):
            return direction, angle
        return self._look_aside(seen.towards_unseen(way, target, present), T_base_cam)

    def _look_aside(self, unseen: FloatArray, T_base_cam: FloatArray) -> tuple[FloatArray, float]:
        """Lateral direction in ``cam`` to where more of a way's corridor comes into view, and an angle to go, rad.

        ``unseen`` leads there across the line of sight, shape (3,), in base.
        """
        aside = T_base_cam[:3, :2].T @ unseen
        offset = float(np.linalg.norm(aside))
        return (aside / offset, self._gains.look_angle) if offset > 0.0 else (np.zeros(2), 0.0)

    def may_enter(self, time: float) -> bool:
        """Whether the hand may go in on its way at ``time`` s: it was looked at, or looking longer did not help."""
        seen = self._surroundings.seen
        if seen is None or self._way is None:
            return False
        share = seen.least_seen_share(self._way)
        return share > self._gains.seen_share or time - self._arrived > self._gains.look_seconds
