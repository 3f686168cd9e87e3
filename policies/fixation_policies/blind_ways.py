"""Fixed ways to the target that know where it is and look at nothing else: what can be had without seeing obstacles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray
from fixation_policies.base import SimulatedWorld
from fixation_policies.grips import grips_of, rolls
from fixation_policies.privileged import GRASP_DISTANCE, PrivilegedPolicy

Origin = Literal["base", "view", "target"]
Style = Literal["straight", "curved", "stepped"]

_VIEW_DISTANCE = 0.45
"""Distance of the camera from the target on the way around it, m."""
_SINK = math.radians(20.0)
"""A curved way begins higher by this, rad, ..."""
_SUNK_AT = GRASP_DISTANCE + 0.06
"""... and has sunk to its direction at this distance, m: before the fingers are beside the target."""
_STOPS = ((0.8, 1.6), (2.4, 3.2))
"""When a stepped way stops, s after the approach began; it also rises, and sinks again as it goes on."""
_RISE = math.radians(8.0)
_TURN_STEP = math.radians(5.0)
"""Between azimuths that are compared for how far the hand would turn, rad."""
_DETOUR_COST = 0.2
"""How much an angle of the azimuth counts against the same turn of the hand."""


@dataclass(frozen=True)
class BlindWay:
    """Around the target to a direction, straight in, grasp, lift."""

    elevation_deg: int
    """Of the direction above the table, deg."""
    azimuth_deg: int
    """Of the direction, deg."""
    origin: Origin = "base"
    """What the azimuth counts from. "base": the target's bearing from the base. "view": the azimuth from which the
    camera first looks; it then ends where the arm's reach does. "target": as "base", but the way may come from
    elsewhere in reach if the hand then turns less to grasp a target with sides."""
    speed: float = 0.10
    """Of the approach, m/s."""
    style: Style = "straight"
    """"curved": begins 20 degrees higher and sinks during the approach; "stepped": stops and rises by 8 degrees for
    0.8 s, twice."""

    @property
    def name(self) -> str:
        """Tells ways apart."""
        angles = f"el{self.elevation_deg} {self.origin}{self.azimuth_deg:+d}"
        return f"{self.style} {angles} {self.speed:.2f}m/s"

    def azimuths(self, bearing: float, first_view: float) -> FloatArray:
        """Azimuths from which the way may come, in base, shape (n,), rad; the first is the wanted one.

        Args:
            bearing: of the target from the base, rad.
            first_view: azimuth from which the camera first looked, in base, rad.
        """
        angle = math.radians(self.azimuth_deg)
        low, high = ROBOT.arm.reach.azimuths(math.radians(self.elevation_deg))
        if self.origin == "view":
            return bearing + np.array([min(max(_wrapped(first_view + angle - bearing), low), high)])
        around = np.arange(low, high, _TURN_STEP) if self.origin == "target" else np.zeros(0)
        return bearing + np.array([angle, *around])

    def elevation(self, depth: float, seconds: float) -> float:
        """Elevation from which to look, rad, at a distance from the target in m and ``seconds`` into the approach."""
        rise = 0.0
        if self.style == "curved":
            rise = _SINK * min(max((depth - _SUNK_AT) / (_VIEW_DISTANCE - _SUNK_AT), 0.0), 1.0)
        elif self.style == "stepped" and _stops(seconds):
            rise = _RISE
        lowest = math.radians(self.elevation_deg)
        return max(lowest, min(lowest + rise, ROBOT.arm.reach.highest))

    def speed_at(self, seconds: float) -> float:
        """Speed of the approach, m/s, ``seconds`` into it."""
        return 0.0 if self.style == "stepped" and _stops(seconds) else self.speed


class BlindWayPolicy(PrivilegedPolicy):
    """Goes a blind way with the oracle's motions, also its second tries; no obstacle changes what it does.

    It knows the target's true pose at every time, which is more than any blind policy can know: its success is an upper
    bound of what that way can give.
    """

    view_distance = _VIEW_DISTANCE

    def __init__(self, world: SimulatedWorld, way: BlindWay) -> None:
        """Go ``way`` in ``world``."""
        self._way = way
        super().__init__(world)

    def reset(self, seed: int | None = None) -> None:
        """Forget the last episode."""
        super().reset(seed)
        self._first_view: float | None = None
        self._azimuth = 0.0

    def choose(self, pose: FloatArray, target: FloatArray, time: float) -> tuple[FloatArray, int]:
        """The way's direction and the grip for which the hand turns least; see ``PrivilegedPolicy.choose``."""
        if self._first_view is None:
            self._first_view = math.atan2(target[1] - pose[1, 3], target[0] - pose[0, 3])
        azimuths = self._way.azimuths(math.atan2(target[1], target[0]), self._first_view)
        elevation = math.radians(self._way.elevation_deg)
        axes = grips_of(self._scene.target.shape)
        directions = np.repeat([_direction(azimuth, elevation) for azimuth in azimuths], len(axes), axis=0)
        grips = np.resize(axes, len(directions))
        detours = np.repeat(np.abs(azimuths - azimuths[0]), len(axes))
        best = int(np.argmin(np.abs(rolls(directions, grips, self._rotation)) + _DETOUR_COST * detours))
        self._azimuth = float(azimuths[best // len(axes)])
        return directions[best], int(grips[best])

    def come_in(self, depth: float, seconds: float) -> tuple[FloatArray, float]:
        """Direction from which to look, and speed; see ``PrivilegedPolicy.come_in``."""
        return _direction(self._azimuth, self._way.elevation(depth, seconds)), self._way.speed_at(seconds)


def _stops(seconds: float) -> bool:
    return any(begin <= seconds < end for begin, end in _STOPS)


def _direction(azimuth: float, elevation: float) -> FloatArray:
    """Unit vector from the target to the camera, shape (3,), in base; angles in rad."""
    flat = -math.cos(elevation)
    return np.array([flat * math.cos(azimuth), flat * math.sin(azimuth), math.sin(elevation)])


def _wrapped(angle: float) -> float:
    """Angle, rad, taken to [-pi, pi)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi
