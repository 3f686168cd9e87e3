"""Which colours tell a thing from its surroundings: two histograms that follow the light slowly.

Value in, value out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from fixation_gym.types import ImageArray, MaskArray

_BINS = (8, 32, 32)
"""Bins of L, a and b: a thing is told by its hue more than by its brightness, which light changes."""
_SMOOTHING = (1.2, 1.0, 1.0)
"""Standard deviation over which a colour counts for its neighbours, bins."""
_UNSEEN_ON, _UNSEEN_AROUND = 1e-4, 1e-3
"""Share of an unseen colour on a thing and around it: what was never seen is rather not the thing."""
_MOST = 3.0
"""What one pixel can say at most, natural logarithm of how much likelier it is on the thing."""

_NEAR = 0.3
"""Close around a thing: within this share of its size."""

BinArray = NDArray[np.int32]
Histogram = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class ColourModel:
    """Shares of colours on a thing and around it, flat histograms; now, and at the first look."""

    thing: Histogram
    around: Histogram
    first_thing: Histogram
    first_around: Histogram

    def scores(self, bins: BinArray) -> NDArray[np.float32]:
        """How much likelier pixels are on the thing than around it by their colour, natural logarithm, -3..3."""
        ratio = np.log((self.thing + _UNSEEN_ON) / (self.around + _UNSEEN_AROUND))
        return np.clip(ratio, -_MOST, _MOST)[bins]

    def likeness(self, bins: BinArray) -> float:
        """Bhattacharyya coefficient of pixels' colours, of any shape, and the thing's, 0..1."""
        return float(np.sqrt(histogram(bins.ravel()) * self.thing).sum())


def colour_bins(rgb: ImageArray) -> BinArray:
    """Index of each pixel's colour in the flat histograms, shape (h, w)."""
    lab = cv2.cvtColor(np.ascontiguousarray(rgb), cv2.COLOR_RGB2LAB)
    lightness, a, b = (lab[..., k].astype(np.int32) // (256 // count) for k, count in enumerate(_BINS))
    return (lightness * _BINS[1] + a) * _BINS[2] + b


def histogram(bins: BinArray) -> Histogram:
    """Share of each colour among pixels, shape (n,), smoothed; all zero if there are none."""
    from scipy.ndimage import gaussian_filter  # half a second to import

    counts = np.bincount(bins, minlength=int(np.prod(_BINS))).astype(np.float32).reshape(_BINS)
    smooth = gaussian_filter(counts, _SMOOTHING, mode="nearest", truncate=2.0)
    return np.asarray(smooth, np.float32).ravel() / np.float32(max(1, bins.size))


def confusion(rgb: ImageArray, mask: MaskArray) -> float:
    """Share of pixels that their colours put on the wrong side: those of a thing and those close around it, 0..0.5."""
    near = max(4, round(_NEAR * math.sqrt(np.count_nonzero(mask))))
    pixels, bins = mask.view(np.uint8), colour_bins(rgb)
    grown, gap = (cv2.dilate(pixels, np.ones((2 * side + 1,) * 2, np.uint8)) > 0 for side in (near, 3))
    on, around = histogram(bins[mask]), histogram(bins[grown & ~gap])
    likelier = on > around
    return 0.5 * float(on[~likelier].sum() + around[likelier].sum())


def first_model(bins: BinArray, thing: MaskArray, around: MaskArray) -> ColourModel:
    """Learn from one image; ``thing`` and ``around`` choose pixels of ``bins``."""
    inside, outside = histogram(bins[thing]), histogram(bins[around])
    return ColourModel(inside, outside, inside, outside)


def learnt(
    model: ColourModel, bins: BinArray, thing: MaskArray, around: MaskArray, share: float, keep: float
) -> ColourModel:
    """Let the histograms follow an image.

    Args:
        model: before.
        bins: of the image.
        thing: pixels that are surely on the thing.
        around: pixels that are surely around it.
        share: of the new image in the histograms, 0..1.
        keep: part of that share which goes to the first look instead: what follows slowly drifts far.
    """
    inside, outside = histogram(bins[thing]), histogram(bins[around])
    new, old = share * (1.0 - keep), share * keep
    return replace(
        model,
        thing=(1.0 - share) * model.thing + new * inside + old * model.first_thing,
        around=(1.0 - share) * model.around + new * outside + old * model.first_around,
    )
