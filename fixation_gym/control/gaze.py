"""Holding the gaze: rotation and roll that belong to a translation, the arm's reach, and the search for the target.

The servo policy and ``FixationPickZFC-v0`` share it: both choose where the camera goes, not where it looks. Pure
functions; velocities are of the camera in its own optical frame (x right, y down, z forward), m/s and rad/s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fixation_gym.control import servo_laws
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray

CENTRED = 0.06
"""Largest offset of the target from the image centre that counts as fixated, normalised coordinates. While the gaze
still swings to it, small errors of the time stamps look like motion."""


@dataclass(frozen=True)
class GazeGains:
    """Numbers of the gaze."""

    gaze_gain: float = 4.0
    """lambda_XY of Eq. 6: decay rate of the target's offset from the image centre, 1/s."""
    feed_forward: bool = True
    """Whether the flow that the camera's own motion causes is fed forward; the paper's Eq. 6 does without."""
    roll_gain: float = 1.5
    """Rate at which the roll error decays, 1/s."""
    max_roll: float = math.radians(50.0)
    """Largest roll of the hand against level, rad."""
    align_distance: float = 0.32
    """Below this distance the gripper is turned across the target's narrow axis, m."""
    level_fade: float = 6.0
    """The hand is levelled fully while the gaze is off the vertical by more than 1 / ``level_fade`` rad."""
    azimuth_slack: float = math.radians(4.0)
    """How far beyond the arm's reach the camera may go around the target, rad."""
    search_rate: float = 0.35
    """Turning rate of the search, rad/s."""
    search_widening: float = 3.2
    """The search turns by this angle times the square root of its seconds, so its circles widen, rad."""


def elevation(T_base_cam: FloatArray) -> float:
    """Angle by which the optical axis points down from the horizontal, rad."""
    return math.asin(float(np.clip(-T_base_cam[2, 2], -1.0, 1.0)))


def roll(T_base_cam: FloatArray) -> float:
    """Roll of the camera against level about the optical axis, rad, positive clockwise in the image."""
    return -math.atan2(T_base_cam[2, 0], -T_base_cam[2, 1])


def levelling(T_base_cam: FloatArray, gains: GazeGains) -> float:
    """Angle about the optical axis that levels the camera, rad; it fades where level is undefined: straight down."""
    off_vertical = float(np.hypot(T_base_cam[2, 0], T_base_cam[2, 1]))
    return -roll(T_base_cam) * min(1.0, gains.level_fade * off_vertical)


def within_reach(lateral: FloatArray, T_base_cam: FloatArray, target: FloatArray, gains: GazeGains) -> FloatArray:
    """Lateral velocity without the part that would carry the camera out of the arm's comfortable reach.

    Args:
        lateral: (v_X, v_Y), m/s.
        T_base_cam: camera pose, shape (4, 4).
        target: fixated point in base, shape (3,), m.
        gains: the limits.
    """
    gaze = target - T_base_cam[:3, 3]
    azimuth = math.atan2(gaze[1], gaze[0]) - math.atan2(target[1], target[0])
    azimuth = (azimuth + math.pi) % (2.0 * math.pi) - math.pi
    # Moving right (+x) around the target raises the azimuth, moving up (-y) raises the elevation.
    height = elevation(T_base_cam)
    low, high = ROBOT.arm.reach.azimuths(height)
    slack = gains.azimuth_slack
    v_x = lateral[0]
    if azimuth < low - slack or azimuth > high + slack:
        v_x = max(v_x, 0.0) if azimuth < low else min(v_x, 0.0)
    v_y, (lowest, highest) = lateral[1], ROBOT.arm.reach.orbit
    if height > highest or height < lowest:
        v_y = max(v_y, 0.0) if height > highest else min(v_y, 0.0)
    return np.array([v_x, v_y])


def fixating_twist(
    v: FloatArray, centroid: FloatArray, distance: float, roll_error: float, gains: GazeGains
) -> FloatArray:
    """Twist, shape (6,), that moves the camera as asked and keeps the target in the image centre (Eq. 6).

    Args:
        v: camera velocity, shape (3,).
        centroid: normalised image coordinates of the target, shape (2,).
        distance: Z_f, m.
        roll_error: angle to turn about the optical axis, rad.
        gains: of gaze and roll.
    """
    w_z = servo_laws.roll_rate(roll_error, gains.roll_gain)
    fed_v, fed_w_z = (v, w_z) if gains.feed_forward else (np.zeros(3), 0.0)
    w = servo_laws.gaze_rotation(centroid, gains.gaze_gain, 1.0 / distance, fed_v, fed_w_z)
    return np.array([*v, *w, w_z])


def searching_twist(seconds: float, gains: GazeGains) -> FloatArray:
    """Twist, shape (6,), that turns the camera on a widening spiral about where it looked first.

    Args:
        seconds: time since the search began.
        gains: rate and widening.
    """
    phase = gains.search_widening * math.sqrt(max(seconds, 0.0))
    twist = np.zeros(6)
    twist[3:5] = gains.search_rate * np.array([math.cos(phase), math.sin(phase)])
    return twist


def within_speed(twist: FloatArray) -> FloatArray:
    """Twist, shape (6,), slowed down as a whole to what the camera may do, so that it keeps its direction."""
    return twist / max(1.0, float(np.max(np.abs(twist) / ROBOT.arm.twist_limits)))
