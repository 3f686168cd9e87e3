"""The centre of the target's body: which outlines are kept, and when they are too old to be true."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.distance_filters import Fixation
from fixation_gym.perception.segmentation import Segmentation
from fixation_gym.perception.upright_body import (
    BodySettings,
    Outline,
    UprightBody,
    fit_upright_body,
    misfit,
    outline_of,
)
from fixation_gym.types import FloatArray


@dataclass(frozen=True, slots=True)
class CentreSettings:
    """Which outlines are kept, and when the fitted body is believed."""

    body: BodySettings = field(default_factory=BodySettings)
    """Noise of outlines and prior of the body."""
    baseline: float = 0.05
    """A new outline is kept when the camera moved by this share of the distance."""
    max_outlines: int = 32
    """When there are more, every second of the older half goes."""
    least_outlines: int = 6
    """A body is believed when this many outlines made it."""
    largest_misfit_px: float = 3.0
    """A body that misses the newest outline by more, in the median, is another one, or has moved."""
    believed_std_m: float = 0.006
    """Standard deviation of the centre along the optical axis up to which it is believed."""
    distance_relative_std: float = 0.1
    """Outlines are kept when the distance is known as well as this."""


@dataclass(frozen=True, slots=True, eq=False)
class TargetBody:
    """What outlines said so far."""

    outlines: tuple[Outline, ...] = ()
    body: UprightBody | None = None

    def believed(self, T_base_cam: FloatArray, settings: CentreSettings) -> UprightBody | None:
        """The body, if its depth from this camera is sure enough."""
        if self.body is None or len(self.outlines) < settings.least_outlines:
            return None
        return self.body if self.body.depth(T_base_cam)[1] < settings.believed_std_m else None


def with_outline(
    known: TargetBody,
    seen: Segmentation,
    fixation: Fixation,
    intrinsics: Intrinsics,
    T_base_cam: FloatArray,
    support_height: float,
    settings: CentreSettings,
) -> TargetBody:
    """Take in the target's outline, if it is all in the image and seen from a new place.

    Args:
        known: what outlines said before.
        seen: target in the image.
        fixation: where it is about.
        intrinsics: of the image.
        T_base_cam: camera pose in base, shape (4, 4).
        support_height: height of the table in base, m.
        settings: of what to keep.
    """
    depth = fixation.distance_m
    if not seen.whole or fixation.distance_std_m > settings.distance_relative_std * depth:
        return known
    if known.outlines:
        moved = np.linalg.norm(T_base_cam[:3, 3] - known.outlines[-1].origin)
        if moved < settings.baseline * depth:
            return known
    newest = outline_of(seen.mask, intrinsics, T_base_cam, depth)
    outlines = (*_thinned(known.outlines, settings.max_outlines), newest)
    body = fit_upright_body(outlines, fixation.point_base, support_height, settings.body, known.body)
    if float(np.median(np.abs(misfit(body, newest, support_height)))) > settings.largest_misfit_px:
        outlines = (newest,)
        body = fit_upright_body(outlines, fixation.point_base, support_height, settings.body)
    return TargetBody(outlines, body)


def _thinned(outlines: tuple[Outline, ...], most: int) -> tuple[Outline, ...]:
    """Fewer than ``most``: the newer half is kept, and every second one of the older half."""
    if len(outlines) < most:
        return outlines
    return outlines[: most // 2 : 2] + outlines[most // 2 :]
