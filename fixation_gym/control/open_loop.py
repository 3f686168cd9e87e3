"""The open-loop manoeuvres: tool to the target, close, lift; and backing off after a failure.

A manoeuvre is a value. ``advance`` gives the next one for what the robot reads, ``manoeuvre_twist`` and
``gripper_command`` what to do in it. The servo policy and ``FixationPickZFC-v0`` share it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from fixation_gym.control import servo_laws
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray

_LIFT_SLOPE = 0.15
"""How much more steeply than it came the hand lifts, per length of its way."""
OPEN, CLOSE = -1.0, 1.0
"""Gripper commands."""


class Stage(str, Enum):
    """Part of a manoeuvre."""

    GRASP = "grasp"
    """The tool goes to the target."""
    CLOSE = "close"
    LIFT = "lift"
    RECOVER = "recover"
    """The hand backs off with open fingers."""


@dataclass(frozen=True)
class OpenLoopGains:
    """Numbers of the manoeuvres."""

    tool_gain: float = 4.0
    """Rate at which the tool nears its goal, 1/s."""
    tool_speed: float = 0.10
    """Largest speed, m/s."""
    funnel_slope: float = 2.0
    """In the grasp, how far the tool stays back per metre that it is off the approach axis."""
    funnel_length: float = 0.06
    """Largest distance that it stays back, m."""
    tool_tolerance: float = 0.001
    """Distance at which the tool has arrived, m: small balls slip out of fingers that close higher up ..."""
    coarse_tolerance: float = 0.004
    """... and the distance that is good enough ..."""
    patience: float = 2.2
    """... after this time: an arm that touches something may come no nearer, s."""
    grasp_height: float = 0.85
    """Height of the grasp above the support surface as a share of the point's: many things are widest below it."""
    highest_grasp: float = 1.15
    """Height up to which a turned hand may have to stay, as a share of the point's above the support surface."""
    finger_room: float = 0.002
    """Least height of the open fingers above the support surface, m."""
    top_room: float = 0.006
    """However flat the fingers come in, the tool stays this far below the top of the target, m."""
    past_palm: float = 0.012
    """How much farther the tool may go than the palm allows, m. All grasps were measured so; less was not tried."""
    reaim_distance: float = 0.008
    """A grasp is aimed again when the target is farther than this from where it was, m."""
    grasp_timeout: float = 4.0
    """A motion that takes longer has failed, s."""
    close_seconds: float = 0.8
    """Time to close the fingers, s."""
    empty_width: float = 0.012
    """Fingers closer than this hold nothing, m."""
    lift_height: float = 0.17
    """How far to lift, m."""
    hold_seconds: float = math.inf
    """After this time in the lift the hand lets go and backs off, s; inf: it holds on."""
    recover_distance: float = 0.12
    """How far to back off, m."""


@dataclass(frozen=True, slots=True, eq=False)
class Manoeuvre:
    """What the hand does without looking."""

    stage: Stage
    started: float
    """Time at which the stage began, s."""
    goal: FloatArray
    """Camera position in base at which the stage's motion ends, shape (3,), m."""


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """What is grasped."""

    point: FloatArray
    """Its centre, or, if ``reach`` is unknown, the middle of its visible surface, in base, shape (3,), m."""
    reach: float | None
    """How far it reaches from its centre towards the camera, along the optical axis, m; None if unknown."""
    support_height: float | None
    """Height of the table in base, m; None if unknown."""


def begin_grasp(T_base_cam: FloatArray, target: Target, time: float, gains: OpenLoopGains) -> Manoeuvre:
    """Start the grasp: a little below the centre, but no deeper than the palm allows.

    Args:
        T_base_cam: camera pose, shape (4, 4); the hand keeps its orientation.
        target: what to grasp.
        time: s.
        gains: numbers of the manoeuvre.
    """
    point, support = target.point.copy(), target.support_height
    if support is not None and target.reach is not None:
        point[2] = support + gains.grasp_height * (point[2] - support)
    if target.reach is not None:
        axis, deepest = T_base_cam[:3, 2], ROBOT.hand.palm + gains.past_palm
        point -= axis * max(0.0, target.reach + float(axis @ (point - target.point)) - deepest)
    if support is not None:
        point[2] = max(point[2], lowest_grasp(T_base_cam, float(target.point[2]), support, gains))
    return Manoeuvre(Stage.GRASP, time, point - T_base_cam[:3, :3] @ ROBOT.tool_in_camera)


def lowest_grasp(T_base_cam: FloatArray, centre_height: float, support: float, gains: OpenLoopGains) -> float:
    """Least height of the tool in base, m, at which the open fingers keep off the table, but within the target.

    Args:
        T_base_cam: camera pose, shape (4, 4).
        centre_height: of the target's centre in base, m.
        support: height of the table in base, m.
        gains: numbers of the manoeuvre.
    """
    lowest = support + gains.finger_room + float(np.abs(T_base_cam[2, :3]) @ ROBOT.hand.finger_reach)
    return min(lowest, 2.0 * centre_height - support - gains.top_room)


