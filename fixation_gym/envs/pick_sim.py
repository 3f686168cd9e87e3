# pyright: reportAttributeAccessIssue=false
# (MuJoCo's functions have no type stubs.)
"""Simulation of the pick task: reset to a scene, step by a camera twist under torque control, read the truth.

MuJoCo's conventions (world frame, camera axes) stop here; what leaves this file is in the robot base frame and in the
optical camera frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from fixation_gym.control.computed_torque import ArmDynamics, ArmTask, arm_torques, camera_kinematics
from fixation_gym.control.resolved_rate import JointLimits, joint_velocities
from fixation_gym.envs import contacts
from fixation_gym.envs.motion import planned
from fixation_gym.envs.movers import Mover
from fixation_gym.envs.scene import SceneSpec
from fixation_gym.envs.scene_loader import SceneLoader
from fixation_gym.envs.task_mjcf import BASE_BODY, HAND_BODY, SceneExtension
from fixation_gym.envs.task_model import compile_model
from fixation_gym.geometry.rigid import look_at
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray

_JOINTS = ROBOT.arm.joints
_NUMBERS = ("time", "nbody_awake", "ntree_awake", "nv_awake", "nparent_awake")
_OPEN = 0.5 * ROBOT.hand.opening
"""Way of one finger, m."""
_START_TOLERANCE = 2e-3
"""Of the camera's pose at the start, m and rad."""
_LONGEST_STEPS = (math.inf, 0.1, 0.02)
"""Bounds on a step of the inverse kinematics, m and rad: whole steps are quick, but may end in a folded arm."""


@dataclass(frozen=True, eq=False)
class ArmState:
    """True state of the arm at one instant."""

    joint_pos: FloatArray
    joint_vel: FloatArray
    camera_pose: FloatArray
    """T_base_cam, shape (4, 4)."""
    jacobian: FloatArray
    """Camera twist expressed in ``cam`` per joint velocity, shape (6, n)."""
    gripper_width: float


@dataclass(frozen=True, eq=False)
class SimState:
    """What the simulation's future depends on."""

    scene: SceneSpec
    arrays: dict[str, FloatArray]
    """Of ``mjData``. Places and speeds would not do: bodies that sleep count, and how long others have rested."""
    numbers: dict[str, Any]
    """``_NUMBERS`` of it."""
    joint_command: FloatArray
    movers: tuple[tuple[bool, float], ...]


