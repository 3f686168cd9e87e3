# pyright: reportAttributeAccessIssue=false
# (MuJoCo's functions have no type stubs.)
"""Simulation of the pick task: reset to a scene, step by a camera twist under torque control, read the truth.

MuJoCo's conventions (world frame, camera axes) stop here; what leaves this file is in the robot base frame and in the
optical camera frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from fixation_gym.control.resolved_rate import JointLimits, joint_velocities
from fixation_gym.envs import contacts, scene_mjcf
from fixation_gym.envs.robosuite_backend import BASE_BODY, HAND_BODY, ROBOT_BODIES, SceneExtension, build_task
from fixation_gym.envs.scene import SceneSpec
from fixation_gym.envs.scene_loader import SceneLoader
from fixation_gym.geometry.rigid import look_at
from fixation_gym.robot import HAND_EYE, TOOL_IN_HAND
from fixation_gym.types import FloatArray

POSTURE = np.array([-0.3, 0.07, -0.35, -2.5, 1.1, 2.28, -1.5])
"""Joint angles, rad, from which the start pose is sought and towards which the arm's redundancy drifts."""
JOINT_SPEED = np.array([2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61])
"""Franka's joint speed limits, rad/s."""
_VELOCITY_GAIN, _POSITION_GAIN = 40.0, 400.0
"""Error dynamics of the joint controller, 1/s and 1/s^2: critically damped at 20 rad/s."""
_MAX_WINDUP = 0.05
"""Largest lead of the integrated joint command over the joint, rad."""
_GRIPPER_SPEED = 0.10
"""Closing speed of one finger, m/s."""


@dataclass(frozen=True, eq=False)
class ArmState:
    """True state of the arm at one instant."""

    joint_pos: FloatArray
    joint_vel: FloatArray
    camera_pose: FloatArray
    """T_base_cam, shape (4, 4)."""
    jacobian: FloatArray
    """Camera twist expressed in ``cam`` per joint velocity, shape (6, 7)."""
    gripper_width: float


