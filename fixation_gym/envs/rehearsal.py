# pyright: reportAttributeAccessIssue=false
# (MuJoCo's functions have no type stubs.)
"""What a plan would touch, told by geometry: the arm follows it exactly, in a copy of a running simulation."""

from __future__ import annotations

import copy

import mujoco
import numpy as np

from fixation_gym.control.resolved_rate import joint_velocities
from fixation_gym.envs.motion import planned
from fixation_gym.envs.pick_sim import PickSim
from fixation_gym.types import FloatArray


class Rehearsal(PickSim):
    """A copy in which nothing has weight or force: joints do as they are told, obstacles keep to their planned ways.

    The target stays where it is, but a hand whose fingers close takes it along: there is no slip and no push. The
    original does not notice.
    """

    def __init__(self, sim: PickSim) -> None:
        """Begin as ``sim`` is now, after a reset."""
        self.__dict__.update(sim.__dict__)
        self.data = copy.copy(sim.data)
        self._arm_dynamics = self._view_arm()
        mujoco.mj_kinematics(self.model, self.data)

    def step(self, camera_twist: FloatArray, gripper: float) -> tuple[FloatArray, bool]:
        """Go on by one control period; arguments and results as in ``PickSim.step``, but nothing is ever hit."""
        data, period = self.data, self.substeps * self.model.opt.timestep
        state, tool = self.arm_state(), self.tool_position()
        velocity = joint_velocities(state.jacobian, camera_twist, state.joint_pos, self._posture, self._limits)
        data.qpos[self._arm] += period * velocity
        mujoco.mj_kinematics(self.model, data)
        data.time += period
        if gripper > 0.0:
            self._place_of("target")[:] += self.tool_position() - tool
        for body, motion in self._motions.items():
            if body != "target":
                self._place_of(body)[:] = self._base_position + self._rest[body]
                self._place_of(body)[:2] += planned(motion, data.time)[0]
        mujoco.mj_kinematics(self.model, data)
        return data.qpos[None].copy(), False

    def _place_of(self, body: str) -> FloatArray:
        """A view of the place of a body that nothing holds, shape (3,), in the world, m."""
        address = self.model.joint(f"{body}_joint").qposadr[0]
        return np.asarray(self.data.qpos[address : address + 3])
