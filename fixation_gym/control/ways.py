"""Choice of the way: from which direction the hand comes in, by what was seen of every corridor and what was not.

A way is a direction from the target to the camera. Its corridor is what the hand sweeps when it comes straight in. A
way costs the turn to it, the evidence of obstacles in its corridor, and the part of its corridor that was never looked
at; a way that was tried in vain costs more. The cheapest one is taken, and kept while none is clearly cheaper.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fixation_gym.compiled import compiled
from fixation_gym.control.corridor import in_corridor, level_axes, swept_hand
from fixation_gym.control.reach import REACH_GRID, directions
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, MaskArray

WAY_MARGIN = 0.012
"""How far off remembered points may be, m: ways are compared by hands that are smaller and larger by this."""
BARRING_EVIDENCE = 60.0
"""Evidence in a corridor (points times frames) from which on it is surely barred."""
_RADII = (0.08, 0.13, 0.18, 0.23, 0.28, 0.33)
"""Distances from the target of the places that are looked at, m."""
_ASIDE = 0.03
"""What is nearer to the line of sight than this is in view; if it was not seen, looking at it helps no more, m."""
_TRIED_WITHIN = math.cos(math.radians(14.0))
"""Cosine of the angle within which ways count as the one that was tried."""
_ROLLS = 11
"""Turns of the hand that are tried."""


@dataclass(frozen=True)
class WayCosts:
    """What a way costs, in radians of turning."""

    blocked: float = 0.9
    """Per natural logarithm of its evidence, where that is enough to be sure."""
    unseen: float = 0.8
    """If ``much_unseen`` of its corridor or more was never looked at."""
    much_unseen: float = 0.2
    """A thing that bars a way fills a small part of its corridor only."""
    tried: float = 0.7
    """Per time that it was tried in vain."""
    change: float = 0.12
    """A new way must be cheaper by this than the present one."""
    low: float = 0.5
    """For the lowest ways: the fingers are next to the table and can hardly turn to close on what stands askew."""
    strain: float = 0.15
    """At the border of the arm's reach."""
    wide: float = 0.8
    """Where the fingers, however the hand turns, do not get around the target."""


@dataclass(frozen=True, eq=False)
class SeenSpace:
    """Which places around the target were looked at: not hidden, and within the image while the camera moved."""

    bearing: float
    """Of the target from the base, rad: the places turn with it."""
    seen: MaskArray
    """Shape (places,)."""

    @classmethod
    def empty(cls, bearing: float) -> SeenSpace:
        """Nothing seen yet."""
        return cls(bearing, np.zeros(len(_PLACES), dtype=bool))

    def places(self, target: FloatArray) -> FloatArray:
        """The places around a target, shape (places, 3), in base, m."""
        c, s = math.cos(self.bearing), math.sin(self.bearing)
        return target + _PLACES @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])

    def with_seen(self, seen: MaskArray) -> SeenSpace:
        """With more places seen."""
        return replace(self, seen=self.seen | seen)

    def least_seen_share(self, way: int) -> float:
        """Share seen of the corridor of the way with that index, at the distance from the target where it is least."""
        places = _IN_CORRIDORS[way].reshape(len(_RADII), -1)
        return float(np.min((places * self.seen.reshape(len(_RADII), -1)).sum(axis=1) / places.sum(axis=1)))

    def towards_unseen(self, way: int, target: FloatArray, present: FloatArray) -> FloatArray:
        """From the line of sight to the nearest place in a way's corridor that was not looked at.

        The nearest: seen from between two such places, one of them wins and is looked at first.

        Args:
            way: index.
            target: in base, shape (3,), m.
            present: unit vector from target to camera, shape (3,).

        Returns:
            Vector across the line of sight, shape (3,), in base, m; zero if all was seen.
        """
        places = (self.places(target) - target)[(_IN_CORRIDORS[way] > 0.0) & ~self.seen]
        aside = places - np.outer(places @ present, present)
        offset = np.linalg.norm(aside, axis=1)
        aside, offset = aside[offset > _ASIDE], offset[offset > _ASIDE]
        return aside[np.argmin(offset)] if len(aside) else np.zeros(3)

    @property
    def unseen_shares(self) -> FloatArray:
        """Share of every way's corridor that was not looked at, shape (ways,)."""
        return _IN_CORRIDORS @ (~self.seen).astype(np.float64) / _IN_CORRIDORS.sum(axis=1)


