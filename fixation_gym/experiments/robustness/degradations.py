"""The rows of the table: each one thing that is wrong, on top of the nominal noise."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from fixation_gym.envs.sensor_noise import SENSOR_NOISE, SensorNoise

CLEAN = "nominal"
"""The row that the others are compared with."""
_NOMINAL = SENSOR_NOISE[CLEAN]
DEGRADATIONS: Mapping[str, SensorNoise] = {
    CLEAN: _NOMINAL,
    "jpeg": replace(_NOMINAL, jpeg_quality=30),
    "rolling_shutter": replace(_NOMINAL, readout_s=0.03, delay_s=0.015),
    "flicker": replace(_NOMINAL, flicker=0.3),
    "latency": replace(_NOMINAL, delay_s=0.04),
    "wrong_stamp": replace(_NOMINAL, image_latency_s=0.04),
    "blur": replace(_NOMINAL, exposure_s=0.02, delay_s=0.01),
    "hue": replace(_NOMINAL, hue_shift_deg=20.0),
    "dark": replace(_NOMINAL, light=0.25),
    "lens": replace(_NOMINAL, lens=(-0.3, 0.1, 0.0, 0.0)),
    "hand_eye": replace(_NOMINAL, hand_eye_m=5e-3, hand_eye_rad=math.radians(1.0)),
    "realistic": SENSOR_NOISE["realistic"],
}
"""Noise by the name of the row."""
MEANINGS: Mapping[str, str] = {
    CLEAN: "nominal noise",
    "jpeg": "JPEG 30",
    "rolling_shutter": "rolling shutter 30 ms",
    "flicker": "flicker 30 % at 120 Hz",
    "latency": "40 ms late, stamped",
    "wrong_stamp": "stamps 40 ms wrong",
    "blur": "exposure 20 ms",
    "hue": "hues 20 deg off",
    "dark": "a quarter of the light",
    "lens": "k1 -0.3, known",
    "hand_eye": "hand-eye 5 mm, 1 deg",
    "realistic": '"realistic"',
}
"""In words."""
