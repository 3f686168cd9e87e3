"""Compiled loop of the obstacle memory."""

from __future__ import annotations

import numpy as np

from fixation_gym.compiled import compiled


@compiled
def standing_depths(inverse_depth, std, p_nearer, supported, x, y, surface, bounds, depths):
    """Inverse depth of pixels that surely show something that stands in the work space; 0 elsewhere.

    Args:
        inverse_depth: of the pixels, shape (h, w), 1/m.
        std: its standard deviation, shape (h, w), 1/m.
        p_nearer: probability that they are in front of the target, shape (h, w).
        supported: pixels with evidence, shape (h, w).
        x: normalised coordinates of the columns, shape (w,).
        y: the same of the rows, shape (h,).
        surface: the vertical in the camera, and how far above it a plane just over the support surface is, m, which is
            negative; shape (4,). Where that is 0, only what is in front counts.
        bounds: largest relative standard deviation, least probability, standard deviations above the surface, least
            inverse depth in 1/m; shape (4,), float32.
        depths: result, shape (h, w), 1/m.
    """
    share, least_p, sigmas, least = bounds[0], bounds[1], bounds[2], bounds[3]
    rise = surface[3]
    for row in range(depths.shape[0]):
        for column in range(depths.shape[1]):
            depth, depth_std = inverse_depth[row, column], std[row, column]
            stands = False
            if supported[row, column] and depth_std < share * depth:
                stands = p_nearer[row, column] > least_p
                if not stands and rise < 0.0 and depth > least:
                    plane = (surface[0] * x[column] + surface[1] * y[row] + surface[2]) / rise
                    stands = depth - sigmas * depth_std > plane
            depths[row, column] = depth if stands else np.float32(0.0)
