"""All numbers of the servo behaviour in one place."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class ServoGains:
    """Gains and limits; velocities are of the camera."""

    gaze_gain: float = 4.0
    """lambda_XY of Eq. 6: decay rate of the target's offset from the image centre, 1/s."""
    desired_distance: float = 0.17
    """Z_d, m: from here the grasp is open loop. Nearer, large targets leave the image."""
    approach_gain: float = 0.12
    """lambda_Z of Eq. 7, m/s."""
    climb_gain: float = 0.15
    """lambda_dist of Eq. 8: speed upwards per metre of Z_f - Z_d, 1/s; grasps from above need less room."""
    climb_until: float = math.radians(65.0)
    """Elevation of the gaze above which the climb ends, rad."""
    highest_elevation: float = math.radians(84.0)
    """Elevation of the gaze at which the arm stops rising; beyond the vertical, up and down change places, rad."""
    azimuth_range: tuple[float, float] = (math.radians(-5.0), math.radians(80.0))
    """Azimuths of the gaze, against the direction from base to target, that the arm reaches without strain, rad."""
    cycle_amplitude: float = 0.02
    """Radius of the circle of Eq. 8, m."""
    cycle_rate: float = 2.0
    """Angular rate of the circle, rad/s."""
    obstacle_gain: float = 0.10
    """lambda_obs of Eq. 8: speed away from obstacles, m/s."""
    obstacle_up: float = 1.0
    """Share of "up" mixed into the way out, in half hand widths: obstacles stand on the table, none hangs above."""
    obstacle_margin: float = 0.01
    """Room to keep between hand and obstacles, m."""
    obstacle_evidence: float = 40.0
    """Evidence in the corridor (points times frames) that stops the approach."""
    retreat_gap: float = 0.08
    """An obstacle nearer than this before the finger tips makes the hand retreat, m."""
    retreat_speed: float = 0.05
    """Speed of retreats, m/s."""
    roll_gain: float = 1.5
    """Rate at which the roll error decays, 1/s."""
    max_roll: float = math.radians(50.0)
    """Largest roll of the hand against level, rad."""
    align_distance: float = 0.32
    """Below this distance the gripper is turned across the target's narrow axis, m."""
    fixate_seconds: float = 1.5
    """Shortest time of looking before the approach: obstacles have to move in the image to be seen, s."""
    fixate_relative_std: float = 0.05
    """Relative distance error below which the approach starts."""
    grasp_tolerance: float = 1.10
    """The grasp starts below this multiple of ``desired_distance``."""
    grasp_relative_std: float = 0.03
    """Relative distance error needed for the grasp."""
    grasp_centred: float = 0.06
    """Largest offset of the target from the image centre for the grasp, normalised coordinates."""
    tool_gain: float = 4.0
    """Rate at which the tool nears its goal in open-loop motions, 1/s."""
    tool_speed: float = 0.10
    """Largest speed of open-loop motions, m/s."""
    funnel_slope: float = 2.0
    """In the grasp, how far the tool stays back per metre that it is off the approach axis."""
    funnel_length: float = 0.06
    """Largest distance that it stays back, m."""
    tool_tolerance: float = 0.004
    """Distance at which the tool has arrived, m."""
    finger_room: float = 0.016
    """Least height of the tool above the support surface, m."""
    grasp_timeout: float = 4.0
    """An open-loop motion that takes longer has failed, s."""
    close_seconds: float = 0.8
    """Time to close the fingers, s."""
    empty_width: float = 0.012
    """Fingers closer than this hold nothing, m."""
    lift_height: float = 0.16
    """How far to lift, m."""
    lost_seconds: float = 0.6
    """Time without sight of the target after which the robot looks for it, s."""
    recover_distance: float = 0.12
    """How far to back off before looking again, m."""
    search_rate: float = 0.35
    """Turning rate of the search, rad/s."""
    search_widening: float = 3.2
    """The search turns by this angle times the square root of its seconds, so its circles widen, rad."""
    level_fade: float = 6.0
    """The hand is levelled fully while the gaze is off the vertical by more than 1 / ``level_fade`` rad."""
