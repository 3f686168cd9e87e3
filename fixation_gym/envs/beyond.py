"""Where an obstacle stands that is to bar a way: beyond it, seen from the free one. Compiled."""

from __future__ import annotations

import math

from fixation_gym.compiled import compiled
from fixation_gym.control.box_pairs import Triple
from fixation_gym.types import FloatArray


@compiled
def beyond(free: FloatArray, way: FloatArray, angle: float) -> Triple:
    """The direction that lies beyond ``way``, seen from the free one, by ``angle`` rad, but above the table.

    What stands there bars the way without being in the free one: the hand is wide.
    """
    along = way[0] * free[0] + way[1] * free[1] + way[2] * free[2]
    across = (way[0] - along * free[0], way[1] - along * free[1], way[2] - along * free[2])
    total = math.acos(min(max(along, -1.0), 1.0)) + angle
    share, aside = math.cos(total), math.sin(total) / max(_hypot(across), 1e-9)
    x, y = share * free[0] + aside * across[0], share * free[1] + aside * across[1]
    z = max(share * free[2] + aside * across[2], 0.05)
    length = _hypot((x, y, z))
    return x / length, y / length, z / length


@compiled
def _hypot(vector: Triple) -> float:
    """The length to the last bit, like ``math.hypot``, which numba knows for two numbers only."""
    total, rest = 0.0, 0.0
    for value in vector:
        square, error = _square(value)
        larger = total + square
        rest += error + (total - (larger - (larger - total))) + (square - (larger - total))
        total = larger
    length = math.sqrt(total + rest)
    if length == 0.0:
        return 0.0
    square, error = _square(length)
    return length + (total - square - error + rest) / (2.0 * length)


@compiled
def _square(value: float) -> tuple[float, float]:
    """Square of a number, and the error of its rounding (Dekker)."""
    large = value * 134217729.0  # 2 ** 27 + 1
    high = large - (large - value)
    low, square = value - high, value * value
    return square, high * high - square + 2.0 * high * low + low * low
