"""Why an episode was no collision-free success: a pure function of its result and trace."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np

from fixation_gym.evaluation.rollout import APPROACH, GRASP, EpisodeResult
from fixation_gym.evaluation.trace import Trace

SEARCH, RECOVER = "search", "recover"
OPEN_LOOP = (GRASP, "close", "lift")
"""Phases in which the hand acts without looking."""
LIFTED_M = 0.03
"""A target that rose by this much was off the table."""
REACHED_M = 0.20
"""Depth of the target below which the hand has arrived: the open-loop grasp starts at 0.17 to 0.19 m."""


class FailureKind(str, Enum):
    """What went wrong first, or most."""

    COLLISION = "collision"
    """The robot hit an obstacle, whether or not it then picked the target."""
    NEVER_FOUND = "never found"
    """It searched for the target all the time."""
    DROPPED = "dropped"
    """The target was lifted, and fell."""
    LOST_TARGET = "lost target"
    """It had the target in view, and at the end was searching for it."""
    GRASP_MISSED = "grasp missed"
    """It closed its fingers on nothing, once or more."""
    BLOCKED = "never approached"
    """It knew the target, but never came near it: something was, or seemed to be, in the way."""
    TIMED_OUT = "timed out"
    """None of these; the time was over."""


@dataclass(frozen=True)
class Failure:
    """A classified failure."""

    kind: FailureKind
    phase: str
    """What the policy was doing when it failed; "" if it does not say."""
    time_s: float | None
    """When it failed, s; None if the trace does not tell."""
    detail: str
    """A sentence for people."""


def classify(result: EpisodeResult, trace: Trace | None) -> Failure | None:
    """Say why an episode failed.

    The first rule that holds decides: collision, never found, dropped, lost target, grasp missed, never approached,
    timed out. Without a trace, only what the result says is used: times are unknown, and a drop counts as a missed
    grasp.

    Returns:
        None for a success without collision.
    """
    if result.collision_free_success:
        return None
    if trace is None:
        return _without_trace(result)
    if result.collision:
        return _collision(result, trace)
    phase = trace.phases[-1]
    end = float(trace.time_s[-1])
    since = _start_of_last(trace)
    tries = grasps(trace)
    attempts = f"{tries} grasp{'' if tries == 1 else 's'}"
    if set(trace.phases) <= {SEARCH, RECOVER}:
        return Failure(FailureKind.NEVER_FOUND, phase, end, f"searched for {end:.1f} s")
    fall = _fall(trace)
    if fall is not None:
        height = 100.0 * float(np.nanmax(trace.target_rise_m))
        return Failure(FailureKind.DROPPED, trace.phases[fall], float(trace.time_s[fall]), f"from {height:.0f} cm")
    if phase == SEARCH:
        return Failure(FailureKind.LOST_TARGET, phase, since, f"searching from {since:.1f} s on, after {attempts}")
    if tries and phase not in OPEN_LOOP:
        return Failure(FailureKind.GRASP_MISSED, phase, since, f"{attempts}, {_grasp_error(result)}")
    return _unfinished(trace)


def grasps(trace: Trace) -> int:
    """Number of times that a grasp began."""
    before = ("", *trace.phases[:-1])
    return sum(now == GRASP and last != GRASP for last, now in zip(before, trace.phases, strict=True))


def _collision(result: EpisodeResult, trace: Trace) -> Failure:
    row = int(np.argmax(trace.collided))
    phase, time = trace.phases[row], float(trace.time_s[row])
    doing = f" in {phase}" if phase else ""
    return Failure(FailureKind.COLLISION, phase, time, f"at {time:.1f} s{doing}; {_afterwards(result)}")


def _unfinished(trace: Trace) -> Failure:
    """Neither found wanting in sight nor in grasp: the way was not free, or the time too short."""
    phase, end = trace.phases[-1], float(trace.time_s[-1])
    nearest = float(np.nanmin(trace.distance_true_m)) if np.isfinite(trace.distance_true_m).any() else math.nan
    if APPROACH in trace.phases and not grasps(trace) and nearest > REACHED_M:
        return Failure(FailureKind.BLOCKED, phase, end, f"the camera came no nearer than {100 * nearest:.0f} cm")
    doing = f"in {phase} since {_start_of_last(trace):.1f} s" if phase else f"nearest {100 * nearest:.0f} cm"
    return Failure(FailureKind.TIMED_OUT, phase, end, doing)


def _without_trace(result: EpisodeResult) -> Failure:
    phase = result.final_phase or ""
    if result.collision:
        return Failure(FailureKind.COLLISION, phase, None, _afterwards(result))
    if phase == SEARCH:
        return Failure(FailureKind.LOST_TARGET, phase, result.time_s, "was searching at the end")
    if result.distance_error_at_grasp_m is not None and phase not in OPEN_LOOP:
        return Failure(FailureKind.GRASP_MISSED, phase, None, _grasp_error(result))
    if phase == APPROACH:
        return Failure(FailureKind.BLOCKED, phase, result.time_s, "never grasped")
    return Failure(FailureKind.TIMED_OUT, phase, result.time_s, f"in {phase}" if phase else "")


def _afterwards(result: EpisodeResult) -> str:
    return "picked the target all the same" if result.success else "did not pick the target"


def _grasp_error(result: EpisodeResult) -> str:
    error = result.distance_error_at_grasp_m
    return "distance error unknown" if error is None else f"distance error {1000 * error:.0f} mm"


def _start_of_last(trace: Trace) -> float:
    """Time at which the last phase began, s."""
    row = len(trace.phases) - 1
    while row > 0 and trace.phases[row - 1] == trace.phases[-1]:
        row -= 1
    return float(trace.time_s[row])


def _fall(trace: Trace) -> int | None:
    """Row in which a lifted target was down again for good; None if it never rose or is still up."""
    up = trace.target_rise_m > LIFTED_M
    if not up.any() or up[-1]:
        return None
    return int(np.flatnonzero(up)[-1]) + 1