class PickSim:
    """MuJoCo simulation of the pick task: reset to a scene, step by a camera twist, read the truth."""

    def __init__(
        self, control_frequency: int, extend: SceneExtension | None = None, posture: FloatArray = POSTURE
    ) -> None:
        """Build and compile the model once; ``reset`` reuses it.

        Args:
            control_frequency: calls of ``step`` per second.
            extend: adds an experiment's own things to the model.
            posture: joint angles, shape (7,), rad, with the role of ``POSTURE``.
        """
        self._posture = posture
        task = build_task(control_frequency, extend)
        self.model: Any = task.sim.model._model
        self.data: Any = task.sim.data._data
        self._task = task  # owns model and data
        model = self.model
        mirror = model.mat("mirror_glass").id
        model.mat_reflectance[np.arange(model.nmat) != mirror] = 0.0
        # Pool shapes are resized at reset, the mid-phase's bounding trees are not.
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE
        self.substeps = round(1.0 / (control_frequency * model.opt.timestep))
        self._loader = SceneLoader(model)
        self._hand = model.body(HAND_BODY).id
        base = model.body(BASE_BODY).id
        mujoco.mj_kinematics(model, self.data)
        self._base_position = self.data.xpos[base].copy()
        assert np.allclose(self.data.xmat[base].reshape(3, 3), np.eye(3)), "base frame is assumed parallel to the world"
        self._arm = slice(0, 7)
        self._fingers = slice(7, 9)
        limits = model.jnt_range[:7]
        self.joint_limits = JointLimits(limits[:, 0] + 0.02, limits[:, 1] - 0.02, JOINT_SPEED)
        self._geom_owner = contacts.geom_owners(model, ROBOT_BODIES)
        self._group_robot_geoms()
        self._mass = np.zeros((model.nv, model.nv))
        self._jacobian = np.zeros((6, model.nv))
        self._joint_command = np.zeros(7)
        self.obstacles: tuple[str, ...] = ()

    def _group_robot_geoms(self) -> None:
        """Sort the robot's geoms into its looks (182,000 faces) and their low-poly stand-ins, the collision shapes."""
        model = self.model
        for geom in np.flatnonzero(self._geom_owner == contacts.ROBOT):
            if model.geom_group[geom] == scene_mjcf.VISIBLE_GROUP:
                model.geom_group[geom] = scene_mjcf.ROBOT_GROUP
            else:
                model.geom_group[geom] = scene_mjcf.STAND_IN_GROUP
                model.geom_rgba[geom] = (0.85, 0.86, 0.88, 1.0)

    # -- reset and step ------------------------------------------------------------------------------------------

    def reset(self, scene: SceneSpec) -> None:
        """Place the scene and the arm; nothing of the previous episode remains.

        Raises:
            RuntimeError: if the arm cannot bring its camera to the scene's start pose.
        """
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        placed = self._loader.load(scene)
        mujoco.mj_setConst(model, data)
        mujoco.mj_resetData(model, data)
        for body, (position, yaw) in placed.items():
            address = model.joint(f"{body}_joint").qposadr[0]
            data.qpos[address : address + 3] = self._base_position + position
            data.qpos[address + 3 : address + 7] = [np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)]
        self.obstacles = tuple(body for body in placed if body != "target")
        start = look_at(np.array(scene.camera_position), np.array(scene.gaze_point), np.array([0.0, 0.0, 1.0]))
        data.qpos[self._fingers] = data.ctrl[7:9] = [0.04, -0.04]
        data.qpos[self._arm] = self._joint_command = self._inverse_kinematics(start)
        mujoco.mj_forward(model, data)
        self._rest = {body: self.body_position(body) for body in placed}

    def _inverse_kinematics(self, T_base_cam: FloatArray) -> FloatArray:
        """Joint angles that bring the camera to a pose."""
        joints, error = self._posture.copy(), np.full(6, np.inf)
        for _ in range(100):
            self.data.qpos[self._arm] = joints
            mujoco.mj_kinematics(self.model, self.data)
            mujoco.mj_comPos(self.model, self.data)
            state = self.arm_state()
            offset = state.camera_pose[:3, :3].T @ (T_base_cam[:3, 3] - state.camera_pose[:3, 3])
            turn = Rotation.from_matrix(state.camera_pose[:3, :3].T @ T_base_cam[:3, :3]).as_rotvec()
            error = np.concatenate([offset, turn])
            if np.linalg.norm(error) < 1e-6:
                return joints
            step = joint_velocities(state.jacobian, error, joints, self._posture, self.joint_limits, posture_gain=0.1)
            joints = np.clip(joints + step, self.joint_limits.lower, self.joint_limits.upper)
        if np.linalg.norm(error) > 2e-3:
            raise RuntimeError(f"the arm cannot reach the camera pose at {np.round(T_base_cam[:3, 3], 3).tolist()}")
        return joints

    def step(self, camera_twist: FloatArray, gripper: float, exposure_substep: int) -> tuple[FloatArray, bool]:
        """Run one control period.

        Args:
            camera_twist: desired twist [v, w] in ``cam``, shape (6,), m/s and rad/s, held in ``cam`` for the period.
            gripper: -1 opens, +1 closes.
            exposure_substep: substep after which the image is taken.

        Returns:
            qpos at the exposure, and whether the robot hit an obstacle.
        """
        model, data = self.model, self.data
        finger_step = _GRIPPER_SPEED * model.opt.timestep * np.sign(gripper)
        collided = False
        exposed = data.qpos.copy()
        for substep in range(1, self.substeps + 1):
            mujoco.mj_step1(model, data)
            data.ctrl[self._arm] = self._torques(camera_twist)
            data.ctrl[7] = np.clip(data.ctrl[7] - finger_step, 0.0, 0.04)
            data.ctrl[8] = -data.ctrl[7]
            mujoco.mj_step2(model, data)
            collided = collided or contacts.robot_hits_obstacle(model, data, self._geom_owner)
            if substep == exposure_substep:
                exposed = data.qpos.copy()
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        return exposed, collided

    def _torques(self, camera_twist: FloatArray) -> FloatArray:
        """Computed-torque joint velocity control with an integrated position reference, N m."""
        model, data = self.model, self.data
        state = self.arm_state()
        velocity = joint_velocities(state.jacobian, camera_twist, state.joint_pos, self._posture, self.joint_limits)
        lead = self._joint_command + velocity * model.opt.timestep - state.joint_pos
        self._joint_command = state.joint_pos + np.clip(lead, -_MAX_WINDUP, _MAX_WINDUP)
        mujoco.mj_fullM(model, self._mass, data.qM)
        acceleration = _VELOCITY_GAIN * (velocity - state.joint_vel) + _POSITION_GAIN * (
            self._joint_command - state.joint_pos
        )
        torque = self._mass[:7, :7] @ acceleration + data.qfrc_bias[:7] - data.qfrc_passive[:7]
        return np.clip(torque, model.actuator_ctrlrange[:7, 0], model.actuator_ctrlrange[:7, 1])

    # -- truth ---------------------------------------------------------------------------------------------------

    def arm_state(self) -> ArmState:
        """State of the arm as the last kinematics computed it."""
        model, data = self.model, self.data
        jacobian = self._jacobian
        hand_rotation = data.xmat[self._hand].reshape(3, 3)
        rotation = hand_rotation @ HAND_EYE[:3, :3]
        position = data.xpos[self._hand] + hand_rotation @ HAND_EYE[:3, 3]
        mujoco.mj_jac(model, data, jacobian[:3], jacobian[3:], position, self._hand)
        pose = np.eye(4)
        pose[:3, :3] = rotation
        pose[:3, 3] = position - self._base_position
        in_camera = np.concatenate([rotation.T @ jacobian[:3, :7], rotation.T @ jacobian[3:, :7]])
        width = float(data.qpos[7] - data.qpos[8])
        return ArmState(data.qpos[:7].copy(), data.qvel[:7].copy(), pose, in_camera, width)

    def body_position(self, body: str) -> FloatArray:
        """Centre of a pool body in base, shape (3,), m."""
        return self.data.body(body).xpos - self._base_position

    def tool_position(self) -> FloatArray:
        """Point between the finger pads in base, shape (3,), m."""
        hand = self.data.xmat[self._hand].reshape(3, 3)
        return self.data.xpos[self._hand] + hand @ TOOL_IN_HAND - self._base_position

    def target_rise(self) -> float:
        """Height of the target above where it rested at reset, m."""
        return float(self.body_position("target")[2] - self._rest["target"][2])

    def obstacle_push(self) -> float:
        """Largest distance by which an obstacle has left its place, m."""
        moved = [np.linalg.norm(self.body_position(body) - self._rest[body]) for body in self.obstacles]
        return float(max(moved, default=0.0))

    def clearance(self) -> float:
        """Smallest distance between robot and obstacles, m, at most ``contacts.LARGEST_CLEARANCE``."""
        return contacts.clearance(self.model, self.data, self._geom_owner)
