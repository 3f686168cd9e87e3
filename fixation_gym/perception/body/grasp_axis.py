"""Along which direction in the image the gripper should close: where the target's silhouette is narrowest."""

from __future__ import annotations

import cv2
import numpy as np

from fixation_gym.types import MaskArray

_STEP = np.radians(5.0)


def narrow_axis(mask: MaskArray, roll: float, max_roll: float, level_preference: float = 0.15) -> float:
    """Angle by which the camera should roll so that the gripper closes across the target's narrowest width.

    Args:
        mask: pixels of the target, shape (H, W).
        roll: present roll of the camera against level, rad.
        max_roll: largest allowed roll against level, rad.
        level_preference: relative width that is given up to stay level; keeps round targets from turning the hand.

    Returns:
        Angle about the optical axis, rad, positive clockwise in the image; 0 if the target is not visible.
    """
    contours, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    if not contours:
        return 0.0
    hull = cv2.convexHull(np.concatenate(contours)).reshape(-1, 2).astype(np.float64)
    rolls = np.arange(-max_roll, max_roll + 1e-9, _STEP)
    angles = rolls - roll
    projections = hull @ np.stack([np.cos(angles), np.sin(angles)])
    widths = np.ptp(projections, axis=0) + 1.0
    cost = widths * (1.0 + level_preference * (rolls / max_roll) ** 2)
    return float(angles[np.argmin(cost)])