@dataclass(frozen=True, eq=False)
class Ways:
    """What is known of all ways to a target; rows are those of ``REACH_GRID``."""

    directions: FloatArray
    """Unit vectors from target to camera, shape (n, 3), in base."""
    evidence: FloatArray
    """Evidence of obstacles in every corridor, shape (n,)."""
    unseen: FloatArray
    """Share of every corridor that was never looked at, shape (n,)."""

    def nearest(self, direction: FloatArray) -> int:
        """Index of the way that is nearest to a direction."""
        return int(np.argmax(self.directions @ direction))


def known_ways(points: FloatArray, weights: FloatArray, target: FloatArray, seen: SeenSpace, margin: float) -> Ways:
    """What was seen of every way.

    Args:
        points: remembered obstacle points in base, shape (n, 3), m.
        weights: evidence of each point, shape (n,).
        target: fixated point in base, shape (3,), m.
        seen: which places were looked at.
        margin: by which a hand is smaller and larger than it is, between which points count ever less, m.
    """
    ways = directions(REACH_GRID, target)
    hand = swept_hand(0.0)
    # What is remembered is a centimetre or two off: the deeper it is in a corridor the more it counts.
    margins = np.array([margin, 0.0, -margin])
    evidence = _evidence_in(level_axes(ways), points - target, weights, hand.centres, hand.halves, margins)
    return Ways(ways, evidence, seen.unseen_shares)


@compiled
def _evidence_in(
    axes: FloatArray,
    points: FloatArray,
    weights: FloatArray,
    centres: FloatArray,
    halves: FloatArray,
    margins: FloatArray,
) -> FloatArray:
    """Evidence in the corridor of every camera, shape (n,); a point counts by the share of the hands that meet it.

    Compiled: it runs in every control step, and there are a hundred times as many pairs as points.

    Args:
        axes: rows x, y, z of level cameras, shape (n, 3, 3).
        points: from the target, shape (m, 3), m.
        weights: evidence of each, shape (m,).
        centres: of the boxes that the hand sweeps, shape (b, 3), m.
        halves: their half sizes, shape (b, 3), m.
        margins: by which the hands are larger than that, the largest first, shape (h,), m.
    """
    evidence = np.zeros(len(axes))
    local = np.empty(3)
    for way in range(len(axes)):
        for point in range(len(points)):
            for axis in range(3):
                local[axis] = (
                    axes[way, axis, 0] * points[point, 0]
                    + axes[way, axis, 1] * points[point, 1]
                    + axes[way, axis, 2] * points[point, 2]
                )
            if local[2] >= 0.0:
                continue
            deepest = -np.inf  # in any box: how far from its nearest side
            for box in range(len(centres)):
                inside = np.inf
                for axis in range(3):
                    inside = min(inside, halves[box, axis] - abs(local[axis] - centres[box, axis]))
                deepest = max(deepest, inside)
            hands = 0
            for margin in margins:
                hands += deepest + margin > 0.0
            evidence[way] += weights[point] * hands / len(margins)
    return evidence


def grasp_axes(ways: FloatArray, largest_roll: float) -> FloatArray:
    """Axes along which the fingers may close for every way, unit vectors of shape (ways, rolls, 3), in base.

    Args:
        ways: unit vectors from target to camera, shape (ways, 3).
        largest_roll: of the hand against level, rad.
    """
    axes = level_axes(ways)
    rolls = np.linspace(-largest_roll, largest_roll, _ROLLS)
    return np.cos(rolls)[:, None] * axes[:, None, 0] + np.sin(rolls)[:, None] * axes[:, None, 1]


