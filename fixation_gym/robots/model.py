"""What a robot is made of: wrist camera, hand, arm and work space, as plain numbers and what follows from them.

Frames: ``base`` is the robot's base link, x forward, z up. ``hand`` is the flange's frame: z is the approach axis, and
the fingers open along y. ``cam`` is the optical frame of the wrist camera: z is the approach axis again, the fingers
open along x, and y, "down" in the image, leads from the camera to the fingers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fixation_gym.types import FloatArray, Vector

Range = tuple[float, float]
PartBox = tuple[Vector, Vector]
"""Lowest and highest corner of a box around a part of the hand: along the axes of ``cam``, from the tool's point, m."""


@dataclass(frozen=True)
class WristCamera:
    """The camera on the hand."""

    fovy: float
    """Vertical field of view, rad."""
    in_hand: Vector
    """Position of its optical centre in ``hand``, m."""
    housing: Vector
    """Half sizes of its housing along the axes of ``cam``, m."""
    housing_behind: float
    """Distance from the optical centre back to the middle of the housing, m."""
    mass: float
    """Of the camera, kg."""

    @cached_property
    def hand_eye(self) -> FloatArray:
        """T_hand_cam, shape (4, 4)."""
        x, y, z = self.in_hand
        return _fixed([[0.0, -1.0, 0.0, x], [1.0, 0.0, 0.0, y], [0.0, 0.0, 1.0, z], [0.0, 0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class Hand:
    """A hand with two fingers that close along x of ``cam``. The tool's point is the middle between their pads."""

    tool: Vector
    """The tool's point in ``hand``, m."""
    solid: tuple[PartBox, ...]
    """Boxes that the open hand and the camera fill. What sweeps a way is made of them and of the wrist."""
    wrist: PartBox
    """Box that holds the wrist in whatever way the arm turns it, so most of it is empty."""
    opening: float
    """Largest distance between the pads, m."""
    finger_speed: float
    """Of one finger when it closes, m/s."""
    finger_reach: Vector
    """How far the open fingers reach beyond the tool's point along x, y and z of ``cam``, m."""
    finger_span: Range
    """Widths of a thing that the open fingers get around for sure, and not at all, m."""
    grasp_widths: Range
    """Smallest and largest width of targets, m."""

    @cached_property
    def palm(self) -> float:
        """From the tool's point back to the palm between the fingers, m: the front of what is behind it on its axis."""
        behind = [high[2] for low, high in self.solid if max(low[:2]) < 0.0 < min(high[:2]) and high[2] < 0.0]
        return -max(behind)

    @cached_property
    def parts(self) -> FloatArray:
        """Boxes around all parts, the wrist last: (low, high), shape (n, 2, 3), m; frame as in ``PartBox``."""
        return _fixed([*self.solid, self.wrist])


@dataclass(frozen=True)
class Reach:
    """From where the arm brings its camera to a target on the table; azimuths count from the target's bearing."""

    rows_deg: tuple[Vector, ...]
    """Elevation above the table, in rising order, lowest and highest azimuth from which the hand gets to the target."""
    orbit_deg: Range
    """Lowest and highest elevation of the camera on its way around the target: a little beyond those of the rows, but
    short of the vertical, where up and down change places."""
    start_deg: Range
    """Azimuths at which the camera may start, at any height."""
    folded: float
    """A camera nearer than this to the base's vertical axis strains the folded arm, m."""

    @property
    def elevations_deg(self) -> Range:
        """Lowest and highest elevation from which the hand gets to the target, deg."""
        return self.rows_deg[0][0], self.rows_deg[-1][0]

    @property
    def lowest(self) -> float:
        """Lowest elevation from which the hand gets to the target, rad."""
        return math.radians(self.rows_deg[0][0])

    @property
    def highest(self) -> float:
        """Highest elevation from which it does, rad."""
        return math.radians(self.rows_deg[-1][0])

    @cached_property
    def orbit(self) -> Range:
        """``orbit_deg`` in rad."""
        return math.radians(self.orbit_deg[0]), math.radians(self.orbit_deg[1])

    def azimuths(self, elevation: float) -> Range:
        """Lowest and highest azimuth at an elevation; all in rad."""
        angle, (elevations, lowest, highest) = math.degrees(elevation), self._columns
        low, high = float(np.interp(angle, elevations, lowest)), float(np.interp(angle, elevations, highest))
        return math.radians(low), math.radians(high)

    @cached_property
    def _columns(self) -> FloatArray:
        return _fixed(list(zip(*self.rows_deg, strict=True)))


@dataclass(frozen=True)
class Arm:
    """The arm, and how fast it may move the camera."""

    posture: tuple[float, ...]
    """Joint angles from which a start pose is sought and towards which the redundancy drifts, rad."""
    posture_ahead: tuple[float, ...]
    """The same for a camera that looks straight ahead, far from joint limits and singular postures, rad."""
    camera_ahead: Vector
    """Where that camera is, in ``base``, m."""
    joint_speeds: tuple[float, ...]
    """Largest speeds of the joints, rad/s. Their limits and torques are those of the model or of the real arm."""
    linear_speed: float
    """Speed of the camera along one axis at action 1, m/s."""
    angular_speed: float
    """Its rotation rate about one axis at action 1, rad/s."""
    position_std: float
    """Noise of each camera pose that the kinematics give, per axis, m ..."""
    rotation_std: float
    """... and rad."""
    reach: Reach

    @property
    def joints(self) -> int:
        """How many there are."""
        return len(self.posture)

    @cached_property
    def twist_limits(self) -> FloatArray:
        """Camera twist [v, w] at action 1, shape (6,), m/s and rad/s."""
        return _fixed(np.repeat([self.linear_speed, self.angular_speed], 3))


@dataclass(frozen=True)
class WorkSpace:
    """Where things stand, in ``base``; ranges of x and y in m."""

    table_height: float
    """Height of the table top, m."""
    table: tuple[Range, Range]
    """Part of the table on which obstacles stand."""
    targets: tuple[Range, Range]
    """Where targets are placed."""
    pushed_targets: tuple[Range, Range]
    """Where a push may leave a target."""


@dataclass(frozen=True)
class Simulated:
    """What robosuite calls the robot's parts. Its gripper has one joint per finger, along which the finger slides."""

    robot: str
    gripper: str
    base: str
    """The link whose frame is ``base``."""
    first_link: str
    """The link after it."""


@dataclass(frozen=True)
class RobotModel:
    """One robot."""

    camera: WristCamera
    hand: Hand
    arm: Arm
    workspace: WorkSpace
    simulated: Simulated

    @cached_property
    def tool_in_camera(self) -> FloatArray:
        """The tool's point in ``cam``, shape (3,), m: below the image centre and ahead."""
        hand_eye = self.camera.hand_eye
        return _fixed(hand_eye[:3, :3].T @ (np.array(self.hand.tool) - hand_eye[:3, 3]))


def _fixed(values: FloatArray | list) -> FloatArray:
    """An array that nobody can change, since everybody shares it."""
    array = np.array(values)
    array.setflags(write=False)
    return array
