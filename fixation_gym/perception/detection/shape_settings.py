"""Settings of how a thing is followed by its colours and its shape."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ShapeSettings:
    """What counts as the thing, and how fast its look may change."""

    surroundings: float = 0.6
    """The background is learnt within this share of the thing around it."""
    learning: float = 0.04
    """Share of a new image in the histograms ..."""
    first_look: float = 0.5
    """... and part of it that goes to the first look instead."""
    prior: float = 3.0
    """How much likelier a pixel is on the thing deep in its shape than at its edge, natural logarithm."""
    inside: float = 1.0
    """... but no more than this: what covers it lies in its shape, too."""
    softness_px: float = 1.5
    """Distance from the edge of the shape that counts as deep: so many px ..."""
    softness: float = 0.06
    """... and this share of its size ..."""
    turning: float = 0.25
    """... and this one per radian by which the view turned since that shape was seen."""
    sure: float = 2.0
    """From this much on, natural logarithm, colour and shape decide what a pixel is; else edges in the image do."""
    shift: float = 0.25
    """How far off the expected place the colours may draw it, as a share of its size."""
    size_error: float = 0.12
    """A shape is kept if the area seen is by this share as it must be ..."""
    size_turning: float = 0.3
    """... and by this much more per radian by which the view turned."""
    renewed_turn: float = 0.05
    """A shape is kept when the view turned by this angle, rad ..."""
    renewed_scale: float = 0.1
    """... or its scale changed by this share."""
    area_turning: float = 0.4
    """Relative change of the area that must be, per radian by which the view turns ..."""
    area_still: float = 0.002
    """... and from one image to the next."""
    settled: float = 0.05
    """Its size is known once its area changes by less than this share from one image to the next."""
    least_seen: float = 0.15
    """Share of the shape that must look like the thing while it is followed ..."""
    least_found: float = 0.5
    """... and where it is found again."""
    least_like: float = 0.6
    """How like the thing's the colours must be, as a share of how like they usually are ..."""
    found_like: float = 0.75
    """... and where it is found again."""
    found_contrast: float = 0.4
    """How far it stands out from what is around it where it is found again, as a share of how far it usually does."""
