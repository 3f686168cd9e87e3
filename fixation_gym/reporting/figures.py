"""Figures over many episodes, as PNG bytes. White ground: the page inverts it where the reader's screen is dark."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fixation_gym.evaluation.statistics import wilson_interval
from fixation_gym.reporting.digest import GRASP_TIMES, START_TIMES, PolicyRecord
from fixation_gym.types import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7F7F7F", "#000000")
"""Of the policies in turn; Okabe and Ito's, which most eyes tell apart."""
_LEAST_EPISODES = 3
"""A median over time is drawn only where so many episodes have a value, or all of fewer."""


def colour_of(index: int) -> str:
    """Colour of the policy with this place."""
    return COLOURS[index % len(COLOURS)]


def new_figure(width: float, height: float) -> Figure:
    """An empty figure, inches; drawn without a display."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def png(figure: Figure, dpi: int = 110) -> bytes:
    """A figure as PNG."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi, metadata={"Software": None})
    return buffer.getvalue()


def success_figure(records: Sequence[PolicyRecord], scenarios: Sequence[str]) -> bytes:
    """Rates over scenarios with Wilson intervals: filled for collision-free success, hollow for success."""
    width = min(0.8, 0.22 * len(records))
    figure = new_figure(max(8.0, 2.2 + len(scenarios) * (0.5 + 0.28 * len(records))), 3.6)
    axis = figure.subplots()
    places = np.arange(len(scenarios))
    for index, record in enumerate(records):
        offset = width * ((index + 0.5) / len(records) - 0.5)
        for hollow in (True, False):
            _rates(axis, places + offset, record, scenarios, colour_of(index), hollow)
        axis.plot([], [], "o", color=colour_of(index), label=record.label)
    for place in places[1:]:
        axis.axvline(place - 0.5, color="0.9", linewidth=0.8, zorder=0)
    axis.set(ylim=(-3, 103), ylabel="%", xlim=(-0.5, len(scenarios) - 0.5))
    axis.set_xticks(places, scenarios, rotation=20 if len(scenarios) > 6 else 0)
    _clean(axis)
    axis.plot([], [], "o", color="0.4", label="collision-free success")
    axis.plot([], [], "o", color="0.4", markerfacecolor="white", label="success")
    figure.legend(loc="outside upper left", ncols=min(4, len(records) + 2), frameon=False, fontsize=9)
    return png(figure)


def error_figure(records: Sequence[PolicyRecord]) -> bytes | None:
    """Median distance error, its quartiles, and median stated std over time; None without traces."""
    known = [(index, record) for index, record in enumerate(records) if any(e.curves for e in record.episodes)]
    if not known:
        return None
    figure = new_figure(10.5, 3.8)
    axes = figure.subplots(1, 2, sharey=True)
    for index, record in known:
        curves = [episode.curves for episode in record.episodes if episode.curves is not None]
        _errors(axes[0], START_TIMES, np.stack([c.since_start for c in curves]), colour_of(index), record.label)
        _errors(axes[1], GRASP_TIMES, np.stack([c.before_grasp for c in curves]), colour_of(index), None)
    axes[0].set(xlabel="time since the start, s", ylabel="distance, mm", yscale="log", xlim=(0, START_TIMES[-1]))
    axes[1].set(xlabel="time before the last grasp, s", xlim=(GRASP_TIMES[0], 0))
    for axis in axes:
        _clean(axis)
        axis.grid(True, which="major", alpha=0.25)
        axis.yaxis.set_major_formatter("{x:g}")
    axes[0].plot([], [], color="0.3", label="median |error|, band: quartiles")
    axes[0].plot([], [], "--", color="0.3", label="median stated std")
    figure.legend(loc="outside upper left", ncols=min(4, len(known) + 2), frameon=False, fontsize=9)
    return png(figure)


def _rates(
    axis: Axes, places: FloatArray, record: PolicyRecord, scenarios: Sequence[str], colour: str, hollow: bool
) -> None:
    for place, scenario in zip(places, scenarios, strict=True):
        results = record.of(scenario)
        if not results:
            continue
        wins = sum(result.success if hollow else result.collision_free_success for result in results)
        rate = 100.0 * wins / len(results)
        low, high = (100.0 * bound for bound in wilson_interval(wins, len(results)))
        shift = 0.035 if hollow else -0.035
        axis.plot([place + shift] * 2, [low, high], color=colour, linewidth=1.2, alpha=0.45 if hollow else 1.0)
        face = "white" if hollow else colour
        axis.plot(place + shift, rate, "o", color=colour, markerfacecolor=face, markersize=6)


def _errors(axis: Axes, times: FloatArray, curves: FloatArray, colour: str, label: str | None) -> None:
    """Draw statistics over episodes; ``curves`` has shape (episodes, 2, times), m."""
    enough = np.isfinite(curves[:, 0]).sum(axis=0) >= min(_LEAST_EPISODES, len(curves))
    if not enough.any():
        return
    error, std = (1000.0 * curves[:, row][:, enough] for row in (0, 1))
    low, middle, high = np.nanpercentile(error, [25, 50, 75], axis=0)
    axis.fill_between(times[enough], low, high, color=colour, alpha=0.15, linewidth=0)
    axis.plot(times[enough], middle, color=colour, linewidth=1.6, label=label)
    axis.plot(times[enough], np.nanmedian(std, axis=0), "--", color=colour, linewidth=1.2)


def _clean(axis: Axes) -> None:
    axis.spines[["top", "right"]].set_visible(False)
    axis.grid(True, axis="y", alpha=0.25)
