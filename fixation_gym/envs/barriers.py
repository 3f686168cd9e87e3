"""Which obstacles bar all ways to the target but the free one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fixation_gym.control.corridor import barred_directions, boxes_meet, hand_boxes, meeting_pairs
from fixation_gym.control.reach import REACH_GRID
from fixation_gym.envs.config import Scenario
from fixation_gym.envs.goal import Goal
from fixation_gym.envs.obstacle_kinds import OBSTACLE_KINDS
from fixation_gym.envs.placement import OBSTACLE_GAP, Draft, draw_kind, draw_mover, draw_obstacle
from fixation_gym.envs.scene import ObstacleSpec, TargetSpec
from fixation_gym.envs.visibility import is_seen, passes_through, visible_share
from fixation_gym.geometry.boxes import BoxSet, box_set, joined
from fixation_gym.geometry.rigid import look_at
from fixation_gym.types import FloatArray, MaskArray

_BARRED_DEPTH = 0.01
"""A way is barred if a hand smaller by this would still touch something, m."""
_MOST_OPEN = 0.31
"""Largest share of the ways that is not barred in the end."""
_MOST_AMONG = 0.36
"""Largest share of the ways among which the free one is drawn that is not barred."""
_ABOVE: MaskArray = REACH_GRID[:, 1] > math.radians(75.0)
"""Which ways of the reach's grid come from above."""
_MOST_ABOVE = 0.35
"""Largest share of them that is not barred, but for those near the free way."""
_APART = math.radians(20.0)
"""Least angle between the first line of sight and the free way: the hand is wide, and the former is to be barred."""
_START_ROOM = 0.04
"""Least distance between the hand and obstacles at the start, m."""
_LEAST_VISIBLE = 0.5
"""Least share of the target that is in view at the start, through glass or past everything else."""
_BEYOND = (0.2, 0.9)
"""Range of the angle by which an obstacle stands beyond the way that it is to bar, seen from the free one, rad."""
_ACROSS = (0.0, 0.3)
"""The same for what is to stand in a line of sight, rad."""
_STEP_OUT = 0.02
"""An obstacle that is in the free way is moved out by this much at a time, m."""
_FIRST_CANDIDATES, _CANDIDATES = 12, 36
"""Candidates for the first obstacle and for the others."""
_ACROSS_TRIES, _MOVER_TRIES = 40, 40
"""Tries for what is to stand in a line of sight, and for what moves."""
_THING = OBSTACLE_KINDS[0]


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
class Candidate:
    """What has room, if no other were there, and the ways that it bars."""

    draft: Draft
    barred: MaskArray
    """Ways of the reach's grid that it bars."""
    first: bool
    """Whether it was drawn as the first one of its scene."""


@dataclass(frozen=True, eq=False)
class Pool:
    """Candidates for the obstacles of a scene; rows and columns of its arrays are in their order."""

    candidates: list[Candidate]
    barred: MaskArray
    """Ways that each of them bars, shape (n, ways)."""
    clashes: MaskArray
    """Which of them have no room beside each other, shape (n, n)."""
    first: MaskArray
    """Which of them were drawn as first ones, shape (n,)."""

    @classmethod
    def of(cls, candidates: list[Candidate]) -> Pool:
        """The pool of these candidates."""
        barred = np.array([candidate.barred for candidate in candidates])
        clashes = meeting_pairs([candidate.draft.boxes for candidate in candidates], OBSTACLE_GAP)
        mirrors = np.array([candidate.draft.material == "mirror" for candidate in candidates])
        clashes |= np.outer(mirrors, mirrors)  # MuJoCo draws one reflection only
        return cls(candidates, barred, clashes, np.array([candidate.first for candidate in candidates]))

    def can_bar(self, goal: Goal) -> bool:
        """Whether all of them together would bar enough."""
        return _are_barred(goal, ~np.logical_or.reduce(self.barred, axis=0))


def draw_candidates(scenario: Scenario, goal: Goal, rng: np.random.Generator) -> list[Candidate]:
    """Obstacles that leave the free way, each as if it were alone; none if there is none to begin with."""
    first = [_draw_candidate(scenario, goal, True, _way(goal, rng), rng) for _ in range(_FIRST_CANDIDATES)]
    if not any(first):
        return []
    others = [_draw_candidate(scenario, goal, False, _way(goal, rng), rng) for _ in range(_CANDIDATES)]
    return [candidate for candidate in first + others if candidate is not None]


def draw_across(scenario: Scenario, goal: Goal, view: View, rng: np.random.Generator) -> list[Candidate]:
    """First obstacles that the first line of sight passes through."""
    sight = goal.ways[view.first_sight]
    drawn = (_draw_draft(scenario, goal, True, sight, _ACROSS, rng) for _ in range(_ACROSS_TRIES))
    through = [item for item in drawn if item and passes_through(item.box, view.camera, goal.room.ends[0])]
    return [_candidate(goal, draft, True) for draft in through[:_FIRST_CANDIDATES]]


