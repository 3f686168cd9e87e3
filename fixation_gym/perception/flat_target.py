"""Where the centre of a flat target is in the image, from the centroid of its pixels."""

from __future__ import annotations

import numpy as np

from fixation_gym.types import FloatArray


def facing_centroid(centroid: FloatArray, second_moments: FloatArray, normal_cam: FloatArray) -> FloatArray:
    """Image of a flat target's centre from the centroid of its pixels, shape (2,).

    The near half of a slanted target covers more pixels than the far one. With inverse depth
    d(p) = d_c (1 + s . (p - p_c)) area goes with d^-3 and position with 1/d, so the centre is at p_c - 4 M s to first
    order in the slant s (the terms of third order all but cancel).

    Args:
        centroid: p_c, mean of the target's pixels, normalised, shape (2,).
        second_moments: M, covariance of the target's pixels, normalised, shape (2, 2).
        normal_cam: normal of the target's plane in the camera frame, either sense, shape (3,).
    """
    slant = normal_cam[:2] / (normal_cam @ np.array([*centroid, 1.0]))
    return centroid - 4.0 * second_moments @ slant
