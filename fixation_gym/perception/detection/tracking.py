"""Which of several things of one colour is the target: the one where it was last seen, moved with the camera.

Colour alone would take the largest thing in every image. The camera's own motion is known, so the place at which
the target must be is, too, even while it is hidden; what the target can have moved by itself meanwhile bounds how far
off it is looked for. Value in, value out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fixation_gym.geometry.rigid import inverse, transform
from fixation_gym.perception.detection.segmentation import Segmentation
from fixation_gym.types import FloatArray


@dataclass(frozen=True, slots=True)
class TrackingSettings:
    """How far off the target may be from where it was last seen."""

    slack: float = 0.03
    """Offset that is always allowed, normalised coordinates."""
    size_share: float = 1.5
    """... and that grows with the target, in standard deviations of its pixels: covering a part of it shifts it."""
    speed: float = 0.15
    """Speed at which it may move while it is not seen, m/s."""
    largest_move_m: float = 0.08
    """How far it may have moved while it was not seen, m."""
    forget_s: float = 4.0
    """After this time without sight it may be anywhere, s."""


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Where the target was last seen."""

    point: FloatArray
    """On the ray to its centroid, at its estimated depth, in base, shape (3,), m."""
    size_m: float
    """Standard deviation of its pixels about the centroid, at that depth, m."""
    time: float
    """When, s."""


@dataclass(frozen=True, slots=True, eq=False)
class Expectation:
    """Where to look for the target in one image."""

    centroid: FloatArray
    """Normalised image coordinates, shape (2,)."""
    reach: float
    """Largest offset from there, normalised coordinates; inf: it may be anywhere."""
    size: float = 0.0
    """Standard deviation of its pixels about the centroid, normalised coordinates; 0 if not known."""
    moved: float = 0.0
    """Part of ``reach``: how far it may have moved by itself while it was not seen."""


FIRST_LOOK = Expectation(np.zeros(2), math.inf)
"""Before the target was ever seen: of several things it is the one near the image centre."""


NOWHERE = Expectation(np.zeros(2), 0.0)
"""While it must be behind the camera nothing is taken for it."""


def followed(seen: Segmentation, depth: float, T_base_cam: FloatArray, time: float) -> Track:
    """Note where the target is.

    Args:
        seen: the visible target.
        depth: its estimated depth Z_f, m.
        T_base_cam: camera pose, shape (4, 4).
        time: of the image, s.
    """
    point = transform(T_base_cam, depth * np.array([*seen.centroid, 1.0]))
    return Track(point, depth * math.sqrt(0.5 * float(np.trace(seen.second_moments))), time)


def expected_at(track: Track | None, T_base_cam: FloatArray, time: float, settings: TrackingSettings) -> Expectation:
    """Where a camera should see the target.

    Args:
        track: where it was last seen; None before the first sight.
        T_base_cam: camera pose, shape (4, 4).
        time: of the image, s.
        settings: how far off it may be.
    """
    if track is None:
        return FIRST_LOOK
    x, y, z = transform(inverse(T_base_cam), track.point)
    unseen = time - track.time
    if unseen > settings.forget_s:
        return FIRST_LOOK
    if z <= 0.0:
        return NOWHERE
    moved = min(settings.speed * unseen, settings.largest_move_m)
    reach = settings.slack + (settings.size_share * track.size_m + moved) / z
    return Expectation(np.array([x / z, y / z]), reach, track.size_m / z, moved / z)