def largest_roll(T_base_cam: FloatArray, target: Target, gains: OpenLoopGains) -> float:
    """Largest roll against level, rad, with which the open fingers still come down to the grasp; at most a right angle.

    Turned hands reach lower on one side, so they must stay higher: what is low slips out above its middle. Without a
    support height or a known body nothing is known against turning.

    Args:
        T_base_cam: camera pose, shape (4, 4).
        target: what to grasp.
        gains: numbers of the manoeuvre.
    """
    if target.support_height is None or target.reach is None:
        return math.pi / 2.0
    flat, steep = math.hypot(T_base_cam[2, 0], T_base_cam[2, 1]), abs(float(T_base_cam[2, 2]))
    rolls = np.linspace(0.0, math.pi / 2.0, 91)
    along, across, ahead = ROBOT.hand.finger_reach
    lowest = gains.finger_room + flat * (along * np.sin(rolls) + across * np.cos(rolls)) + steep * ahead
    highest = gains.highest_grasp * (float(target.point[2]) - target.support_height)
    return float(rolls[max(1, int(np.count_nonzero(np.maximum.accumulate(lowest) <= highest))) - 1])


def reaimed(manoeuvre: Manoeuvre, T_base_cam: FloatArray, target: Target, gains: OpenLoopGains) -> Manoeuvre:
    """The grasp with a new goal if the target was pushed, or is known only now; other manoeuvres as they are."""
    if manoeuvre.stage is not Stage.GRASP:
        return manoeuvre
    goal = begin_grasp(T_base_cam, target, manoeuvre.started, gains).goal
    pushed = float(np.linalg.norm(goal - manoeuvre.goal)) > gains.reaim_distance
    return replace(manoeuvre, goal=goal) if pushed else manoeuvre


def lifted(T_base_cam: FloatArray, height: float) -> FloatArray:
    """Camera position, shape (3,), in base, m, higher by ``height`` m: back the way the hand came, which was free.

    A hand that came in flat goes up more steeply, or the way would be long.
    """
    back = -T_base_cam[:3, 2]
    rise = np.array([back[0], back[1], max(float(back[2]), 0.0) + _LIFT_SLOPE])
    return np.asarray(T_base_cam[:3, 3] + height / rise[2] * rise)


def begin_recovery(T_base_cam: FloatArray, time: float, gains: OpenLoopGains) -> Manoeuvre:
    """Start backing off along the optical axis."""
    return Manoeuvre(Stage.RECOVER, time, T_base_cam[:3, 3] - T_base_cam[:3, 2] * gains.recover_distance)


def advance(
    manoeuvre: Manoeuvre, T_base_cam: FloatArray, gripper_width: float, time: float, gains: OpenLoopGains
) -> Manoeuvre | None:
    """Manoeuvre in which to act now; None when it is over.

    Args:
        manoeuvre: the one of the last control period.
        T_base_cam: camera pose, shape (4, 4).
        gripper_width: opening between the finger pads, m.
        time: s.
        gains: numbers of the manoeuvre.
    """
    seconds = time - manoeuvre.started
    tolerance = gains.tool_tolerance if seconds < gains.patience else gains.coarse_tolerance
    arrived = bool(np.linalg.norm(T_base_cam[:3, 3] - manoeuvre.goal) < tolerance)
    empty = gripper_width < gains.empty_width
    if manoeuvre.stage is Stage.RECOVER:
        return None if arrived or seconds > gains.grasp_timeout else manoeuvre
    if manoeuvre.stage is Stage.GRASP and arrived:
        return Manoeuvre(Stage.CLOSE, time, T_base_cam[:3, 3].copy())
    if manoeuvre.stage is Stage.CLOSE and seconds >= gains.close_seconds and not empty:
        return Manoeuvre(Stage.LIFT, time, lifted(T_base_cam, gains.lift_height))
    failed = {
        Stage.GRASP: seconds > gains.grasp_timeout,
        Stage.CLOSE: seconds >= gains.close_seconds,
        Stage.LIFT: empty or seconds > gains.hold_seconds,
    }[manoeuvre.stage]
    return begin_recovery(T_base_cam, time, gains) if failed else manoeuvre


def manoeuvre_twist(manoeuvre: Manoeuvre, T_base_cam: FloatArray, gains: OpenLoopGains) -> FloatArray:
    """Camera twist of the manoeuvre, shape (6,); the camera does not turn."""
    if manoeuvre.stage is Stage.CLOSE:
        return np.zeros(6)
    goal = manoeuvre.goal
    if manoeuvre.stage is Stage.GRASP:  # through a funnel: first in line with the approach axis, then forward
        goal = servo_laws.funnel_waypoint(T_base_cam, goal, gains.funnel_slope, gains.funnel_length)
    return servo_laws.pose_twist(T_base_cam, goal, gains.tool_gain, gains.tool_speed)


def gripper_command(manoeuvre: Manoeuvre | None) -> float:
    """``CLOSE`` while the hand closes or holds, ``OPEN`` otherwise."""
    return CLOSE if manoeuvre is not None and manoeuvre.stage in (Stage.CLOSE, Stage.LIFT) else OPEN
