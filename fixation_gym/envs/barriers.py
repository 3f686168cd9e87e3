"""Which obstacles bar all ways to the target but the free one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from fixation_gym.control.box_tests import boxes_meet, packed, packed_hand, pairs_that_meet
from fixation_gym.control.corridor import hand_boxes, level_axes, swept_hand
from fixation_gym.control.reach import REACH_GRID
from fixation_gym.envs.config import Scenario
from fixation_gym.envs.covering import Quota, apart_from, barred_ways, could_bar, covering, is_barred
from fixation_gym.envs.drafts import Aim, Drafts, Menu, chosen_drafts, draw_across, draw_for_ways, joined_drafts
from fixation_gym.envs.goal import Goal
from fixation_gym.envs.placement import draft_of, draw_mover
from fixation_gym.envs.room import holds
from fixation_gym.envs.scene import ObstacleSpec, TargetSpec
from fixation_gym.envs.shapes import MATERIALS
from fixation_gym.envs.visibility import is_seen, pass_through, visible_share
from fixation_gym.geometry.boxes import BoxSet, box_set, joined
from fixation_gym.geometry.rigid import look_at
from fixation_gym.types import FloatArray, MaskArray

_BARRED_DEPTH = 0.01
"""A way is barred if a hand smaller by this would still touch something, m."""
_MOST_OPEN = 0.31
"""Largest share of the ways that is not barred in the end."""
_ABOVE: MaskArray = REACH_GRID[:, 1] > math.radians(75.0)
"""Which ways of the reach's grid come from above."""
_ALL_ABOVE = np.flatnonzero(_ABOVE)
_MOST_ABOVE = 0.35
"""Largest share of them that is not barred, but for those near the free way."""
_APART = math.radians(20.0)
"""Least angle between the first line of sight and the free way: the hand is wide, and the former is to be barred."""
_START_ROOM = 0.04
"""Least distance between the hand and obstacles at the start, m."""
_OBSTACLE_GAP = 0.006
"""Least room between obstacles, m."""
_LEAST_VISIBLE = 0.5
"""Least share of the target that is in view at the start, through glass or past everything else."""
_BEYOND = (0.2, 0.9)
"""Range of the angle by which an obstacle stands beyond the way that it is to bar, seen from the free one, rad."""
_ACROSS = (0.0, 0.3)
"""The same for what is to stand in a line of sight, rad."""
_FIRST_CANDIDATES, _CANDIDATES = 12, 36
"""Candidates for the first obstacle and for the others."""
_ACROSS_TRIES, _MOVER_TRIES = 40, 40
"""Tries for what is to stand in a line of sight, and for what moves."""
_MIRROR = MATERIALS.index("mirror")


@dataclass(frozen=True, eq=False)
class View:
    """From where the camera first looks, and what else is red."""

    camera: FloatArray
    gaze: FloatArray
    first_sight: int
    """Index of the way along the first line of sight."""
    distractor: TargetSpec | None

    @property
    def pose(self) -> FloatArray:
        """T_base_cam, shape (4, 4)."""
        return look_at(self.camera, self.gaze, np.array([0.0, 0.0, 1.0]))

    def is_apart(self, goal: Goal) -> bool:
        """Whether it is so far from the free way that its line of sight can be barred."""
        return bool(goal.ways[self.first_sight] @ goal.free.direction <= math.cos(_APART))

    @property
    def taken(self) -> list[BoxSet]:
        """What is in the way of obstacles."""
        return [] if self.distractor is None else [box_set([self.distractor.box])]


@dataclass(frozen=True, eq=False)
class Pool:
    """Candidates for the obstacles of a scene; rows and columns of its arrays are in their order."""

    drafts: Drafts
    barred: MaskArray
    """Ways that each of them bars, shape (n, ways)."""
    quota: Quota
    """How many ways may stay open in the end."""
    several_mirrors: bool
    """Whether a scene may have more than one."""

    @cached_property
    def clashes(self) -> MaskArray:
        """Which of them have no room beside each other, shape (n, n): few pools get so far that this is asked."""
        clashes = pairs_that_meet(self.drafts.boxes, self.drafts.ends, _OBSTACLE_GAP)
        if not self.several_mirrors:  # MuJoCo draws one reflection only
            mirrors = self.drafts.materials == _MIRROR
            clashes |= np.outer(mirrors, mirrors)
        return clashes


def draw_pool(scenario: Scenario, menu: Menu, goal: Goal, rng: np.random.Generator) -> Pool | None:
    """Obstacles that leave the free way, each as if it were alone; None if all of them together bar too little."""
    drafts = draw_for_ways((_FIRST_CANDIDATES, _CANDIDATES), _BEYOND, _aim(goal), goal.room, menu, rng)
    if len(drafts.kinds) == 0:
        return None
    quota, hands, target = _quota(goal, scenario.most_open), level_axes(goal.ways), goal.room.ends[-1]
    if not could_bar(target, hands, drafts.boxes, drafts.ends, _smaller_hand(), quota.groups, quota.most_open):
        return None
    barred = barred_ways(target, hands, drafts.boxes, drafts.ends, _smaller_hand())
    return Pool(drafts, barred, quota, scenario.several_mirrors)


