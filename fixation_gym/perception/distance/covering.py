"""How far the centroid of the target can have slid over it because something covers or uncovers it.

What passes in front takes a strip off one side of the visible target: the centroid of the rest moves although the
target does not. The area tells how much, since the target's own area changes slowly, by its distance and as it turns.
"""

from __future__ import annotations

import math

from fixation_gym.perception.detection.segmentation import Segmentation

_TURNING = 1.0
"""Relative change of area per radian by which the view turns: of a flat thing seen from 45 degrees above."""
_NOISE = 0.05
"""Relative change of area that noise explains, 1/s."""
_SUSTAINED = 3.0
"""A slide lasts for many frames in one direction: as independent steps they must be this much larger."""


def slide(before: Segmentation, now: Segmentation, approach: float, turned: float, dt: float) -> float:
    """Standard deviation of the slide of the centroid between two images, normalised coordinates.

    Args:
        before: the target in the image before.
        now: the target in this image.
        approach: distance of the target before, as a multiple of the one now.
        turned: angle between the two lines of sight in the base frame, rad.
        dt: time between the images, s.
    """
    if not (before.whole and now.whole):
        return 0.0
    growth = math.log(now.area_fraction / (before.area_fraction * approach**2))
    size = math.sqrt(0.5 * float(now.second_moments[0, 0] + now.second_moments[1, 1]))
    # A strip that is a share s of a square with half side sqrt(3) sigma shifts the centroid of the rest by s of that.
    return _SUSTAINED * math.sqrt(3.0) * size * max(0.0, abs(growth) - _TURNING * turned - _NOISE * dt)
