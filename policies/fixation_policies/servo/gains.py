"""All numbers of the servo behaviour in one place."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from fixation_gym.control.gaze import CENTRED, GazeGains
from fixation_gym.control.open_loop import OpenLoopGains
from fixation_gym.control.ways import BARRING_EVIDENCE, WAY_MARGIN, WayCosts


@dataclass(frozen=True)
class ServoGains:
    """Gains and limits; velocities are of the camera."""

    gaze: GazeGains = field(default_factory=GazeGains)
    """Of gaze, roll, reach and search."""
    open_loop: OpenLoopGains = field(default_factory=OpenLoopGains)
    """Of grasp, lift and recovery."""
    desired_distance: float = 0.17
    """Z_d, m: from here the grasp is open loop. Nearer, large targets leave the image."""
    approach_gain: float = 0.18
    """lambda_Z of Eq. 7, m/s."""
    approach_speed: float = 0.11
    """Largest speed of the approach, m/s."""
    cycle_amplitude: float = 0.02
    """Radius of the circle of Eq. 8, m."""
    cycle_rate: float = 2.0
    """Angular rate of the circle, rad/s."""
    turn_gain: float = 2.5
    """lambda_obs of Eq. 8: speed around the target per metre that the camera is off its way, 1/s."""
    turn_speed: float = 0.13
    """Largest speed around the target, m/s."""
    orbit_distance: float = 0.47
    """The camera goes around the target at this distance at least, m: farther out than what stands there."""
    on_way: float = math.radians(7.0)
    """Angle to its way within which the hand goes in, rad."""
    seen_share: float = 0.75
    """Share of a corridor, at every distance from the target, that must have been seen before the hand goes in ..."""
    look_seconds: float = 3.0
    """... or it has looked for so long, s. Near by the hand is wider than the image, so it looks to both sides."""
    look_angle: float = 0.12
    """Angle about the target by which it wants to go aside while it looks, rad."""
    wait_seconds: float = 1.5
    """A way that stays surely barred for so long was tried in vain, s."""
    costs: WayCosts = field(default_factory=WayCosts)
    """Of ways."""
    obstacle_margin: float = 0.002
    """Room to keep between hand and obstacles, m."""
    way_margin: float = WAY_MARGIN
    """How far off remembered points may be, m: ways are compared by hands that are smaller and larger by this."""
    obstacle_evidence: float = BARRING_EVIDENCE
    """Evidence in the corridor (points times frames) that stops the approach; less slows it down."""
    retreat_gap: float = 0.08
    """An obstacle nearer than this before the finger tips makes the hand retreat, m."""
    retreat_speed: float = 0.08
    """Speed of retreats, m/s."""
    hand_room: float = 0.03
    """What is nearer to the hand than this, in view or not, makes it back off, m."""
    search_climb: float = 0.06
    """Speed at which the search rises while no way was chosen yet, m/s."""
    fixate_seconds: float = 0.8
    """Shortest time of looking before the approach: obstacles have to move in the image to be seen, s."""
    fixate_patience: float = 2.0
    """After this time without a sure distance it looks from farther up, s."""
    fixate_relative_std: float = 0.05
    """Relative distance error below which the approach starts."""
    grasp_tolerance: float = 1.10
    """The grasp starts below this multiple of ``desired_distance``."""
    grasp_relative_std: float = 0.03
    """Relative distance error needed for the grasp."""
    grasp_centred: float = CENTRED
    """Largest offset of the target from the image centre for the grasp, normalised coordinates."""
    grasp_excess_roll: float = 0.02
    """By how much more than low fingers allow the hand may be turned at the grasp, rad: circling turns it to and fro by
    0.1 ..."""
    level_patience: float = 15.0
    """... until it has approached for so long, s."""
    max_grasps: float = math.inf
    """After this many grasps it tries no other."""
    lost_seconds: float = 0.6
    """Time without sight of the target after which the robot looks for it, s."""
    search_distance: float = 0.40
    """The search backs off to this distance of that place, or of the table while there is none, m."""
    search_retreat_speed: float = 0.08
    """Speed of backing off, m/s."""
    search_seconds: float = 4.0
    """After this time the search looks elsewhere, too, s."""
