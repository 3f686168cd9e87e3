"""What a sequence of the distance experiment is: camera, circle, print and timing. Knows no simulator."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import look_at
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray

Motion = Literal["fixation", "translation"]

IMAGE_SIZE = (480, 640)
"""Height and width of the wrist image, px."""
INTRINSICS = Intrinsics.from_fovy(*IMAGE_SIZE, ROBOT.camera.fovy)
_EYE = np.array(ROBOT.arm.camera_ahead)
HOME = look_at(_EYE, np.add(_EYE, (1.0, 0.0, 0.0)), np.array([0.0, 0.0, 1.0]))
"""T_base_home, shape (4, 4): the camera in the middle of its circle; the print faces it."""
HOME.setflags(write=False)
CENTROID_STD_PX = 0.02
"""Noise of the centroid of a rendered print, px (measured: 0.003 to 0.017, part of it lasting)."""
CYCLE_RATE = 1.0
"""Angular rate of the circle, rad/s."""
BURN_IN_S, MEASURE_S, AFTER_JUMP_S = 1.0, 9.0, 2.0
"""After the onset of motion nothing counts, then errors are measured, then the print jumps and is found again."""
JUMP_M = 0.05
_ONSET_S = 0.4
"""Time to get to full speed."""


@dataclass(frozen=True)
class Condition:
    """What a sequence shows."""

    distance_m: float
    """From the camera to the print, the same in both motions."""
    amplitude_m: float
    """Radius of the circle."""
    motion: Motion
    print_width_m: float
    """Width of the duck."""
    seed: int

    def print_position(self) -> FloatArray:
        """Where the print is, in base, shape (3,): on the home axis, at ``distance_m`` from the circling camera."""
        ahead = self.distance_m
        if self.motion == "fixation":
            ahead = math.sqrt(ahead**2 - self.amplitude_m**2)
        return HOME[:3, 3] + ahead * HOME[:3, 2]

    def jump(self, rng: np.random.Generator) -> FloatArray:
        """Displacement of the print, in base, shape (3,): up to 4 cm across the axis, the rest away."""
        across = min(0.04, 0.15 * self.distance_m)
        angle = rng.uniform(0.0, 2.0 * math.pi)
        local = np.array([across * math.cos(angle), across * math.sin(angle), math.sqrt(JUMP_M**2 - across**2)])
        return HOME[:3, :3] @ local


class Circle:
    """Where the camera should be, in base."""

    def __init__(self, condition: Condition, rng: np.random.Generator) -> None:
        """Draw phase and sense."""
        self._amplitude = condition.amplitude_m
        self._phase = rng.uniform(0.0, 2.0 * math.pi)
        self._rate = CYCLE_RATE * (1.0 if rng.random() < 0.5 else -1.0)

    def at(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Position, m, and velocity, m/s, each of shape (3,)."""
        ramp = min(time / _ONSET_S, 1.0)
        travelled = 0.5 * ramp * time if time < _ONSET_S else time - 0.5 * _ONSET_S
        angle = self._phase + self._rate * travelled
        out = self._amplitude * np.array([math.cos(angle), math.sin(angle), 0.0])
        along = self._amplitude * self._rate * ramp * np.array([-math.sin(angle), math.cos(angle), 0.0])
        return HOME[:3, 3] + HOME[:3, :3] @ out, HOME[:3, :3] @ along
