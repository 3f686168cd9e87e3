"""The shifts: what is other in a test than it was in training, axis by axis, each in three severities. Frozen.

Axes have names of their own; ``dimension`` says to which of LIBERO-plus (Fei et al. 2025, "LIBERO-Plus: In-depth
Robustness Analysis of Vision-Language-Action Models") they belong. Severities are chosen by what a user may meet, not
by what a policy survives.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from fixation_gym.errors import check_names

SEVERITIES = ("mild", "middle", "strong")
NONE = "none"
"""Name of the axis and of the severity without a shift."""
Changes = Mapping[str, Any]

APPEARANCE = "appearance"
"""Name of the mean over the axes that change what things look like."""


@dataclass(frozen=True)
class Axis:
    """One thing that is other than in training."""

    meaning: str
    dimension: str
    """Of LIBERO-plus; "" if it has none like it."""
    scenario: tuple[Changes, ...] = ()
    """Fields of the scenario that change, by severity; none: none change."""
    noise: tuple[Changes, ...] = ()
    """Fields of ``SensorNoise`` that change on top of the nominal noise, by severity."""
    same_scenes: bool = True
    """Whether the same things stand in the same places as in the unshifted episode of the same seed."""
    appearance: bool = False
    """Whether it counts among the axes of ``APPEARANCE``: materials, textures and light."""


@dataclass(frozen=True)
class Shift:
    """A severity of an axis."""

    axis: str
    severity: str
    scenario: Changes = field(default_factory=dict)
    noise: Changes = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Axis and severity in one."""
        return f"{self.axis} {self.severity}"

    def arguments(self, scenario: str) -> dict[str, Any]:
        """Arguments of an environment for it, on the scenario of the training."""
        return {
            "scenario": {"base": scenario, **self.scenario} if self.scenario else scenario,
            "sensor_noise": {"base": "nominal", **self.noise} if self.noise else "nominal",
        }


def _materials(*levels: tuple[str, ...]) -> tuple[Changes, ...]:
    return tuple({"obstacle_materials": materials} for materials in levels)


_LIGHT, _TEXTURES, _SENSOR = "light conditions", "background textures", "sensor noise"
AXES: Mapping[str, Axis] = {
    "material_translucent": Axis(
        "obstacles of tinted glass with rims, opacity 0.7 to 0.9, 0.3 to 0.7, 0.15 to 0.3",
        "",
        tuple(
            {"obstacle_materials": ("translucent",), "alpha": alpha} for alpha in ((0.7, 0.9), (0.3, 0.7), (0.15, 0.3))
        ),
        same_scenes=False,
        appearance=True,
    ),
    "material_mirror": Axis(
        "framed mirrors: perhaps one, one for sure, nothing else",
        "",
        (
            *_materials(("opaque", "mirror"), ("mirror", "opaque")),
            {"obstacle_materials": ("mirror",), "several_mirrors": True},
        ),
        same_scenes=False,
        appearance=True,
    ),
    "material_wire": Axis(
        "obstacles of bars: some, at least one, all",
        "",
        _materials(("opaque", "wire"), ("wire", "opaque"), ("wire",)),
        same_scenes=False,
        appearance=True,
    ),
    "object_textures": Axis(
        "obstacles in pale colours, in strong ones with other textures, without texture",
        _TEXTURES,
        tuple({"obstacle_looks": looks} for looks in ("tinted", "coloured", "plain")),
        appearance=True,
    ),
    "background_textures": Axis(
        "table, sheets, boards, floor and walls in pale colours, in strong ones with other textures, without texture",
        _TEXTURES,
        tuple({"room_looks": looks} for looks in ("tinted", "coloured", "plain")),
        appearance=True,
    ),
    "light_direction": Axis(
        "light from the side: its slant times 2, 4, 8",
        _LIGHT,
        tuple({"light_slant": factor} for factor in (2.0, 4.0, 8.0)),
        appearance=True,
    ),
    "light_intensity": Axis(
        "a half, a quarter, an eighth of the light",
        _LIGHT,
        noise=tuple({"light": factor} for factor in (0.5, 0.25, 0.125)),
        appearance=True,
    ),
    "light_colour": Axis(
        "warmer light without another white balance: red times 1.15, 1.3, 1.5, blue times 0.8, 0.6, 0.4",
        _LIGHT,
        noise=tuple({"light_red": red, "light_blue": blue} for red, blue in ((1.15, 0.8), (1.3, 0.6), (1.5, 0.4))),
        appearance=True,
    ),
    "image_noise": Axis(
        "read noise of 3, 6, 12 grey levels, shot noise of 0.05, 0.2, 0.8",
        _SENSOR,
        noise=tuple({"read_noise": read, "shot_noise": shot} for read, shot in ((3.0, 0.05), (6.0, 0.2), (12.0, 0.8))),
    ),
    "motion_blur": Axis(
        "each row exposed for 10, 20, 40 ms",
        _SENSOR,
        noise=tuple({"exposure_s": time, "delay_s": 0.5 * time} for time in (0.01, 0.02, 0.04)),
    ),
    "exposure": Axis(
        "exposure off by 15, 30, 45 % (standard deviation)",
        _SENSOR,
        noise=tuple({"exposure_gain": share} for share in (0.15, 0.3, 0.45)),
    ),
    "latency": Axis(
        "images older than their stamps say by 10, 20, 40 ms",
        _SENSOR,
        noise=tuple({"image_latency_s": time} for time in (0.01, 0.02, 0.04)),
    ),
    "hand_eye": Axis(
        "camera not where the calibration says: 1 mm and 0.2 deg, 3 mm and 0.5 deg, 5 mm and 1 deg per axis",
        "camera viewpoints",
        noise=tuple(
            {"hand_eye_m": length, "hand_eye_rad": math.radians(angle)}
            for length, angle in ((1e-3, 0.2), (3e-3, 0.5), (5e-3, 1.0))
        ),
    ),
    "initial_view": Axis(
        "first view from 36 to 40, 33 to 36, 30 to 33 degrees above the table",
        "robot initial states",
        tuple({"view_elevation_deg": span} for span in ((36.0, 40.0), (33.0, 36.0), (30.0, 33.0))),
        same_scenes=False,
    ),
    "clutter": Axis(
        "at least 4, 5, 6 obstacles",
        "objects layout",
        tuple({"obstacle_count": count} for count in ((4, 7), (5, 9), (6, 9))),
        same_scenes=False,
    ),
    "target_colour": Axis(
        "target's hue turned by 30, 90, 180 degrees; the first box shows it",
        "",
        tuple({"target_hue_deg": angle} for angle in (30.0, 90.0, 180.0)),
    ),
}
"""Axes by name."""


def shift(axis: str, severity: str) -> Shift:
    """A shift by its names.

    Raises:
        UsageError: for an unknown axis or severity; the message lists the valid ones.
    """
    check_names([axis], AXES, "axis")
    check_names([severity], SEVERITIES, "severity")
    level, chosen = SEVERITIES.index(severity), AXES[axis]
    fields, noise = (changes[level] if changes else {} for changes in (chosen.scenario, chosen.noise))
    return Shift(axis, severity, fields, noise)


def table_hash() -> str:
    """SHA-256 of what every shift changes: results of another table do not compare."""
    table = {name: [axis.scenario, axis.noise] for name, axis in AXES.items()}
    return hashlib.sha256(json.dumps(table, sort_keys=True).encode()).hexdigest()
