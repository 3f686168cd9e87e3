"""How far camera and arm are from perfect: presets by name, and each degradation as a number of its own."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from fixation_gym.envs.field_checks import with_fields
from fixation_gym.geometry.camera import Lens

_RIG_FIELDS = 8
"""Number of the first fields of ``SensorNoise`` that rigs of experiments have, too."""


_LONGEST_DELAY_S, _FRAME_RATES_HZ = 0.25, (5.0, 500.0)
"""Bounds of the camera's delay and of its own rate: perception keeps poses for half a second."""


@dataclass(frozen=True)
class SensorNoise:
    """Errors of joint encoders, camera and hand-eye calibration; standard deviations unless said otherwise.

    Every number is 0, or what changes nothing, by default, so that ``SensorNoise(jpeg_quality=30)`` is that alone.
    """

    joint_pos_rad: float = 0.0
    """White noise of each joint angle, rad. On the Panda, 1e-5 rad moves the camera by about 0.01 mm."""
    joint_vel_rad_s: float = 0.0
    """White noise of each joint velocity, rad/s."""
    hand_eye_m: float = 0.0
    """Error of the hand-eye position per axis, constant in an episode, m."""
    hand_eye_rad: float = 0.0
    """Error of the hand-eye rotation per axis, constant in an episode, rad."""
    read_noise: float = 0.0
    """Signal-independent image noise, grey levels."""
    shot_noise: float = 0.0
    """Variance of the image noise per grey level of signal, grey levels."""
    exposure_gain: float = 0.0
    """Relative error of the exposure, constant in an episode."""
    image_latency_s: float = 0.0
    """Age of the image beyond what its stamp says, constant and unknown to the observer, s."""
    joint_bias_rad: float = 0.0
    """Error of each joint angle that is constant in an episode: what kinematic calibration leaves, rad."""
    delay_s: float = 0.0
    """Time from the middle of the exposure until the image is there; its stamp tells, s."""
    frame_rate_hz: float = 0.0
    """Images per second of a camera with a clock of its own; 0: one at every control step."""
    frame_jitter_s: float = 0.0
    """Of the time of each image against that clock, s; the stamp tells."""
    frame_drops: float = 0.0
    """Probability that an image of that clock never arrives."""
    exposure_s: float = 0.0
    """Time for which each row is exposed: motion blur, s."""
    readout_s: float = 0.0
    """Time from the first row to the last: rolling shutter, s."""
    lens: tuple[float, ...] = ()
    """Coefficients of the lens, which the observer knows, as in ``geometry.camera.Lens``; none: a pinhole."""
    jpeg_quality: int = 0
    """Quality of JPEG compression, 1 to 100; 0: none."""
    light: float = 1.0
    """Factor on every grey level before image noise: how much of the usual light there is."""
    light_red: float = 1.0
    """Factor on red before image noise: light of another colour that the white balance does not follow."""
    light_blue: float = 1.0
    """The same on blue."""
    gain_drift: float = 0.0
    """Relative slow change of the gain of all channels."""
    white_balance_drift: float = 0.0
    """Relative slow change of the gains of red and blue, each for itself."""
    drift_time_s: float = 2.0
    """Time in which those changes are forgotten, s."""
    flicker: float = 0.0
    """Amplitude of the light's flicker, as a share of it."""
    flicker_hz: float = 120.0
    """Its frequency: twice that of the mains, Hz."""
    hue_shift_deg: float = 0.0
    """Turn of every hue: a wrong white balance, deg."""

    def __post_init__(self) -> None:
        """Check what would make no camera."""
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name == "lens":
                continue
            number = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
            if not number or (value < 0 and field.name != "hue_shift_deg"):
                raise ValueError(f"{field.name} must be a number of 0 or more, got {value!r}")
        if not (isinstance(self.jpeg_quality, int) and self.jpeg_quality <= 100):
            raise ValueError(f"jpeg_quality must be a whole number within 0..100, got {self.jpeg_quality!r}")
        for name in ("frame_drops", "flicker"):
            if getattr(self, name) > 0.9:
                raise ValueError(f"{name} must be within 0..0.9, got {getattr(self, name)!r}")
        self._check_camera()
        if self.delay_s < self.least_delay_s:
            raise ValueError(
                f"delay_s must be {self.least_delay_s} s or more, for an image is there when its last row is; "
                f"got {self.delay_s}"
            )
        if not self.drift_time_s > 0:
            raise ValueError(f"drift_time_s must be above 0, got {self.drift_time_s}")
        if self.lens:
            Lens(self.lens)

    def _check_camera(self) -> None:
        """Check what would make a camera that perception cannot follow, or none."""
        if self.delay_s > _LONGEST_DELAY_S:
            raise ValueError(f"delay_s must be {_LONGEST_DELAY_S} s or less, got {self.delay_s}")
        lowest, highest = _FRAME_RATES_HZ
        if self.frame_rate_hz and not lowest <= self.frame_rate_hz <= highest:
            raise ValueError(f"frame_rate_hz must be 0 or within {lowest}..{highest}, got {self.frame_rate_hz}")
        if not isinstance(self.lens, tuple):
            raise ValueError(f"lens must be the coefficients of a lens, or none, got {self.lens!r}")
        if self.flicker and not self.flicker_hz:
            raise ValueError("flicker_hz must be above 0 where there is flicker")

    @property
    def of_every_rig(self) -> bool:
        """Whether a rig that takes its pictures itself, one per step, has all of it."""
        plain = SensorNoise()
        return all(getattr(self, field.name) == getattr(plain, field.name) for field in fields(self)[_RIG_FIELDS:])

    @property
    def least_delay_s(self) -> float:
        """Time from the middle of the exposure to the end of the last row's, s."""
        return 0.5 * (self.exposure_s + self.readout_s)