def with_some_across(menu: Menu, goal: Goal, view: View, pool: Pool, rng: np.random.Generator) -> Pool:
    """The pool with first obstacles that the first line of sight passes through."""
    drafts = draw_across(_ACROSS_TRIES, view.first_sight, _ACROSS, _aim(goal), goal.room, menu, rng)
    through = np.flatnonzero(pass_through(drafts, view.camera, goal.room.ends[0]))
    across = chosen_drafts(drafts, through[:_FIRST_CANDIDATES])
    hands = level_axes(goal.ways)
    barred = barred_ways(goal.room.ends[-1], hands, across.boxes, across.ends, _smaller_hand())
    barred = np.concatenate([barred, pool.barred])
    return Pool(joined_drafts(across, pool.drafts), barred, pool.quota, pool.several_mirrors)


def _aim(goal: Goal) -> Aim:
    return Aim(goal.room.ends[-1], goal.free.azimuth, goal.free.direction, goal.ways, _ALL_ABOVE)


@cache
def _smaller_hand() -> FloatArray:
    """What surely touches an obstacle on a way that counts as barred, as in ``box_tests.packed_hand``."""
    return packed_hand(swept_hand(-_BARRED_DEPTH, wrist=False))


def _quota(goal: Goal, most_among: float) -> Quota:
    """How many ways may stay open.

    Also of those from above, and of those among which the free one is drawn: a shelf leaves only low ways, and a hand
    that always comes in low must not find most of them open.
    """
    groups = np.ones((3, len(goal.ways)), bool)
    groups[1], groups[2] = goal.drawn_among, _ABOVE & ~goal.near_free
    return Quota(groups, np.array([_MOST_OPEN, most_among, _MOST_ABOVE]))


def bar_ways(
    scenario: Scenario, goal: Goal, view: View, pool: Pool, rng: np.random.Generator
) -> list[ObstacleSpec] | None:
    """Obstacles out of the pool that bar all ways but those near the free one; None if there are none.

    Those that bar most are taken, if they have room beside the others and do not hide the target.
    """
    if not pool.barred[:, view.first_sight].any():
        return None
    taken = packed(joined([hand_boxes(view.pose), *view.taken]))
    usable = apart_from(pool.drafts.boxes, pool.drafts.ends, taken, _START_ROOM)
    if not is_barred(~np.logical_or.reduce(pool.barred[usable], axis=0), view.first_sight, pool.quota):
        return None
    firsts = pool.drafts.first & usable
    if scenario.through_sight:
        firsts = firsts & pass_through(pool.drafts, view.camera, goal.room.ends[0])
    others = usable & ~pool.drafts.first
    for first in np.flatnonzero(firsts).tolist():
        chosen = covering(
            first, others, pool.barred, pool.clashes, view.first_sight, pool.quota, scenario.obstacle_count
        )
        if len(chosen) == 0:
            continue
        obstacles = [draft_of(pool.drafts, index).finished(scenario, rng) for index in chosen.tolist()]
        if scenario.discovery and not _is_discovered(goal, view, pool.barred[chosen], obstacles):
            continue
        if visible_share(view.camera, goal.target, obstacles) >= _LEAST_VISIBLE:
            return obstacles
    return None


def add_movers(
    scenario: Scenario, goal: Goal, view: View, barriers: list[ObstacleSpec], rng: np.random.Generator
) -> list[ObstacleSpec] | None:
    """The obstacles with those that move; None if there is no room for them."""
    count = scenario.moving_count[0]  # one number by now
    obstacles, hand = list(barriers), hand_boxes(view.pose)
    taken = view.taken + [obstacle.boxes for obstacle in obstacles]
    materials = [name for name in scenario.obstacle_materials if name != "mirror"]
    for _ in range(_MOVER_TRIES):
        if len(obstacles) == len(barriers) + count:
            return obstacles
        mover = draw_mover(scenario, str(rng.choice(materials)), goal.room.ends[-1], rng)
        boxes = mover.boxes
        if not holds(goal.room, boxes) or boxes_meet(boxes, joined(taken), _OBSTACLE_GAP):
            continue
        if boxes_meet(boxes, hand, _START_ROOM):
            continue
        if visible_share(view.camera, goal.target, [*obstacles, mover]) >= _LEAST_VISIBLE:
            obstacles.append(mover)
            taken.append(boxes)
    return None


def _is_discovered(goal: Goal, view: View, barred: MaskArray, obstacles: list[ObstacleSpec]) -> bool:
    """Whether the nearest way that the first obstacle leaves is barred by something out of view at the start.

    ``barred`` are the ways that each of the obstacles bars, shape (n, ways).
    """
    ways = goal.ways
    nearness = np.where(barred[0] | goal.near_free, -1.0, ways @ ways[view.first_sight])
    natural = int(np.argmax(nearness))
    return any(
        bars and not is_seen(obstacle, view.pose, obstacles[:1])
        for bars, obstacle in zip(barred[1:, natural], obstacles[1:], strict=True)
    )