class PickSim:
    """MuJoCo simulation of the pick task: reset to a scene, step by a camera twist, read the truth."""

    def __init__(
        self,
        control_frequency: int,
        extend: SceneExtension | None = None,
        posture: tuple[float, ...] = ROBOT.arm.posture,
    ) -> None:
        """Build and compile the model once; ``reset`` reuses it.

        Args:
            control_frequency: calls of ``step`` per second.
            extend: adds an experiment's own things to the model.
            posture: joint angles from which start poses are sought and towards which the redundancy drifts, rad.
        """
        self._posture = np.array(posture)
        self._extend = extend
        self._compiled = compile_model(extend)
        self.model: Any = self._compiled.model
        self.data: Any = self._compiled.data
        model = self.model
        self.substeps = round(1.0 / (control_frequency * model.opt.timestep))
        self._hand = model.body(HAND_BODY).id
        base = model.body(BASE_BODY).id
        mujoco.mj_kinematics(model, self.data)
        self._base_position = self.data.xpos[base].copy()
        assert np.allclose(self.data.xmat[base].reshape(3, 3), np.eye(3)), "base frame is assumed parallel to the world"
        self._arm = slice(0, _JOINTS)
        self._fingers = slice(_JOINTS, _JOINTS + 2)
        self.data.qpos[self._arm], self.data.qpos[self._fingers] = posture, [_OPEN, -_OPEN]
        lower, upper = model.jnt_range[self._arm].T
        self._limits = JointLimits(lower + 0.02, upper - 0.02, np.array(ROBOT.arm.joint_speeds))
        joints = np.array([posture, *self._limits, *model.actuator_ctrlrange[self._arm].T])
        self._task = ArmTask(ROBOT.camera.hand_eye, joints, model.opt.timestep)
        self._arm_dynamics = self._view_arm()
        self._arrays = _arrays_of(mujoco.MjData(model))
        self._loader = SceneLoader(model)
        self._display: tuple[Any, SceneLoader] | None = None
        self._joint_command = np.zeros(_JOINTS)
        self.scene: SceneSpec | None = None
        self.obstacles: tuple[str, ...] = ()
        self._movers: tuple[Mover, ...] = ()

    def _view_arm(self) -> ArmDynamics:
        """Views into the simulator's arrays; the arm's joints are the first of the model and form one chain."""
        model, data, arm = self.model, self.data, self._arm
        parents = np.arange(-1, _JOINTS - 1)
        assert np.array_equal(model.dof_parentid[arm], parents), "mass matrix is read as that of a chain"
        return ArmDynamics(
            joint_pos=data.qpos[arm],
            joint_vel=data.qvel[arm],
            anchors=data.xanchor[arm],
            axes=data.xaxis[arm],
            hand_position=data.xpos[self._hand],
            hand_rotation=data.xmat[self._hand].reshape(3, 3),
            mass=data.M[: _JOINTS * (_JOINTS + 1) // 2],
            bias=data.qfrc_bias[arm],
            passive=data.qfrc_passive[arm],
        )

    # -- reset and step ------------------------------------------------------------------------------------------

    def reset(self, scene: SceneSpec) -> None:
        """Place the scene and the arm; nothing of the previous episode remains.

        Raises:
            RuntimeError: if the arm cannot bring its camera to the scene's start pose.
        """
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        self.scene = scene
        placed = self._loader.load(scene)
        if self._display is not None:
            self._display[1].load(scene)
        mujoco.mj_setConst(model, data)
        mujoco.mj_resetData(model, data)
        for body, (position, yaw, _) in placed.items():
            address = model.joint(f"{body}_joint").qposadr[0]
            data.qpos[address : address + 3] = self._base_position + position
            data.qpos[address + 3 : address + 7] = [np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)]
        self.obstacles = tuple(body for body in placed if body.startswith("obstacle"))
        self._colliding = contacts.colliding_geoms(model, self._compiled.owners)
        start = look_at(np.array(scene.camera_position), np.array(scene.gaze_point), np.array([0.0, 0.0, 1.0]))
        data.qpos[self._fingers] = data.ctrl[self._fingers] = [_OPEN, -_OPEN]
        data.qpos[self._arm] = self._joint_command[:] = self._inverse_kinematics(start)
        mujoco.mj_forward(model, data)
        self._rest = {body: self.body_position(body) for body in placed}
        moved = {body: motion for body, (_, _, motion) in placed.items() if motion is not None}
        self._movers = tuple(
            Mover(model, data, body, motion, spares_taken=body == "target") for body, motion in moved.items()
        )
        self._motions = moved

    def _inverse_kinematics(self, T_base_cam: FloatArray) -> FloatArray:
        """Joint angles that bring the camera to a pose."""
        for longest in _LONGEST_STEPS:
            joints, error = self._approached(T_base_cam, longest)
            if error < _START_TOLERANCE:
                return joints
        raise RuntimeError(f"the arm cannot reach the camera pose at {np.round(T_base_cam[:3, 3], 3).tolist()}")

    def _approached(self, T_base_cam: FloatArray, longest: float) -> tuple[FloatArray, float]:
        """Joint angles for a pose after some iterations, and what is left of the error, in m and rad together."""
        limits = self._limits
        joints, left = self._posture.copy(), math.inf
        for iteration in range(100):
            self.data.qpos[self._arm] = joints
            mujoco.mj_kinematics(self.model, self.data)
            state = self.arm_state()
            offset = state.camera_pose[:3, :3].T @ (T_base_cam[:3, 3] - state.camera_pose[:3, 3])
            turn = state.camera_pose[:3, :3].T @ T_base_cam[:3, :3]
            # Axis times the sine of the angle: right to first order, which is what the iteration needs.
            sine = 0.5 * (turn - turn.T)
            error = np.array([*offset, sine[2, 1], sine[0, 2], sine[1, 0]])
            left = float(np.linalg.norm(error))
            if left < 1e-6:
                break
            posture_gain = 0.5 if iteration < 6 else 0.0  # the drift slows the convergence that then follows
            towards = error * min(1.0, longest / left)
            step = joint_velocities(state.jacobian, towards, joints, self._posture, limits, 1e-3, posture_gain, 1.0)
            joints = np.clip(joints + step, limits.lower, limits.upper)
        return joints, left

    def step(self, camera_twist: FloatArray, gripper: float) -> tuple[FloatArray, bool]:
        """Run one control period.

        Args:
            camera_twist: desired twist [v, w] in ``cam``, shape (6,), m/s and rad/s, held in ``cam`` for the period.
            gripper: -1 opens, +1 closes.

        Returns:
            qpos after every physics step, for images taken meanwhile, shape (substeps, nq), and whether the robot hit
            an obstacle or the table.
        """
        model, data = self.model, self.data
        finger_step = ROBOT.hand.finger_speed * model.opt.timestep * float(np.sign(gripper))
        arm, torques, fingers = self._arm_dynamics, data.ctrl[self._arm], data.ctrl[self._fingers]
        finger, movers = float(fingers[0]), self._movers
        collided = False
        path = np.empty((self.substeps, model.nq))
        for substep in range(self.substeps):
            for mover in movers:
                mover.apply()
            mujoco.mj_step1(model, data)
            arm_torques(arm, self._task, camera_twist, self._joint_command, torques)
            if finger_step:
                finger = min(max(finger - finger_step, 0.0), _OPEN)
                fingers[:] = finger, -finger
            mujoco.mj_step2(model, data)
            if not collided:
                collided = contacts.robot_hits(model, data, self._compiled.owners)
            path[substep] = data.qpos
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        return path, collided

    def get_state(self) -> SimState:
        """What its future depends on; call it after a reset."""
        assert self.scene is not None, "there was a reset"
        arrays = {name: getattr(self.data, name).copy() for name in self._arrays}
        numbers = {name: getattr(self.data, name) for name in _NUMBERS}
        movers = tuple(mover.state for mover in self._movers)
        return SimState(self.scene, arrays, numbers, self._joint_command.copy(), movers)

    def set_state(self, state: SimState) -> None:
        """Go on from there, bit by bit as the simulation that it was taken from."""
        self.reset(state.scene)
        for name, number in state.numbers.items():
            setattr(self.data, name, number)
        for name, array in state.arrays.items():
            getattr(self.data, name)[...] = array
        self._joint_command[:] = state.joint_command
        for mover, value in zip(self._movers, state.movers, strict=True):
            mover.state = value

    @property
    def display_model(self) -> Any:
        """The model with the robot's looks, for pictures for people, with the same scene; compiled at first use."""
        if self._display is None:
            model = compile_model(self._extend, looks=True).model
            self._display = model, SceneLoader(model)
            if self.scene is not None:
                self._display[1].load(self.scene)
        return self._display[0]

    @property
    def has_mirror(self) -> bool:
        """Whether pictures show reflections."""
        return self.scene is not None and any(obstacle.kind == "mirror" for obstacle in self.scene.obstacles)

    # -- truth ---------------------------------------------------------------------------------------------------

    def arm_state(self) -> ArmState:
        """State of the arm as the last kinematics computed it."""
        arm = self._arm_dynamics
        pose, jacobian = camera_kinematics(arm, ROBOT.camera.hand_eye)
        pose[:3, 3] -= self._base_position
        left, right = self.data.qpos[self._fingers]
        return ArmState(arm.joint_pos.copy(), arm.joint_vel.copy(), pose, jacobian, float(left - right))

    def body_position(self, body: str) -> FloatArray:
        """Centre of a pool body in base, shape (3,), m."""
        return self.data.body(body).xpos - self._base_position

    def tool_position(self) -> FloatArray:
        """Point between the finger pads in base, shape (3,), m."""
        hand = self.data.xmat[self._hand].reshape(3, 3)
        return self.data.xpos[self._hand] + hand @ ROBOT.hand.tool - self._base_position

    def target_rise(self) -> float:
        """Height of the target above where it rested at reset, m."""
        return float(self.body_position("target")[2] - self._rest["target"][2])

    def obstacle_push(self) -> float:
        """Largest distance of an obstacle or the distractor from where it would be without the robot, m."""
        return max((self._deviation(body) for body in self._rest if body != "target"), default=0.0)

    def _deviation(self, body: str) -> float:
        """Distance of a pool body from its place at reset or, if the scene moves it, from its planned one, m."""
        deviation = self.body_position(body) - self._rest[body]
        if body in self._motions:
            deviation[:2] -= planned(self._motions[body], self.data.time)[0]
        return float(np.linalg.norm(deviation))

    def clearance(self) -> float:
        """Smallest distance between robot and obstacles, m, at most ``contacts.LARGEST_CLEARANCE``."""
        return contacts.clearance(self.model, self.data, *self._colliding)


def _arrays_of(fresh: Any) -> tuple[str, ...]:
    """Names of the arrays of an ``mjData`` whose size the model gives. A fresh one has none of the others: contacts."""
    names = (name for name in dir(fresh) if not name.startswith("_"))
    arrays = {name: value for name in names if isinstance(value := getattr(fresh, name), np.ndarray)}
    return tuple(name for name, value in arrays.items() if value.size and value.dtype.kind in "fiub")
