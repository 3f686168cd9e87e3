"""Which ways obstacles bar, and which of them bar enough together: the compiled part of ``barriers.py``."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fixation_gym.compiled import compiled
from fixation_gym.control.box_tests import any_pair_meets, may_meet, meets, spheres_around
from fixation_gym.envs.drafts import Indices
from fixation_gym.types import FloatArray, MaskArray


class Quota(NamedTuple):
    """How many ways may stay open in the end."""

    groups: MaskArray
    """Groups of ways, shape (n, ways)."""
    most_open: FloatArray
    """Largest share of each group that is not barred, shape (n,)."""


@compiled
def could_bar(
    target: FloatArray,
    hands: FloatArray,
    boxes: FloatArray,
    ends: Indices,
    smaller: FloatArray,
    groups: MaskArray,
    most_open: FloatArray,
) -> bool:
    """Whether all drafts together would bar enough; most do not, which is soon known.

    Args:
        target: in base, shape (3,), m.
        hands: axes of the hand on all ways, shape (n, 3, 3).
        boxes: of all drafts, as in ``box_tests.packed``.
        ends: those of draft i are the boxes from ``ends[i]`` to ``ends[i + 1]``.
        smaller: what a hand sweeps that is smaller than the real one, as in ``box_tests.packed_hand``.
        groups: of ways, as in ``Quota``.
        most_open: largest share of each group that is not barred.
    """
    sizes, counts = np.zeros(len(groups), np.int64), np.zeros(len(groups), np.int64)
    for group in range(len(groups)):
        for way in range(len(hands)):
            sizes[group] += groups[group, way]
    spheres, latest, met = spheres_around(boxes, ends), 0, False
    for way in range(len(hands) - 1, -1, -1):  # those from above come last, and are the hardest to bar
        for turn in range(len(spheres)):
            index = (latest + turn) % len(spheres)  # what bars a way probably bars the next one, too
            met = may_meet(target, hands, way, spheres, index, smaller) and meets(
                target, hands, way, boxes, ends[index], ends[index + 1], smaller
            )
            if met:
                latest = index
                break
        if met:
            continue
        for group in range(len(sizes)):
            counts[group] += groups[group, way]
            if counts[group] / max(sizes[group], 1) > most_open[group]:
                return False
    return True


@compiled
def barred_ways(
    target: FloatArray, hands: FloatArray, boxes: FloatArray, ends: Indices, smaller: FloatArray
) -> MaskArray:
    """Ways that each of n drafts bars, shape (n, ways); arguments as above."""
    barred, spheres = np.zeros((len(ends) - 1, len(hands)), np.bool_), spheres_around(boxes, ends)
    for index in range(len(spheres)):
        for way in range(len(hands)):
            if may_meet(target, hands, way, spheres, index, smaller):
                barred[index, way] = meets(target, hands, way, boxes, ends[index], ends[index + 1], smaller)
    return barred


@compiled
def apart_from(boxes: FloatArray, ends: Indices, others: FloatArray, gap: float) -> MaskArray:
    """Which drafts, the boxes from ``ends[i]`` to ``ends[i + 1]``, keep about ``gap`` m away from other boxes."""
    apart = np.ones(len(ends) - 1, np.bool_)
    for index in range(len(apart)):
        apart[index] = not any_pair_meets(boxes, ends[index], ends[index + 1], others, gap)
    return apart


@compiled
def is_barred(open_ways: MaskArray, sight: int, quota: Quota) -> bool:
    """Whether the first line of sight, the way with index ``sight``, and enough of all other ways are barred."""
    if open_ways[sight]:
        return False
    for group in range(len(quota.groups)):
        size = max(np.sum(quota.groups[group]), 1)
        if np.sum(quota.groups[group] & open_ways) / size > quota.most_open[group]:
            return False
    return True


@compiled
def covering(
    first: int,
    others: MaskArray,
    barred: MaskArray,
    clashes: MaskArray,
    sight: int,
    quota: Quota,
    counts: tuple[int, int],
) -> Indices:
    """Indices of ``first`` and of those others that bar enough with it, those that bar most taken first.

    None if they do not; ``counts`` are the smallest and the largest number of them.
    """
    least, most = counts
    chosen, open_ways = [first], ~barred[first]
    left = others & ~clashes[first]
    while len(chosen) < least or not is_barred(open_ways, sight, quota):
        best, gain = 0, -1
        for index in range(len(left)):
            gained = np.sum(barred[index] & open_ways) if left[index] else -1
            if gained > gain:
                best, gain = index, gained
        if len(chosen) == most or gain < 0 or (gain == 0 and len(chosen) >= least):
            return np.zeros(0, np.int64)
        chosen.append(best)
        open_ways &= ~barred[best]
        left &= ~clashes[best]
        left[best] = False
    return np.array(chosen)
