"""Phases of the behaviour while it looks, and the conditions between them, as one pure function.

The open-loop stages that follow are in ``fixation_gym.control.open_loop``.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from fixation_gym.control.open_loop import Stage
from fixation_policies.servo.gains import ServoGains


class Phase(str, Enum):
    """What the robot is doing while it looks."""

    SEARCH = "search"
    FIXATE = "fixate"
    APPROACH = "approach"


@dataclass(frozen=True)
class Situation:
    """What the transitions depend on."""

    phase_seconds: float
    """Time since the phase began, s."""
    unseen_seconds: float
    """Time since the target was last seen, s; inf if never."""
    distance: float
    """Z_f, m."""
    distance_std: float
    """How surely it is known, or the depth of the body's centre if that is known better: standard deviation, m."""
    offset: float
    """Distance of the target from the image centre, normalised coordinates."""
    blocked: bool
    """Whether something stands in the way of the hand."""
    excess_roll: float = 0.0
    """By how much the hand is turned farther than low fingers allow, rad."""
    grasps: int = 0
    """Number of grasps so far."""


def next_phase(phase: Phase, now: Situation, gains: ServoGains) -> Phase | Stage:
    """Phase in which to act now, or the stage with which an open-loop manoeuvre begins."""
    lost = now.unseen_seconds > gains.lost_seconds
    if phase is Phase.SEARCH:
        return Phase.SEARCH if lost else Phase.FIXATE
    if lost:
        return Phase.SEARCH
    relative_std = now.distance_std / now.distance
    if phase is Phase.FIXATE:
        known = relative_std < gains.fixate_relative_std and now.phase_seconds > gains.fixate_seconds
        return Phase.APPROACH if known else Phase.FIXATE
    near = now.distance < gains.grasp_tolerance * gains.desired_distance
    sure = relative_std < gains.grasp_relative_std and now.offset < gains.grasp_centred
    level = now.excess_roll < gains.grasp_excess_roll or now.phase_seconds > gains.level_patience
    may_grasp = level and not now.blocked and now.grasps < gains.max_grasps
    return Stage.GRASP if near and sure and may_grasp else Phase.APPROACH