_NOMINAL = SensorNoise(
    joint_pos_rad=1.5e-5,
    joint_vel_rad_s=5e-4,
    hand_eye_m=2e-4,
    hand_eye_rad=5e-4,
    read_noise=1.0,
    shot_noise=0.01,
    exposure_gain=0.05,
    image_latency_s=0.002,
)
SENSOR_NOISE: dict[str, SensorNoise] = {
    "ideal": SensorNoise(),
    "nominal": _NOMINAL,
    "conservative": SensorNoise(
        joint_pos_rad=1e-4,
        joint_vel_rad_s=3e-3,
        hand_eye_m=1e-3,
        hand_eye_rad=2e-3,
        read_noise=2.0,
        shot_noise=0.03,
        exposure_gain=0.15,
        image_latency_s=0.008,
    ),
    # docs/conventions.md says where each number is from.
    "realistic": SensorNoise(
        joint_pos_rad=1.5e-5,
        joint_vel_rad_s=5e-4,
        joint_bias_rad=1e-3,
        hand_eye_m=3e-3,
        hand_eye_rad=math.radians(0.5),
        read_noise=1.5,
        shot_noise=0.02,
        exposure_gain=0.15,
        image_latency_s=0.002,
        delay_s=0.03,
        frame_rate_hz=30.0,
        frame_jitter_s=1e-3,
        frame_drops=0.01,
        exposure_s=0.008,
        readout_s=0.024,
        lens=(-0.0306, 0.0352, -0.00014, -0.00015, -0.0120),
        jpeg_quality=80,
        gain_drift=0.05,
        white_balance_drift=0.03,
    ),
}


def resolve_sensor_noise(noise: str | Mapping[str, Any] | SensorNoise) -> SensorNoise:
    """Noise preset of that name, or one built from a mapping of ``SensorNoise`` fields.

    A mapping may hold ``base``, the name of the preset whose values it changes; without it, that is "ideal".

    Raises:
        ValueError: for an unknown name or field, or a value that is not allowed; the message lists the valid ones.
    """
    if isinstance(noise, SensorNoise):
        return noise
    if isinstance(noise, Mapping):
        values = dict(noise)
        base = resolve_sensor_noise(values.pop("base", "ideal"))
        return with_fields(base, values, "sensor_noise fields", "base")
    if not isinstance(noise, str) or noise not in SENSOR_NOISE:
        raise ValueError(f"unknown sensor_noise {noise!r}; choose one of {', '.join(SENSOR_NOISE)}")
    return SENSOR_NOISE[noise]
