"""What a replay is judged by, where a recording has truth: distance, map against depth, mask.

A pixel of the map is asked about if it answers for itself (``answering_pixels``) and its true depth differs from the
target's by more than 10 %. ``sign_right``: share of these whose side is right. ``precision``: of those called nearer,
share that is. ``recall``: of those that are nearer, share called so. ``false_alarms``: of those that are farther, share
called nearer. ``found``: of all nearer pixels, asked or not, share called so. ``evidence_share`` and
``found_of_evidence`` are the share asked and ``found`` if every pixel with evidence were asked. A cell of the 32 x 32
map is clear if all that has depth in it is farther; ``clear_cells_alarmed`` is the share of clear cells in which nearer
prevails.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import cv2
import numpy as np

from fixation_gym.perception.scratch import Float32Array
from fixation_gym.perception.zero_flow.evidence_map import CELLS, UNKNOWN
from fixation_gym.perception.zero_flow.zero_flow import ZeroFlow
from fixation_gym.types import FloatArray, MaskArray

DEPTH_MARGIN = 0.10
"""Depths that differ from the target's by less are not asked about."""
KNOWN_STD = 0.15
"""A distance counts as known from this share of it on, as in the zero-flow test."""


def overlap(found: MaskArray, true: MaskArray) -> float:
    """Intersection over union of two masks, shape (H, W); 1 if both are empty."""
    union = np.count_nonzero(found | true)
    return np.count_nonzero(found & true) / union if union else 1.0


def map_counts(
    zero_flow: ZeroFlow, answering: MaskArray, depth: Float32Array, distance: float, target: MaskArray
) -> Counter[str]:
    """Counts of pixels and cells of one map; sums over frames make ``map_summary``.

    Args:
        zero_flow: the map.
        answering: pixels that are asked, shape (h, w).
        depth: true depth of the same picture, shape (H, W), m; NaN where there is none.
        distance: true depth of the target in it, m.
        target: its pixels, shape (H, W), in which nothing is asked.
    """
    height, width = zero_flow.supported.shape
    on_grid = cv2.resize(depth, (width, height), interpolation=cv2.INTER_NEAREST)
    own = cv2.resize(target.view(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST) > 0
    relative = on_grid / distance - 1.0
    with np.errstate(invalid="ignore"):
        nearer, farther = (relative < -DEPTH_MARGIN) & ~own, (relative > DEPTH_MARGIN) & ~own
        not_farther = np.isfinite(relative) & ~farther
    called = zero_flow.p_nearer > 0.5
    has_clear, has_other = (_any_in_cells(mask) for mask in (farther, not_farther))
    clear = has_clear & ~has_other
    alarmed = clear & (zero_flow.cells > UNKNOWN)
    counted = {
        "nearer": answering & nearer,
        "nearer_called": answering & nearer & called,
        "farther": answering & farther,
        "farther_called": answering & farther & called,
        "true_nearer": nearer,
        "true_pixels": nearer | farther,
        "evidence": zero_flow.supported & (nearer | farther),
        "evidence_nearer_called": zero_flow.supported & nearer & called,
        "clear_cells": clear,
        "clear_cells_alarmed": alarmed,
    }
    return Counter({name: int(np.count_nonzero(mask)) for name, mask in counted.items()})


def _any_in_cells(mask: MaskArray) -> MaskArray:
    """Which cells of the map have a pixel of a mask on the flow grid, shape (32, 32)."""
    share = cv2.resize(mask.astype(np.float32), (CELLS, CELLS), interpolation=cv2.INTER_AREA)
    return share > 1e-6


def map_summary(counts: Mapping[str, int], frames: int) -> dict[str, Any]:
    """Ratios of summed counts over ``frames`` maps; None where there was nothing to count."""
    right = counts["nearer_called"] + counts["farther"] - counts["farther_called"]
    asked = counts["nearer"] + counts["farther"]
    return {
        "frames": frames,
        "pixels_asked": asked,
        "pixels_asked_share": _share(asked, counts["true_pixels"]),
        "sign_right": _share(right, asked),
        "precision": _share(counts["nearer_called"], counts["nearer_called"] + counts["farther_called"]),
        "recall": _share(counts["nearer_called"], counts["nearer"]),
        "false_alarms": _share(counts["farther_called"], counts["farther"]),
        "found": _share(counts["nearer_called"], counts["true_nearer"]),
        "evidence_share": _share(counts["evidence"], counts["true_pixels"]),
        "found_of_evidence": _share(counts["evidence_nearer_called"], counts["true_nearer"]),
        "clear_cells_alarmed": _share(counts["clear_cells_alarmed"], counts["clear_cells"]),
        "margin": DEPTH_MARGIN,
    }


def _share(part: int, whole: int) -> float | None:
    return part / whole if whole else None


def distance_summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any] | None:
    """Errors of the distance over the rows of ``estimates.csv`` that have an estimate and truth; None without any.

    A first estimate is nothing but a guess; it counts as soon as its std is below 15 % of it, while the target is seen.
    """
    judged = [row for row in rows if row["distance_true_m"] is not None and row["distance_m"] is not None]
    known = [row for row in judged if row["visible"] and row["distance_std_m"] < KNOWN_STD * row["distance_m"]]
    if not judged:
        return None
    if not known:
        return {"frames": 0, "frames_with_truth": len(judged)}
    estimate, std, truth = (
        np.array([row[name] for row in known]) for name in ("distance_m", "distance_std_m", "distance_true_m")
    )
    error = estimate - truth
    return {
        "frames": len(known),
        "frames_with_truth": len(judged),
        "median_true_m": float(np.median(truth)),
        "median_abs_error_m": float(np.median(np.abs(error))),
        "median_relative_error": float(np.median(error / truth)),
        "rms_error_m": math.sqrt(float(np.mean(error**2))),
        "median_std_m": float(np.median(std)),
        "median_abs_error_over_std": float(np.median(np.abs(error) / std)),
        "p95_abs_error_over_std": float(np.percentile(np.abs(error) / std, 95.0)),
        "last_error_m": float(error[-1]),
    }


def mask_summary(overlaps: FloatArray) -> dict[str, Any]:
    """Agreement of the target's pixels with the recording's masks, intersection over union, shape (n,)."""
    return {
        "frames": len(overlaps),
        "median_overlap": float(np.median(overlaps)),
        "least_overlap": float(overlaps.min()),
        "frames_above_half": float(np.mean(overlaps > 0.5)),
    }
