"""The figure of a replay: distance with its standard deviation over time, and its error where the truth is known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fixation_gym.replay.rows import Row
from fixation_gym.reporting.figures import COLOURS, new_figure, png
from fixation_gym.types import FloatArray


def draw_distance(rows: Sequence[Row]) -> bytes:
    """Draw the rows of ``estimates.csv``; returns a PNG."""
    times = _column(rows, "time_s")
    times = times - times[0]
    distance, std, truth = (_column(rows, name) for name in ("distance_m", "distance_std_m", "distance_true_m"))
    seen = _column(rows, "visible") > 0
    judged = bool(np.isfinite(truth).any())
    figure = new_figure(8.0, 5.4 if judged else 3.4)
    axes = figure.subplots(2 if judged else 1, 1, sharex=True, squeeze=False)[:, 0]
    colour = COLOURS[0]
    axes[0].fill_between(times, distance - std, distance + std, color=colour, alpha=0.25, linewidth=0, label="std")
    axes[0].plot(times, distance, "-", marker=".", markersize=3, color=colour, label="distance")
    axes[0].plot(times[~seen], distance[~seen], "x", color="0.5", markersize=4, label="target not seen")
    top = np.nanmax(np.where(std < distance, distance, np.nan), initial=0.0)
    top = max(top, float(np.nanmax(truth, initial=0.0)))
    axes[0].set(ylabel="distance, m", ylim=(0.0, 1.25 * top if top else None))
    if judged:
        axes[0].plot(times, truth, ".", color="black", markersize=4, label="truth")
        error, band = 1000.0 * (distance - truth), 1000.0 * std
        axes[1].fill_between(times, -band, band, color=colour, alpha=0.25, linewidth=0)
        axes[1].plot(times, error, "-", marker=".", markersize=3, color=colour)
        reach = 3.0 * float(np.nanmedian(np.maximum(np.abs(error), band)))
        axes[1].set(ylabel="error, mm", ylim=(-reach, reach))
        axes[1].axhline(0.0, color="0.5", linewidth=0.8)
    axes[-1].set(xlabel="time, s")
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
        axis.grid(True, axis="y", alpha=0.25)
    figure.legend(loc="outside upper left", ncols=4, frameon=False, fontsize=9)
    return png(figure)


def _column(rows: Sequence[Row], name: str) -> FloatArray:
    return np.array([np.nan if row[name] is None else row[name] for row in rows], np.float64)
