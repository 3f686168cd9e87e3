"""What a shutter makes of a moving camera: every row is the mean of what was there while it was exposed."""

from __future__ import annotations

import numpy as np

from fixation_gym.types import FloatArray


def exposed_rows(middle_s: float, readout_s: float, rows: int) -> FloatArray:
    """Middle of the exposure of every row, shape (rows,), s, where ``middle_s`` is that of the middle row."""
    return middle_s + readout_s * (np.arange(rows) - 0.5 * (rows - 1)) / max(rows - 1, 1)


def row_weights(instants: FloatArray, rows_s: FloatArray, exposure_s: float) -> FloatArray:
    """Share of each of some instants in each row: between instants the picture is taken to change linearly.

    Args:
        instants: equally spaced, shape (k,), s; they reach from the first exposed moment to the last.
        rows_s: middle of the exposure of every row, shape (rows,), s.
        exposure_s: duration of it; 0: each row shows one moment.

    Returns:
        Shape (k, rows); the sum over instants is 1.
    """
    if len(instants) == 1:
        return np.ones((1, len(rows_s)))
    spacing = float(instants[1] - instants[0])
    place = (rows_s[None, :] - instants[:, None]) / spacing
    if exposure_s < 1e-9:
        return np.clip(1.0 - np.abs(place), 0.0, None)
    half = 0.5 * exposure_s / spacing
    return (_hat_integral(place + half) - _hat_integral(place - half)) / (2.0 * half)


def _hat_integral(x: FloatArray) -> FloatArray:
    """Integral up to x of the hat that is 1 at 0 and 0 from -1 and 1 on."""
    x = np.clip(x, -1.0, 1.0)
    return 0.5 + x - 0.5 * x * np.abs(x)
