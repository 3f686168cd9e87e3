"""Phases of the behaviour and the conditions between them, as one pure function."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from policies.servo.gains import ServoGains


class Phase(str, Enum):
    """What the robot is doing."""

    SEARCH = "search"
    FIXATE = "fixate"
    APPROACH = "approach"
    GRASP = "grasp"
    CLOSE = "close"
    LIFT = "lift"
    RECOVER = "recover"


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
    """Its standard deviation, m."""
    offset: float
    """Distance of the target from the image centre, normalised coordinates."""
    blocked: bool
    """Whether something stands in the way of the hand."""
    arrived: bool
    """Whether an open-loop motion has reached its goal."""
    gripper_width: float
    """Opening between the finger pads, m."""


def next_phase(phase: Phase, now: Situation, gains: ServoGains) -> Phase:
    """Phase in which to act now."""
    lost = now.unseen_seconds > gains.lost_seconds
    if phase is Phase.SEARCH:
        return Phase.SEARCH if lost else Phase.FIXATE
    if phase in (Phase.FIXATE, Phase.APPROACH):
        return Phase.RECOVER if lost else _while_looking(phase, now, gains)
    if phase is Phase.RECOVER:
        if now.arrived or now.phase_seconds > gains.grasp_timeout:
            return Phase.SEARCH if lost else Phase.FIXATE
        return Phase.RECOVER
    return _open_loop(phase, now, gains)


def _while_looking(phase: Phase, now: Situation, gains: ServoGains) -> Phase:
    """Go on when the distance is known well enough for the next step and nothing is in the way."""
    relative_std = now.distance_std / now.distance
    if phase is Phase.FIXATE:
        known = relative_std < gains.fixate_relative_std and now.phase_seconds > gains.fixate_seconds
        return Phase.APPROACH if known else Phase.FIXATE
    near = now.distance < gains.grasp_tolerance * gains.desired_distance
    sure = relative_std < gains.grasp_relative_std and now.offset < gains.grasp_centred
    return Phase.GRASP if near and sure and not now.blocked else Phase.APPROACH


def _open_loop(phase: Phase, now: Situation, gains: ServoGains) -> Phase:
    """Tool to the target, close, lift; give up when it takes too long or the fingers are empty."""
    if phase is Phase.GRASP:
        late = now.phase_seconds > gains.grasp_timeout
        return Phase.CLOSE if now.arrived else Phase.RECOVER if late else Phase.GRASP
    closing = phase is Phase.CLOSE and now.phase_seconds < gains.close_seconds
    if not closing and now.gripper_width < gains.empty_width:
        return Phase.RECOVER
    return Phase.CLOSE if closing else Phase.LIFT
