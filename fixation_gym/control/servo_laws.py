"""The paper's three servo laws (Battaje & Brock 2022, Eqs. 6-8) with corrected rotation signs. Pure functions.

All velocities are of the camera in its own optical frame (x right, y down, z forward), m/s and rad/s.
"""

from __future__ import annotations

import math

import numpy as np

from fixation_gym.geometry.interaction import rotation_part, translation_part
from fixation_gym.types import FloatArray

_IN_LINE = 0.005
"""Offset from the axis that counts as none, m."""


def gaze_rotation(
    centroid: FloatArray, gain: float, inverse_distance: float, v: FloatArray, roll_rate: float
) -> FloatArray:
    """Rotation (w_X, w_Y), rad/s, that brings the target to the image centre and holds it there (Eq. 6).

    The paper's law w = lambda B^-1 e has the sign of the scene's rotation and lags behind the camera's own motion.
    Here the centroid decays as e_dot = -gain e, because the flow that (v, roll_rate) causes is fed forward:
    B_xy w_xy = -gain e - d_f A v - B_z w_z.

    Args:
        centroid: normalised image coordinates of the target, shape (2,).
        gain: decay rate, 1/s.
        inverse_distance: estimated d_f, 1/m.
        v: camera velocity that is going to be commanded, shape (3,).
        roll_rate: w_Z that is going to be commanded, rad/s.
    """
    rotation = rotation_part(*centroid)
    caused = inverse_distance * translation_part(*centroid) @ v + rotation[:, 2] * roll_rate
    return np.linalg.solve(rotation[:, :2], -gain * np.asarray(centroid) - caused)


def approach_speed(distance: float, desired_distance: float, gain: float) -> float:
    """v_Z, m/s: forward when farther than desired, backward when nearer (Eq. 7 with the sign of Eq. 1).

    Raises:
        ValueError: if a distance is not positive.
    """
    if not (distance > 0.0 and desired_distance > 0.0):
        raise ValueError(f"distances must be positive, got {distance} m and {desired_distance} m")
    return gain * math.log(distance / desired_distance)


def cyclic_velocity(time: float, amplitude: float, rate: float) -> FloatArray:
    """Lateral velocity (v_X, v_Y), m/s, of a circle of radius ``amplitude`` m at ``rate`` rad/s (term of Eq. 8)."""
    phase = rate * time
    return amplitude * rate * np.array([math.sin(phase), math.cos(phase)])


def lateral_velocity(
    distance: float,
    desired_distance: float,
    distance_gain: FloatArray,
    time: float,
    cycle_amplitude: float,
    cycle_rate: float,
    obstacle_gain: float,
    obstacle: FloatArray,
) -> FloatArray:
    """(v_X, v_Y), m/s: move while far, cycle so that distance stays observable, avoid obstacles (Eq. 8).

    Args:
        distance: estimated Z_f, m.
        desired_distance: Z_d, m.
        distance_gain: lateral velocity per metre of Z_f - Z_d, shape (2,), 1/s.
        time: s; phase of the cycle.
        cycle_amplitude: radius of the circle that the camera describes, m.
        cycle_rate: its angular rate, rad/s.
        obstacle_gain: speed per unit of ``obstacle``, m/s.
        obstacle: obs_xy, shape (2,): where the obstacles are in the image, length at most 1.
    """
    cycle = cyclic_velocity(time, cycle_amplitude, cycle_rate)
    return np.asarray(distance_gain) * (distance - desired_distance) + cycle - obstacle_gain * np.asarray(obstacle)


def funnel_waypoint(T_base_cam: FloatArray, goal: FloatArray, slope: float, length: float) -> FloatArray:
    """Camera position to head for so that the tool comes to its goal along the optical axis, shape (3,), in base, m.

    Args:
        T_base_cam: camera pose, shape (4, 4).
        goal: final camera position in base, shape (3,).
        slope: how far to stay back per metre off the axis.
        length: largest distance to stay back, m.
    """
    axis, offset = T_base_cam[:3, 2], goal - T_base_cam[:3, 3]
    aside = float(np.linalg.norm(offset - axis * (axis @ offset)))
    return goal - axis * min(slope * max(0.0, aside - _IN_LINE), length)


def roll_rate(roll_error: float, gain: float) -> float:
    """w_Z, rad/s, that turns the image by ``roll_error`` rad (positive: the camera turns clockwise)."""
    return gain * roll_error


def pose_twist(T_base_cam: FloatArray, goal_position: FloatArray, gain: float, speed_limit: float) -> FloatArray:
    """Twist, shape (6,), that moves the camera straight to a position in base without turning it."""
    offset = T_base_cam[:3, :3].T @ (goal_position - T_base_cam[:3, 3])
    velocity = gain * offset
    speed = float(np.linalg.norm(velocity))
    if speed > speed_limit:
        velocity *= speed_limit / speed
    return np.concatenate([velocity, np.zeros(3)])
