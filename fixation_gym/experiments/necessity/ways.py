"""The family of blind ways: they cover the arm's reach, straight and fast; fewer are slow, curved or stepped."""

from __future__ import annotations

import math
from dataclasses import replace

from fixation_gym.robots import ROBOT
from fixation_policies.blind_ways import BlindWay

ELEVATIONS = (42, 48, 55, 62, 70, 80, 85)
"""Of the straight ways above the table, deg; the arm's reach ends at 85."""
VIEW_ELEVATIONS = (48, 62, 80)
VIEW_OFFSETS = (-50, -25, 0, 25, 50)
"""Of the azimuth against that of the first view, deg."""
SLOW = 0.04
"""Speed of the slow approach, m/s."""
_SPACING, _COARSE = 11.0, 22.0
"""Angle between ways of one elevation, deg, of the straight fast ways and of the others."""
_CURVED_ELEVATIONS = (42, 52, 62)
"""They begin 20 degrees higher."""


def azimuth_cells(elevation_deg: float, spacing_deg: float = _SPACING) -> list[tuple[float, float]]:
    """Even parts of the azimuths in reach at an elevation, (low, high), against the target's bearing, deg.

    A part is about ``spacing_deg`` wide as seen from the target.
    """
    low, high = (math.degrees(angle) for angle in ROBOT.arm.reach.azimuths(math.radians(elevation_deg)))
    count = max(2, round((high - low) * math.cos(math.radians(elevation_deg)) / spacing_deg))
    step = (high - low) / count
    return [(low + index * step, low + (index + 1) * step) for index in range(count)]


def _across(elevation: int, spacing: float) -> list[BlindWay]:
    """Ways in the middle of every cell of an elevation."""
    return [BlindWay(elevation, round(0.5 * (low + high))) for low, high in azimuth_cells(elevation, spacing)]


def _others(way: BlindWay, elevations: tuple[int, ...]) -> list[BlindWay]:
    """Ways like ``way`` in coarse steps over the reach, and from the first view's azimuth."""
    ways = []
    for elevation in elevations:
        ways += [
            replace(way, elevation_deg=elevation, azimuth_deg=cell.azimuth_deg) for cell in _across(elevation, _COARSE)
        ]
        ways.append(replace(way, elevation_deg=elevation, azimuth_deg=0, origin="view"))
    return ways


STRAIGHT = tuple(way for elevation in ELEVATIONS for way in _across(elevation, _SPACING))
"""Straight fast ways at fixed azimuths."""
FROM_VIEW = tuple(
    BlindWay(elevation, offset, origin="view") for elevation in VIEW_ELEVATIONS for offset in VIEW_OFFSETS
)
"""Straight fast ways at azimuths that count from the first view's."""
OTHERS = (
    *_others(BlindWay(0, 0, speed=SLOW), VIEW_ELEVATIONS),
    *_others(BlindWay(0, 0, style="curved"), _CURVED_ELEVATIONS),
    *_others(BlindWay(0, 0, style="stepped"), VIEW_ELEVATIONS),
)
TOWARDS_SIDES = tuple(
    BlindWay(elevation, azimuth, origin="target") for elevation, azimuth in ((48, 60), (62, 60), (75, 0), (75, 90))
)
"""Straight fast ways from where the fingers fit the target: its sides are set to be grasped from the free way."""
WAYS: dict[str, BlindWay] = {way.name: way for way in (*STRAIGHT, *FROM_VIEW, *TOWARDS_SIDES, *OTHERS)}
"""All of them by name."""
_QUICK = (*STRAIGHT[::4], FROM_VIEW[7], TOWARDS_SIDES[1], *OTHERS[4::9])
QUICK_WAYS: dict[str, BlindWay] = {way.name: way for way in _QUICK}
"""A few of them, to see that everything works."""
