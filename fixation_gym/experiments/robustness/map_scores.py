"""How right a map is, against what is truly nearer than the target. Pure.

A cell is in alarm if "in front" prevails in it. ``precision``: of the cells in alarm, the share in which anything is
truly nearer. ``recall``: of the known cells most of which is clearly nearer, the share in alarm. ``clear_alarmed``: of
the cells in which nothing is nearer, the share in alarm.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np

from fixation_gym.perception.zero_flow.evidence_map import UNKNOWN, ZeroFlowSettings
from fixation_gym.types import ImageArray

MARGIN = ZeroFlowSettings().depth_margin
"""What is clearly nearer has an inverse depth that is larger by this share at least."""
_MOST = 128


def cell_counts(cells: ImageArray, nearer: ImageArray, clearly_nearer: ImageArray) -> Counter[str]:
    """Counts of cells of one map; sums over maps make ``map_scores``.

    Args:
        cells: the map, shape (32, 32).
        nearer: share of each cell that is truly nearer than the target, times 255, shape (32, 32).
        clearly_nearer: the same for what is nearer by ``MARGIN``.
    """
    alarm, known = cells > UNKNOWN, cells != UNKNOWN
    front, clear = clearly_nearer >= _MOST, nearer == 0
    counted = {
        "cells": np.ones_like(alarm),
        "known": known,
        "alarm": alarm,
        "alarm_right": alarm & ~clear,
        "front_known": front & known,
        "front_alarmed": front & alarm,
        "clear": clear,
        "clear_alarmed": clear & alarm,
    }
    return Counter({name: int(np.count_nonzero(mask)) for name, mask in counted.items()})


def map_scores(counts: Mapping[str, int]) -> dict[str, float | None]:
    """Ratios of summed counts; None where there was nothing to count."""
    return {
        "precision": _share(counts, "alarm_right", "alarm"),
        "recall": _share(counts, "front_alarmed", "front_known"),
        "clear_alarmed": _share(counts, "clear_alarmed", "clear"),
        "known": _share(counts, "known", "cells"),
    }


def _share(counts: Mapping[str, int], part: str, whole: str) -> float | None:
    return counts[part] / counts[whole] if counts.get(whole) else None
