"""``Fixator``: the one life cycle of perception, gaze and grasp. Who uses it chooses where to move and when to grasp.

Each control period: ``look`` at the observation, then ``steer``. Perception finds the target, its distance and what is
in front of it; the gaze stays on the target, however the camera is moved; a grasp is an open-loop manoeuvre that begins
when asked for, and takes over until it ends.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fixation_gym.control import gaze, open_loop
from fixation_gym.control.gaze import GazeGains
from fixation_gym.control.open_loop import Manoeuvre, OpenLoopGains, Stage, Target
from fixation_gym.geometry.rigid import pose_to_matrix
from fixation_gym.perception.body.grasp_axis import narrow_axis
from fixation_gym.perception.percept import Percept
from fixation_gym.perception.pipeline import Perception
from fixation_gym.robots import ROBOT
from fixation_gym.types import Command, FloatArray, Observation

_LEAST_ROLL = 1e-3
"""Range of the roll that is always left, rad."""
_FAR_OFF = 0.5
"""Offset from the image centre beyond which the direction to the target is all that counts, normalised coordinates."""


@dataclass(frozen=True)
class FixatorGains:
    """Numbers of gaze and grasp."""

    gaze: GazeGains = field(default_factory=GazeGains)
    """Of gaze, roll and reach."""
    open_loop: OpenLoopGains = field(default_factory=OpenLoopGains)
    """Of grasp, lift and recovery."""
    limit_reach: bool = True
    """Whether lateral motion that leads out of the arm's reach is dropped."""


class Fixator:
    """Perceives, holds the gaze and grasps. State: perception, the last percept and pose, and the manoeuvre if any."""

    def __init__(self, perception: Perception, gains: FixatorGains | None = None) -> None:
        """Prepare for a robot.

        Args:
            perception: made for its wrist camera; it is reset and updated here.
            gains: of gaze and grasp; None for the defaults.
        """
        self.perception, self.gains = perception, gains or FixatorGains()
        self.reset()

    def reset(self) -> None:
        """Forget the last episode."""
        self.perception.reset()
        self._percept: Percept | None = None
        self._manoeuvre: Manoeuvre | None = None

    @property
    def percept(self) -> Percept:
        """What was last perceived.

        Raises:
            RuntimeError: before the first ``look``.
        """
        if self._percept is None:
            raise RuntimeError("nothing was perceived yet; call look() first")
        return self._percept

    @property
    def stage(self) -> Stage | None:
        """Stage of the open-loop manoeuvre; None while it looks."""
        return None if self._manoeuvre is None else self._manoeuvre.stage

    @property
    def target(self) -> Target:
        """What a grasp would go for, seen from here."""
        percept = self.percept
        reach = percept.reach_towards(self.T_base_cam)
        return Target(percept.centre_base, reach, self.perception.support_height_m)

    def look(self, observation: Observation, fresh: bool = True) -> Percept:
        """Take in an observation, and let the manoeuvre go on.

        Args:
            observation: of the robot, now.
            fresh: whether its image is new; if not, what was last perceived stands.

        Raises:
            ValueError: for an observation or mask that perception cannot take.
        """
        if fresh or self._percept is None:
            self._percept = self.perception.update(observation)
        self.T_base_cam, self.time = pose_to_matrix(observation.camera_pose), observation.time
        if self._manoeuvre is not None:
            self._go_on(self._manoeuvre, observation.gripper_width)
        return self._percept

    def _go_on(self, manoeuvre: Manoeuvre, gripper_width: float) -> None:
        gains = self.gains.open_loop
        if self.percept.body is not None:
            manoeuvre = open_loop.reaimed(manoeuvre, self.T_base_cam, self.target, gains)
        self._manoeuvre = open_loop.advance(manoeuvre, self.T_base_cam, gripper_width, self.time, gains)
        if self._manoeuvre is None:
            self.perception.forget_place()  # the target was pushed or dropped

    def grasp(self) -> None:
        """Begin the open-loop grasp, unless a manoeuvre is under way or the target was never seen."""
        if self._manoeuvre is None and self.percept.fixation.initialised:
            self._manoeuvre = open_loop.begin_grasp(self.T_base_cam, self.target, self.time, self.gains.open_loop)

    def steer(self, v: FloatArray, grasp: bool = False, roll_error: float | None = None) -> Command:
        """Command that moves the camera as asked, with the gaze on the target, or that goes on with the manoeuvre.

        Before the target was first seen the camera searches for it. All is slowed down to what the camera may do.

        Args:
            v: wanted camera velocity in ``cam``, shape (3,), m/s; lateral parts that lead out of reach are dropped.
            grasp: begins the manoeuvre; while it lasts nothing else counts.
            roll_error: angle to turn about the optical axis, rad; None: level, and near by across the narrow axis.
        """
        if grasp:
            self.grasp()
        if self._manoeuvre is not None:
            twist = open_loop.manoeuvre_twist(self._manoeuvre, self.T_base_cam, self.gains.open_loop)
        else:
            twist = self._gazing_twist(self.within_reach(v), roll_error)
        return Command(gaze.within_speed(twist), open_loop.gripper_command(self._manoeuvre))

    def within_reach(self, v: FloatArray) -> FloatArray:
        """Velocity, shape (3,), without the lateral part that would lead out of the arm's reach."""
        fixation, limits = self.percept.fixation, self.gains.gaze
        if not self.gains.limit_reach:
            return v
        return np.array([*gaze.within_reach(v[:2], self.T_base_cam, fixation.point_base, limits), v[2]])

    def search(self, seconds: float) -> Command:
        """Command that turns the camera on a widening spiral; ``seconds`` since that began."""
        return Command(gaze.within_speed(gaze.searching_twist(seconds, self.gains.gaze)), open_loop.OPEN)

    def levelling(self) -> float:
        """Angle about the optical axis that levels the camera, rad."""
        return gaze.levelling(self.T_base_cam, self.gains.gaze)

    def across(self) -> float | None:
        """Angle that turns the gripper across the target's narrow axis, rad; None from afar or if it is not whole."""
        percept, gains = self.percept, self.gains.gaze
        if percept.fixation.distance_m >= gains.align_distance or not percept.segmentation.whole:
            return None
        largest = min(gains.max_roll, self._largest_roll())
        return narrow_axis(percept.segmentation.mask, gaze.roll(self.T_base_cam), max(largest, _LEAST_ROLL))

    def excess_roll(self) -> float:
        """By how much the hand is turned farther than the open fingers allow at the grasp, rad."""
        return max(0.0, abs(gaze.roll(self.T_base_cam)) - self._largest_roll())

    def _largest_roll(self) -> float:
        return open_loop.largest_roll(self.T_base_cam, self.target, self.gains.open_loop)

    def _gazing_twist(self, v: FloatArray, roll_error: float | None) -> FloatArray:
        fixation, gains = self.percept.fixation, self.gains.gaze
        if not fixation.initialised and roll_error is None:
            return np.array([*v, *gaze.searching_twist(self.time, gains)[3:]])
        if roll_error is None:
            across = self.across()
            roll_error = self.levelling() if across is None else across
        centroid = fixation.centroid if fixation.visible else np.clip(fixation.centroid, -_FAR_OFF, _FAR_OFF)
        return gaze.fixating_twist(v, centroid, fixation.distance_m, roll_error, gains)


def action_of(command: Command) -> np.ndarray:
    """Action of ``FixationPick-v0``, shape (7,), float32, for a command."""
    return np.array([*command.camera_twist / ROBOT.arm.twist_limits, command.gripper], np.float32)
