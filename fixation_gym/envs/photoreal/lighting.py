"""The light of the scenes: a bright panel above the table, like a lamp with a large screen, and a dim sky.

A depth camera brings light of its own: dots that give texture to what is plain.
"""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np

from fixation_gym.types import FloatArray

_SKY, _SKY_WEIGHT = 0.4, 0.1
"""Radiance of the sky, in units in which a white sheet that gets pi shows as white, and how often light is looked for
there: nearly all comes from the panel."""
_PANEL = 2.6
"""Radiance of the panel in these units."""
_HALF_SIZE, _DISTANCE = 1.2, 1.7
"""Half of a side of the panel and its distance from the middle of the table, m. It is large, because light that has
passed through glass is found by chance only: a small one would leave bright specks."""
DOT_IRRADIANCE = 1.0
"""Irradiance of a dot at 1 m in units in which that of a white sheet under panel and sky is about pi."""
_PITCH_PX, _DOT_PX, _FINE = 6.4, 0.8, 4
"""Mean distance and radius of dots, px of the imagers (a D435 projects about 5000), and texels per pixel."""


def lights(direction: FloatArray, middle: FloatArray) -> dict[str, Any]:
    """Descriptions of the lights for ``mitsuba.load_dict``.

    Args:
        direction: in which the simulator's light shines, shape (3,), in world.
        middle: of the table top, shape (3,), in world, m.
    """
    shining = np.asarray(direction, float) / np.linalg.norm(direction)
    return {
        "sky": {"type": "constant", "radiance": _grey(_SKY), "sampling_weight": _SKY_WEIGHT},
        "panel": {
            "type": "rectangle",
            "to_world": panel_frame(shining, middle - _DISTANCE * shining),
            "emitter": {"type": "area", "radiance": _grey(_PANEL)},
        },
    }


def _grey(radiance: float) -> dict[str, Any]:
    return {"type": "rgb", "value": [radiance] * 3}


def panel_frame(shining: FloatArray, place: FloatArray) -> FloatArray:
    """Matrix (4, 4) that takes the square -1..1 in x and y, which looks along +z, to the panel.

    Args:
        shining: unit vector in which the panel looks, shape (3,), in world; not along y.
        place: of its middle, shape (3,), in world, m.
    """
    x = np.cross([0.0, 1.0, 0.0], shining)
    x /= np.linalg.norm(x)
    frame = np.eye(4)
    frame[:3, :3] = _HALF_SIZE * np.stack([x, np.cross(shining, x), shining], axis=1)
    frame[:3, 3] = place
    return frame


def dot_pattern(height: int, width: int) -> FloatArray:
    """What the projector lets through, 0 or 1, float32: one dot at random in every square of a grid, always the same.

    Args:
        height: of the imagers' pictures, px.
        width: of the same.

    Returns:
        Shape (4 * height, 4 * width, 1).
    """
    rng = np.random.default_rng(435)
    rows, columns = (math.ceil(length / _PITCH_PX) for length in (height, width))
    corners = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2)
    centres = np.rint((corners + rng.uniform(0.0, 1.0, corners.shape)) * _PITCH_PX * _FINE).astype(int)
    pattern = np.zeros((_FINE * height, _FINE * width), np.uint8)
    for centre in centres.tolist():
        cv2.circle(pattern, centre, round(_DOT_PX * _FINE), 1, cv2.FILLED)
    return pattern[..., None].astype(np.float32)
