"""Torques that make the arm follow a camera twist: computed torque on the joint velocities of the twist.

Compiled: it runs at every physics substep, on views into the simulator's arrays. Loops fill arrays element by element:
numba takes seconds to compile the assignment of an array to a part of another one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fixation_gym.compiled import compiled
from fixation_gym.control.resolved_rate import DAMPING, LIMIT_GAIN, POSTURE_GAIN, JointLimits, joint_velocities
from fixation_gym.types import FloatArray

_VELOCITY_GAIN, _POSITION_GAIN = 40.0, 400.0
"""Error dynamics of the joints, 1/s and 1/s^2: critically damped at 20 rad/s."""
_MAX_WINDUP = 0.05
"""Largest lead of the integrated joint command over the joint, rad."""


class ArmDynamics(NamedTuple):
    """State of an arm of n revolute joints in the world frame."""

    joint_pos: FloatArray
    """Shape (n,), rad."""
    joint_vel: FloatArray
    """Shape (n,), rad/s."""
    anchors: FloatArray
    """A point on each joint axis, shape (n, 3), m."""
    axes: FloatArray
    """Unit vector along each joint axis, shape (n, 3)."""
    hand_position: FloatArray
    """Shape (3,), m."""
    hand_rotation: FloatArray
    """Columns are the hand's axes, shape (3, 3)."""
    mass: FloatArray
    """Joint-space inertia of the chain, packed by rows: M[i, 0] ... M[i, i-1], M[i, i], shape (n (n + 1) / 2,)."""
    bias: FloatArray
    """Gravity and Coriolis torques, shape (n,), N m."""
    passive: FloatArray
    """Damping and friction torques, shape (n,), N m."""


class ArmTask(NamedTuple):
    """What does not change while the arm moves."""

    hand_eye: FloatArray
    """T_hand_cam, shape (4, 4)."""
    joints: FloatArray
    """Rows: posture towards which the redundancy drifts, lower and upper limits, rad; largest speeds, rad/s; least and
    most torques, N m; shape (6, n). One array, since handing over several takes longer than the arithmetic."""
    time_step: float
    """Interval between two calls, s."""


@compiled
def camera_kinematics(arm: ArmDynamics, hand_eye: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Camera pose T_world_cam, shape (4, 4), and its twist, expressed in ``cam``, per joint velocity, shape (6, n)."""
    pose = np.zeros((4, 4))
    pose[3, 3] = 1.0
    for i in range(3):
        pose[i, 3] = arm.hand_position[i]
        for k in range(3):
            for j in range(4):
                pose[i, j] += arm.hand_rotation[i, k] * hand_eye[k, j]
    joints = len(arm.joint_pos)
    jacobian = np.empty((6, joints))
    for k in range(joints):
        ax, ay, az = arm.axes[k, 0], arm.axes[k, 1], arm.axes[k, 2]
        rx, ry, rz = pose[0, 3] - arm.anchors[k, 0], pose[1, 3] - arm.anchors[k, 1], pose[2, 3] - arm.anchors[k, 2]
        vx, vy, vz = ay * rz - az * ry, az * rx - ax * rz, ax * ry - ay * rx
        for i in range(3):
            cx, cy, cz = pose[0, i], pose[1, i], pose[2, i]
            jacobian[i, k] = cx * vx + cy * vy + cz * vz
            jacobian[3 + i, k] = cx * ax + cy * ay + cz * az
    return pose, jacobian


@compiled
def arm_torques(arm: ArmDynamics, task: ArmTask, twist: FloatArray, command: FloatArray, torques: FloatArray) -> None:
    """Computed-torque joint velocity control with an integrated position reference.

    Args:
        arm: state of the arm.
        task: posture, limits and time step.
        twist: desired camera twist [v, w] in ``cam``, shape (6,), m/s and rad/s.
        command: integrated joint reference, shape (n,), rad; advanced by one time step.
        torques: the result, shape (n,), N m.
    """
    _, jacobian = camera_kinematics(arm, task.hand_eye)
    # The types are those that other callers have, or numba would compile once more: rows by index are contiguous, those
    # of an unpacked array are not, and an argument that is left out has a type of its own.
    posture, least, most = task.joints[0], task.joints[4], task.joints[5]
    limits = JointLimits(task.joints[1], task.joints[2], task.joints[3])
    velocity = joint_velocities(jacobian, twist, arm.joint_pos, posture, limits, DAMPING, POSTURE_GAIN, LIMIT_GAIN)
    joints = len(velocity)
    acceleration = np.empty(joints)
    for k in range(joints):
        lead = command[k] + velocity[k] * task.time_step - arm.joint_pos[k]
        lead = min(max(lead, -_MAX_WINDUP), _MAX_WINDUP)
        command[k] = arm.joint_pos[k] + lead
        acceleration[k] = _VELOCITY_GAIN * (velocity[k] - arm.joint_vel[k]) + _POSITION_GAIN * lead
        torques[k] = arm.bias[k] - arm.passive[k]
    row = 0
    for i in range(joints):
        for back in range(i + 1):
            inertia = arm.mass[row + i - back]
            torques[i] += inertia * acceleration[i - back]
            if back > 0:
                torques[i - back] += inertia * acceleration[i]
        row += i + 1
    for k in range(joints):
        torques[k] = min(max(torques[k], least[k]), most[k])
