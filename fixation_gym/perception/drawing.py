"""Draw what perception sees onto the camera image."""

from __future__ import annotations

import cv2
import numpy as np

from fixation_gym.perception.distance.pose_filter import Fixation
from fixation_gym.perception.percept import Percept
from fixation_gym.perception.zero_flow.zero_flow import UNKNOWN, obstacle_centre
from fixation_gym.types import ImageArray

FRONT_RGB = (255, 140, 0)
"""Nearer than the fixated object: orange."""
BEHIND_RGB = (40, 110, 255)
"""Farther than the fixated object: blue."""
MOVING_RGB = (255, 0, 200)
"""Moves by itself: magenta."""
TARGET_RGB = (255, 255, 255)
"""Outline of the target and gaze cross: white."""


_LEAST_SHOWN = 0.01
"""Share of the map that must be in front before its centre of mass is marked."""


def draw_overlay(rgb: ImageArray, percept: Percept | None, scale: float = 1.0) -> ImageArray:
    """Draw gaze cross, target outline, zero-flow evidence, its map as an inset and the distance.

    Args:
        rgb: the image of the percept, shape (H, W, 3).
        percept: what perception made of it; the zero-flow test is one frame older than the image. None: nothing is
            known, and nothing is drawn.
        scale: size of the result relative to the image.

    Returns:
        Image of shape (scale H, scale W, 3), uint8.
    """
    size = (round(rgb.shape[1] * scale), round(rgb.shape[0] * scale))
    canvas = cv2.resize(rgb, size, interpolation=cv2.INTER_CUBIC if scale > 1 else cv2.INTER_AREA)
    if percept is None:
        return np.asarray(canvas, np.uint8)
    canvas = _tint(np.asarray(canvas, np.uint8), percept)
    _draw_target(canvas, percept)
    _draw_cross(canvas)
    _draw_obstacle_centre(canvas, percept)
    _draw_inset(canvas, percept.zfc.cells)
    _draw_text(canvas, percept)
    return canvas


def colour_map(cells: ImageArray) -> ImageArray:
    """Colours of a zero-flow map, shape (..., 3): orange in front, blue behind, dark grey unknown."""
    p = cells.astype(np.float64)[..., None] / 255.0
    grey = np.array([60.0, 60.0, 60.0])
    decided = np.abs(2.0 * p - 1.0)
    hue = np.where(p > 0.5, np.array(FRONT_RGB, float), np.array(BEHIND_RGB, float))
    colours = (1.0 - decided) * grey + decided * hue
    return np.where((cells == UNKNOWN)[..., None], grey, colours).astype(np.uint8)


def _tint(canvas: ImageArray, percept: Percept) -> ImageArray:
    """Blend the evidence of single pixels over the image."""
    zfc = percept.zfc
    height, width = canvas.shape[:2]
    decided = np.where(zfc.supported, 2.0 * zfc.p_nearer - 1.0, 0.0).astype(np.float32)
    strengths = (
        (FRONT_RGB, np.maximum(decided, 0.0), 0.65),
        (BEHIND_RGB, np.maximum(-decided, 0.0), 0.35),
        (MOVING_RGB, zfc.moving.astype(np.float32), 0.75),
    )
    # Rows of all colours of all pixels, since numpy is slow along a last axis of length 3.
    result = canvas.reshape(height, 3 * width).astype(np.float32)
    for colour, strength, opacity in strengths:
        if strength.any():
            alpha = opacity * cv2.resize(strength, (width, height), interpolation=cv2.INTER_LINEAR)
            alphas = cv2.merge([alpha, alpha, alpha]).reshape(result.shape)
            result *= 1.0 - alphas
            alphas *= np.tile(np.array(colour, np.float32), width)
            result += alphas
    return np.rint(result).astype(np.uint8).reshape(canvas.shape)


def _unit(canvas: ImageArray) -> float:
    """Line width 1 belongs to an image of 480 rows."""
    return canvas.shape[0] / 480.0


def _draw_target(canvas: ImageArray, percept: Percept) -> None:
    if not percept.segmentation.visible:
        return
    size = (canvas.shape[1], canvas.shape[0])
    mask = cv2.resize(percept.segmentation.mask.astype(np.uint8) * 255, size, interpolation=cv2.INTER_LINEAR)
    contours, _ = cv2.findContours((mask > 127).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(canvas, contours, -1, TARGET_RGB, max(1, round(2 * _unit(canvas))), cv2.LINE_AA)


def _draw_cross(canvas: ImageArray) -> None:
    height, width = canvas.shape[:2]
    centre_x, centre_y = (width - 1) / 2, (height - 1) / 2
    inner, outer = 0.012 * height, 0.045 * height
    for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        start = (round(centre_x + inner * dx), round(centre_y + inner * dy))
        end = (round(centre_x + outer * dx), round(centre_y + outer * dy))
        for colour, thickness in (((0, 0, 0), 4), ((255, 255, 255), 2)):
            cv2.line(canvas, start, end, colour, max(1, round(thickness * _unit(canvas))), cv2.LINE_AA)


def _draw_obstacle_centre(canvas: ImageArray, percept: Percept) -> None:
    """Ring at the centre of mass of what is in front, if there is enough of it."""
    camera = percept.flow.intrinsics.scaled(canvas.shape[0], canvas.shape[1])
    centre, share = obstacle_centre(percept.zfc, camera)
    if share < _LEAST_SHOWN:
        return
    pixel = (round(camera.fx * centre[0] + camera.cx), round(camera.fy * centre[1] + camera.cy))
    for colour, thickness in (((0, 0, 0), 5), (FRONT_RGB, 3)):
        cv2.circle(
            canvas, pixel, round(14 * _unit(canvas)), colour, max(1, round(thickness * _unit(canvas))), cv2.LINE_AA
        )


def _draw_inset(canvas: ImageArray, cells: ImageArray) -> None:
    height, width = canvas.shape[:2]
    side = round(0.26 * height)
    edge = max(2, round(0.012 * height))
    inset = cv2.resize(colour_map(cells), (side, side), interpolation=cv2.INTER_NEAREST)
    top, left = edge, width - side - edge
    canvas[top : top + side, left : left + side] = inset
    corner = (left + side - 1, top + side - 1)
    cv2.rectangle(canvas, (left, top), corner, (255, 255, 255), max(1, round(_unit(canvas))))


def distance_text(fixation: Fixation) -> str:
    """What is known of the distance, in words."""
    if not fixation.initialised:
        return "target not seen yet"
    if fixation.distance_std_m >= fixation.distance_m:
        text = "distance unknown"
    else:
        text = f"{100 * fixation.distance_m:.1f} +- {100 * fixation.distance_std_m:.1f} cm"
    return text if fixation.visible else f"{text} (lost)"


def _draw_text(canvas: ImageArray, percept: Percept) -> None:
    text = distance_text(percept.fixation)
    unit = _unit(canvas)
    size, thickness = 0.9 * unit, max(1, round(2 * unit))
    (text_width, text_height), baseline = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, size, thickness)
    edge = max(3, round(0.02 * canvas.shape[0]))
    bottom = canvas.shape[0] - edge
    box = canvas[bottom - text_height - 2 * edge : bottom + baseline, edge : 3 * edge + text_width]
    box[:] = (box * 0.35).astype(np.uint8)
    position = (2 * edge, bottom - edge // 2 - baseline // 2)
    cv2.putText(canvas, text, position, cv2.FONT_HERSHEY_SIMPLEX, size, (255, 255, 255), thickness, cv2.LINE_AA)