def bar_ways(
    scenario: Scenario, goal: Goal, view: View, pool: Pool, rng: np.random.Generator
) -> list[ObstacleSpec] | None:
    """Obstacles out of the pool that bar all ways but those near the free one; None if there are none.

    Those that bar most are taken, if they have room beside the others and do not hide the target.
    """
    hand = joined([hand_boxes(view.pose), *view.taken])
    usable = np.array([not boxes_meet(item.draft.boxes, hand, _START_ROOM) for item in pool.candidates])
    open_ways = ~np.logical_or.reduce(pool.barred[usable], axis=0)
    if not _is_barred(goal, view, open_ways):
        return None
    for first in np.flatnonzero(pool.first & usable):
        draft = pool.candidates[first].draft
        if scenario.through_sight and not passes_through(draft.box, view.camera, goal.room.ends[0]):
            continue
        chosen = [pool.candidates[index] for index in _covering(scenario, goal, view, pool, int(first), usable)]
        obstacles = [item.draft.finished(scenario, rng) for item in chosen]
        if not chosen or (scenario.discovery and not _is_discovered(goal, view, chosen, obstacles)):
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
        mover = draw_mover(scenario, _THING, str(rng.choice(materials)), goal.room.ends[-1], rng)
        boxes = mover.boxes
        if not goal.room.holds(boxes) or boxes_meet(boxes, joined(taken), OBSTACLE_GAP):
            continue
        if boxes_meet(boxes, hand, _START_ROOM):
            continue
        if visible_share(view.camera, goal.target, [*obstacles, mover]) >= _LEAST_VISIBLE:
            obstacles.append(mover)
            taken.append(boxes)
    return None


def _covering(scenario: Scenario, goal: Goal, view: View, pool: Pool, first: int, usable: MaskArray) -> list[int]:
    """Indices of ``first`` and of those others that bar enough with it; none if they do not."""
    least, most = scenario.obstacle_count
    chosen, open_ways = [first], ~pool.barred[first]
    left = usable & ~pool.clashes[first] & ~pool.first
    while len(chosen) < least or not _is_barred(goal, view, open_ways):
        gains = np.where(left, (pool.barred & open_ways).sum(axis=1), -1)
        best = int(np.argmax(gains))
        if len(chosen) == most or gains[best] < 0 or (gains[best] == 0 and len(chosen) >= least):
            return []
        chosen.append(best)
        open_ways = open_ways & ~pool.barred[best]
        left &= ~pool.clashes[best]
        left[best] = False
    return chosen


def _is_barred(goal: Goal, view: View, open_ways: MaskArray) -> bool:
    """Whether the first line of sight and enough of all other ways are barred."""
    return not open_ways[view.first_sight] and _are_barred(goal, open_ways)


def _are_barred(goal: Goal, open_ways: MaskArray) -> bool:
    """Whether enough ways are barred.

    Also of those from above, and of those among which the free one is drawn: a shelf leaves only low ways, and a hand
    that always comes in low must not find most of them open.
    """
    above = _ABOVE & ~goal.near_free
    return bool(
        open_ways.mean() <= _MOST_OPEN
        and open_ways[goal.drawn_among].mean() <= _MOST_AMONG
        and (not above.any() or open_ways[above].mean() <= _MOST_ABOVE)
    )


def _is_discovered(goal: Goal, view: View, chosen: list[Candidate], obstacles: list[ObstacleSpec]) -> bool:
    """Whether the nearest way that the first obstacle leaves is barred by something out of view at the start."""
    nearness = np.where(chosen[0].barred | goal.near_free, -1.0, goal.ways @ goal.ways[view.first_sight])
    natural = int(np.argmax(nearness))
    return any(
        item.barred[natural] and not is_seen(obstacle, view.pose, obstacles[:1])
        for item, obstacle in zip(chosen[1:], obstacles[1:], strict=True)
    )


def _draw_candidate(
    scenario: Scenario, goal: Goal, first: bool, way: FloatArray, rng: np.random.Generator
) -> Candidate | None:
    """An obstacle to bar ``way``; None if it has no room."""
    draft = _draw_draft(scenario, goal, first, way, _BEYOND, rng)
    return None if draft is None else _candidate(goal, draft, first)


def _candidate(goal: Goal, draft: Draft, first: bool) -> Candidate:
    return Candidate(draft, barred_directions(goal.room.ends[-1], draft.boxes, goal.ways, _BARRED_DEPTH), first)


def _draw_draft(
    scenario: Scenario,
    goal: Goal,
    first: bool,
    way: FloatArray,
    past: tuple[float, float],
    rng: np.random.Generator,
) -> Draft | None:
    """An obstacle beyond ``way`` by an angle in ``past``, as near to the target as the free ways allow.

    None if it has no room.
    """
    beyond = _beyond(goal.free.direction, way, rng.uniform(*past))
    drawn = draw_kind(scenario, first, float(beyond[2]), rng)
    if drawn is None:
        return None
    kind, material = drawn
    bearing = goal.free.azimuth if kind.around else math.atan2(-beyond[1], -beyond[0]) + rng.normal(0.0, 0.2)
    nearest, farthest = kind.distance
    draft = draw_obstacle(kind, material, goal.room.ends[-1], bearing, nearest, rng)
    outward = bearing + math.pi if kind.around else bearing  # what stands around the target draws back from the way
    step = np.array([-_STEP_OUT * math.cos(outward), -_STEP_OUT * math.sin(outward), 0.0])
    steps = goal.room.first_place(draft.boxes, step, int((farthest - nearest) / _STEP_OUT))
    return None if steps is None else draft.moved(steps * step)


def _way(goal: Goal, rng: np.random.Generator) -> FloatArray:
    """A way to be barred; half of them come from above, which is the harder to bar."""
    return goal.ways[rng.choice(np.flatnonzero(_ABOVE)) if rng.random() < 0.5 else rng.integers(len(goal.ways))]


def _beyond(free: FloatArray, way: FloatArray, angle: float) -> FloatArray:
    """The direction that lies beyond ``way``, seen from the free one, by ``angle`` rad, but above the table.

    What stands there bars the way without being in the free one: the hand is wide.
    """
    along = float(way @ free)
    across = way - along * free
    total = math.acos(min(max(along, -1.0), 1.0)) + angle
    direction = math.cos(total) * free + math.sin(total) / max(math.hypot(*across), 1e-9) * across
    direction[2] = max(direction[2], 0.05)
    return direction / math.hypot(*direction)
