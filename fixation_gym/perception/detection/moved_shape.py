"""A shape that moves along with a thing: where it goes, where colours fit it best, and how deep pixels lie in it.

Value in, value out; all in pixels of one image size.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from fixation_gym.types import FloatArray, ImageArray, MaskArray

Affine = NDArray[np.float64]
"""Shape (2, 3): maps pixels (u, v, 1)."""
ScoreArray = NDArray[np.float32]
Window = tuple[slice, slice]
"""Rows and columns of an image."""


def similarity(centre: FloatArray, moved: FloatArray, angle: float, scale: float) -> Affine:
    """Turn by an angle (rad, from u to v) and scale about a centre, shape (2,), which moves to another place."""
    c, s = scale * math.cos(angle), scale * math.sin(angle)
    turn = np.array([[c, -s], [s, c]])
    return np.column_stack([turn, moved - turn @ centre])


def after(second: Affine, first: Affine) -> Affine:
    """The motion that does ``first``, then ``second``."""
    return np.column_stack([second[:, :2] @ first[:, :2], second[:, :2] @ first[:, 2] + second[:, 2]])


def shifted(affine: Affine, by: FloatArray) -> Affine:
    """A motion with a shift, shape (2,), added."""
    return np.column_stack([affine[:, :2], affine[:, 2] + by])


def box_of(mask: MaskArray, affine: Affine) -> FloatArray:
    """Box around a mask after a motion: left, top, right, bottom, px, shape (4,); it may reach beyond the image."""
    left, top, width, height = cv2.boundingRect(mask.view(np.uint8))
    corners = np.array([(x, y) for x in (left, left + width - 1) for y in (top, top + height - 1)], np.float64)
    moved = corners @ affine[:, :2].T + affine[:, 2]
    return np.concatenate([moved.min(axis=0), moved.max(axis=0)])


def window_of(box: FloatArray, margin: float, shape: tuple[int, int]) -> Window | None:
    """Part of an image of a shape (h, w) around a box; None if that is out of the image."""
    left, top, right, bottom = np.clip(box, -1e6, 1e6)
    rows = slice(max(0, math.floor(top - margin)), min(shape[0], math.ceil(bottom + margin) + 1))
    columns = slice(max(0, math.floor(left - margin)), min(shape[1], math.ceil(right + margin) + 1))
    return (rows, columns) if rows.stop - rows.start > 2 and columns.stop - columns.start > 2 else None


def moved_mask(mask: MaskArray, affine: Affine, window: Window) -> MaskArray:
    """What a motion makes of a mask, in a window, which may reach beyond the image."""
    rows, columns = window
    shift = affine - np.array([[0.0, 0.0, columns.start], [0.0, 0.0, rows.start]])
    size = (columns.stop - columns.start, rows.stop - rows.start)
    return cv2.warpAffine(mask.view(np.uint8) * 255, shift, size, flags=cv2.INTER_LINEAR) > 127


def depth_in(shape: MaskArray) -> ScoreArray:
    """Distance of pixels from the edge of a shape, px, positive inside, shape (h, w)."""
    padded = cv2.copyMakeBorder(shape.view(np.uint8), 1, 1, 1, 1, cv2.BORDER_REPLICATE)
    inside, outside = (cv2.distanceTransform(side, cv2.DIST_L2, 3) for side in (padded, 1 - padded))
    depth = np.where(padded > 0, inside - 0.5, 0.5 - outside)
    return depth[1:-1, 1:-1].astype(np.float32)


def best_fit(scores: ScoreArray, shape: MaskArray, start: FloatArray, reach: float) -> tuple[float, FloatArray]:
    """Where in an image of scores a shape fits best: high scores in it, low ones in a ring around it.

    Args:
        scores: shape (h, w); what lies outside says nothing.
        shape: shape (m, n), with a margin for the ring.
        start: column and row of its top-left pixel where it should be, shape (2,).
        reach: distance from there at which a place loses 1 of its score, px; inf: all places are equal.

    Returns:
        How much higher the mean score in the shape is than in the ring, and how far that place is from ``start``, px.
    """
    inner = shape.view(np.uint8)
    side = 2 * max(2, round(0.25 * math.sqrt(cv2.countNonZero(inner)))) + 1
    ring = cv2.dilate(inner, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))) - inner
    template = inner / max(1, cv2.countNonZero(inner)) - ring / max(1, cv2.countNonZero(ring))
    rows, columns = shape.shape[0] // 2, shape.shape[1] // 2
    padded = cv2.copyMakeBorder(scores, rows, rows + 1, columns, columns + 1, cv2.BORDER_CONSTANT, value=0.0)
    fit = cv2.matchTemplate(padded, template.astype(np.float32), cv2.TM_CCORR)
    x, y = np.arange(fit.shape[1]) - columns - start[0], np.arange(fit.shape[0]) - rows - start[1]
    if math.isfinite(reach):
        fit = fit - ((x**2)[None] + (y**2)[:, None]).astype(np.float32) / max(reach, 1.0) ** 2
    _, best, _, (column, row) = cv2.minMaxLoc(fit)
    return best, np.array([x[column], y[row]])


def cut_at_edges(rgb: ImageArray, scores: ScoreArray, sure: float) -> MaskArray:
    """Which pixels are a thing: those with high scores, and of the doubtful ones those up to the next edge.

    Args:
        rgb: image, shape (h, w, 3).
        scores: how much likelier pixels are on the thing than not, shape (h, w).
        sure: score from which on it decides; the watershed (Meyer 1992) between the sure pixels decides the others.
    """
    markers = np.zeros(scores.shape, np.int32)
    markers[scores >= sure], markers[scores <= -sure] = 1, 2
    if not ((markers == 1).any() and (markers == 2).any()):
        return scores > 0.0
    cv2.watershed(np.ascontiguousarray(rgb), markers)
    return (markers == 1) | ((markers == -1) & (scores > 0.0))
