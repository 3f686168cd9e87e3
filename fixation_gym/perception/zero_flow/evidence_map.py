"""The coarse map for policies: evidence of many pixels pooled into 32 x 32 cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fixation_gym.perception.scratch import Float32Array
from fixation_gym.perception.zero_flow import pixel_kernels
from fixation_gym.perception.zero_flow.front_rule import FrontRule, exact_rule
from fixation_gym.robots import ROBOT
from fixation_gym.types import ImageArray, MaskArray

CELLS = 32
"""Cells along each side of the map."""
UNKNOWN = 128
"""Cell value where there is no evidence; otherwise P(nearer) times 255."""


@dataclass(frozen=True, slots=True)
class ZeroFlowSettings:
    """Margins and gates of the test."""

    rule: FrontRule = exact_rule
    """What tells front from behind: the exact test, the paper's dot product for comparison, or one's own."""
    depth_margin: float = 0.05
    """An obstacle's inverse depth exceeds the fixated one by this share at least."""
    height_margin_m: float = 0.015
    """An obstacle rises above the support surface by this much at least, m."""
    max_relative_std: float = 0.25
    """A pixel has evidence if its inverse depth is known to this share of the fixated one."""
    max_fixation_std: float = 0.15
    """While the fixated inverse depth is known to less than this share, only pixels that are decided all the same have
    evidence."""
    position_std_m: float = ROBOT.arm.position_std
    """Noise of each camera position, m."""
    rotation_std_rad: float = ROBOT.arm.rotation_std
    """Noise of each camera orientation, rad."""
    moving_gate: float = 15.0
    """Motion across the epipolar line is independent above this chi-square (1 degree of freedom; 99.99 %)."""
    moving_px: float = 0.25
    """... and above this motion, px of the flow grid per frame interval."""
    target_margin_px: int = 3
    """The target is widened by this much, px of the flow grid: windows at its outline mix it with what is behind."""
    outline_px: int = 3
    """Reach of a window beyond its centre, px of the flow grid: what an outline moves like may be its neighbour's."""
    cell_min_share: float = 0.06
    """Least share of a cell's pixels that must have evidence."""
    cell_min_front: float = 0.15
    """Least front evidence in a cell and its 8 neighbours together, in cells; less is speckle."""
    front_weight: float = 2.0
    """Front evidence counts this much more than evidence of the free background in the same cell."""


def evidence_map(
    p_nearer: Float32Array, supported: MaskArray, moving: MaskArray, settings: ZeroFlowSettings
) -> ImageArray:
    """Pool the evidence of pixels into the map, shape (32, 32); a pixel weighs by how decided it is.

    Args:
        p_nearer: of every pixel, shape (h, w); 0.5 without evidence.
        supported: pixels with evidence, shape (h, w).
        moving: pixels that move by themselves and count as near, shape (h, w).
        settings: weights and thresholds.
    """
    least_front, weight = np.float32(settings.cell_min_front), np.float32(settings.front_weight)
    least_share = np.float32(settings.cell_min_share)
    if min(p_nearer.shape) < CELLS:
        # Each cell needs a pixel. Its mean stays what it is if every pixel is cut in equal parts.
        pixels = np.ix_(*(np.repeat(np.arange(side), -(-CELLS // side)) for side in p_nearer.shape))
        p_nearer, supported, moving = p_nearer[pixels], supported[pixels], moving[pixels]
    pooled, values = np.empty((5, CELLS, CELLS), np.float32), np.empty((CELLS, CELLS), np.uint8)
    pixel_kernels.pooled_evidence(p_nearer, supported, moving, pooled)
    pixel_kernels.map_values(pooled, least_front, weight, least_share, np.uint8(UNKNOWN), values)
    return values
