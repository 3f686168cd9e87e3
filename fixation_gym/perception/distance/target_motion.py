"""Inverse depth of the target from the motion of its own pixels: a check on the distance from its centroid.

The centroid of what is visible slides while something passes in front of the target, and the distance that follows from
it can be wrong by half with a small stated error. The motion of the target's own edges is not affected. Without such
slides the centroid is ten times as accurate: pixels tell a mean depth of a surface, not where the object's centre is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import median

import cv2
import numpy as np

from fixation_gym.geometry.interaction import epipolar_direction
from fixation_gym.perception.flow.optic_flow import Flow
from fixation_gym.types import FloatArray, MaskArray

InverseDepth = tuple[float, float]
"""Value and standard deviation, 1/m."""
_QUANTILES = (0.1, 0.2, 0.3)
"""Of the pixels' inverse depths, weighted: low, because edges shared with what covers the target belong to that."""
_LEAST_PIXELS = 8
_LEAST_RECENT = 3
_RIM = np.ones((5, 5), np.uint8)
"""Neighbourhood that a pixel of the target must share to count, px of the flow grid."""
_LEAST_RELATIVE_STD = 0.02
_SURFACE_SHARE = 0.4
"""Depth between surface and centre, as a share of the target's standard deviation across the line of sight."""
_LARGEST_RELATIVE_STD = 0.05
"""Less sure, it may be the motion of what covers the target nearly all."""
_MUCH_SURER = 2.0
"""What is known this much better replaces what is known worse."""
_GATE = 3.0
"""Contradictions count from this many standard deviations on."""


def target_inverse_depth(flow: Flow, twist: FloatArray, target: MaskArray) -> InverseDepth | None:
    """Inverse depth that explains the motion of most of the target's pixels; None without enough of them.

    Args:
        flow: residual motion and its data, shape (h, w).
        twist: mean camera twist [v, w] over the frames of the flow, shape (6,), m/s and rad/s.
        target: pixels of the target, shape (h, w).
    """
    inner = cv2.erode((target & flow.overlap).view(np.uint8), _RIM)  # farther out, the background moves, too
    rows, columns = np.nonzero(inner)
    if len(rows) < _LEAST_PIXELS:
        return None
    x, y = (axis[rows, columns] for axis in flow.intrinsics.grid)
    gx, gy = epipolar_direction(x, y, twist[:3])
    gx, gy = gx * (flow.intrinsics.fx * flow.period), gy * (flow.intrinsics.fy * flow.period)
    xx, xy, yy = flow.information[:, rows, columns].astype(np.float64)
    information = gx * gx * xx + 2.0 * gx * gy * xy + gy * gy * yy
    bx, by = flow.gradient[:, rows, columns].astype(np.float64)
    depth = flow.warp_inverse_depth - (gx * bx + gy * by) / np.maximum(information, 1e-12)
    ninth = int(0.9 * (len(information) - 1))
    weight = np.minimum(information, np.partition(information, ninth)[ninth])  # no single edge decides
    order = np.argsort(depth)
    share = np.cumsum(weight[order])
    if not share[-1] > 0.0:
        return None
    low, value, high = depth[order][np.searchsorted(share, np.array(_QUANTILES) * share[-1])]
    spread = _SURFACE_SHARE * math.sqrt(0.5 * float(x.var() + y.var()))
    model = math.hypot(_LEAST_RELATIVE_STD, spread) * abs(value)
    std = max(model, 0.25 * (high - low), float(1.0 / np.sqrt(information.max())))
    return float(value), float(std)


def contradiction(believed: InverseDepth, recent: Sequence[InverseDepth], covered: bool) -> InverseDepth | None:
    """What the target's own motion says if that contradicts what is believed, or is much surer; else None.

    Args:
        believed: inverse depth of the target from its centroid.
        recent: from the motion of its pixels, in the last frames.
        covered: whether something covers or uncovers the target; if not, its centroid tells most, however slowly.
    """
    if len(recent) < _LEAST_RECENT:
        return None
    values, stds = zip(*recent, strict=True)
    value, std = median(values), math.hypot(median(stds), 0.5 * (max(values) - min(values)))
    if std > _LARGEST_RELATIVE_STD * value:
        return None
    contradicts = abs(value - believed[0]) > _GATE * math.hypot(std, believed[1])
    much_surer = covered and _MUCH_SURER * std < believed[1]
    return (value, std) if contradicts or much_surer else None
