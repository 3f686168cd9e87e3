"""Front, behind or unknown for a whole thing: a vote over the pixels of its region.

Only edges across the motion carry evidence, so most pixels of a plain thing are unknown, and what is see-through or
reflects shows mostly things behind. A region is therefore in front as soon as a small but solid share of it is, and
behind only if hardly anything of it is.

An outline belongs to the nearer thing, and its motion spreads to what is beside it in the image. So evidence in front
abstains within a window's reach of evidence in front outside the region: it may be the neighbour's.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import cv2
import numpy as np

from fixation_gym.perception.zero_flow.zero_flow import ZeroFlow
from fixation_gym.types import MaskArray


class Side(Enum):
    """Where a thing is, seen from the fixated object."""

    FRONT = "front"
    BEHIND = "behind"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class VoteSettings:
    """When a region is decided."""

    min_probability: float = 0.95
    """Pixels less sure than this abstain."""
    min_pixels: float = 6.0
    """Least number of votes for either side, px of the flow grid."""
    reach_px: int = 3
    """Front evidence outside the region silences that inside within this reach of a window, px of the flow grid."""
    front_share: float = 0.12
    """Least share of the votes that makes a region count as in front."""
    behind_share: float = 0.06
    """Largest share of front votes in a region that counts as behind; in between it is unknown."""


def region_votes(zero_flow: ZeroFlow, region: MaskArray, settings: VoteSettings) -> tuple[float, float]:
    """Votes of a region for front, or moving by itself, and for behind, px of the flow grid.

    Args:
        zero_flow: the test.
        region: pixels of the thing, shape (h, w).
        settings: when a pixel votes.
    """
    p, own = zero_flow.p_nearer, zero_flow.moving
    front = (p > settings.min_probability) | own
    behind = (p < 1.0 - settings.min_probability) & ~own
    square = np.ones((2 * settings.reach_px + 1,) * 2, np.uint8)
    neighbours = cv2.dilate((front & ~region).view(np.uint8), square).view(np.bool_)
    return float(np.count_nonzero(front & region & ~neighbours)), float(np.count_nonzero(behind & region))


def decide(front: float, behind: float, settings: VoteSettings) -> Side:
    """Side of a region with these votes; votes may be sums over time."""
    total = front + behind
    if front >= settings.min_pixels and front >= settings.front_share * total:
        return Side.FRONT
    if behind >= settings.min_pixels and front <= settings.behind_share * total:
        return Side.BEHIND
    return Side.UNKNOWN