def way_costs(
    ways: Ways,
    present: FloatArray,
    tried: FloatArray,
    full_weight: float,
    costs: WayCosts,
    widths: FloatArray | None = None,
) -> FloatArray:
    """What every way costs, shape (n,), in radians of turning.

    Args:
        ways: what is known of them.
        present: unit vector from target to camera, shape (3,).
        tried: ways that were tried in vain, shape (m, 3).
        full_weight: evidence in a corridor at which it is surely blocked.
        costs: the prices.
        widths: of the target between the fingers for every way, shape (n,), m; None: not known.
    """
    turn = np.arccos(np.clip(ways.directions @ present, -1.0, 1.0))
    again = (ways.directions @ tried.T > _TRIED_WITHIN).sum(axis=1) if len(tried) else 0.0
    blocked = costs.blocked * np.log1p(ways.evidence / full_weight)
    unseen = costs.unseen * np.minimum(ways.unseen / costs.much_unseen, 1.0)
    arm = costs.strain * _AT_BORDER + costs.low * _LOW
    if widths is not None:
        sure, never = ROBOT.hand.finger_span
        arm = arm + costs.wide * np.clip((widths - sure) / (never - sure), 0.0, 1.0)
    return turn + blocked + unseen + costs.tried * again + arm


def chosen_way(cost: FloatArray, before: int | None, costs: WayCosts) -> int:
    """Index of the way to take; the one taken before stays unless another is clearly cheaper."""
    best = int(np.argmin(cost))
    return best if before is None or cost[best] < cost[before] - costs.change else before


def lateral_direction(T_base_cam: FloatArray, present: FloatArray, way: FloatArray) -> tuple[FloatArray, float]:
    """Direction across the optical axis that leads around the target to a way, and the angle to it.

    Args:
        T_base_cam: camera pose, shape (4, 4).
        present: unit vector from target to camera, shape (3,).
        way: the one to go to, shape (3,).

    Returns:
        Unit vector (x, y) in ``cam``, zero if there, and the angle in rad.
    """
    angle = math.acos(float(np.clip(present @ way, -1.0, 1.0)))
    tangent = way - (way @ present) * present
    lateral = T_base_cam[:3, :2].T @ tangent
    return lateral / max(float(np.linalg.norm(lateral)), 1e-9), angle


def _places() -> FloatArray:
    """Places around a target with bearing 0, shape (n, 3), m: along all ways of the reach, and a ring beyond it."""
    ways = directions(REACH_GRID, np.array([1.0, 0.0, 0.0]))
    low = np.array([(azimuth, elevation) for elevation in (0.2, 0.35, 0.5) for azimuth in np.linspace(-1.5, 3.2, 32)])
    return np.concatenate([radius * np.vstack([ways, directions(low, np.array([1.0, 0.0, 0.0]))]) for radius in _RADII])


def _in_corridors() -> FloatArray:
    """Which places lie in the corridor of which way, shape (ways, places), as 0 or 1."""
    axes = level_axes(directions(REACH_GRID, np.array([1.0, 0.0, 0.0])))
    return in_corridor(np.einsum("kij,nj->kni", axes, _PLACES), 0.0).astype(np.float64)


def _at_border() -> FloatArray:
    """1 for ways at the border of the reach in azimuth, 0 within, shape (ways,)."""
    border = []
    for azimuth, elevation in REACH_GRID:
        low, high = ROBOT.arm.reach.azimuths(float(elevation))
        border.append(min(azimuth - low, high - azimuth) < 0.05)
    return np.array(border, dtype=np.float64)


_PLACES = _places()
_IN_CORRIDORS = _in_corridors()
_AT_BORDER = _at_border()
_LOW = np.clip((math.radians(55.0) - REACH_GRID[:, 1]) / math.radians(15.0), 0.0, 1.0)
"""1 for the lowest ways, 0 from 55 degrees on, shape (ways,)."""
