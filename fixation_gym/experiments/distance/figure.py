"""The figure of the distance experiment: error against distance, as the paper's Fig. 3b."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fixation_gym.experiments.distance.statistics import PAPER

_LINES = (
    ("fixation", "hard", "warped", "tab:orange", "-", "^", "fixating: twist and flow, as in the paper"),
    ("translation", "free", "warped", "tab:orange", ":", "v", "translating: twist and flow"),
    ("fixation", "pose", None, "tab:blue", "-", "o", "fixating: poses and centroids"),
    ("translation", "pose", None, "tab:blue", ":", "s", "translating: poses and centroids"),
)
"""Motion, estimator, flow, colour, line style, marker and label."""
_BOUNDS = (("hard", "tab:orange"), ("pose", "tab:blue"))
"""Estimator whose bound is drawn while fixating, and its colour."""
_ERROR_TICKS = (0.1, 1.0, 10.0, 100.0, 1000.0)
_TICKS = (0.066, 0.15, 0.31, 0.66, 1.4, 3.1, 6.6)


def draw_figure(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Write the figure: one panel per amplitude, log-log, with Cramer-Rao bounds and the paper's two numbers."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    amplitudes = sorted({row["amplitude_m"] for row in rows})
    figure = Figure(figsize=(4.6 * len(amplitudes), 5.2), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(1, len(amplitudes), squeeze=False, sharex=True, sharey=True)[0]
    for axis, amplitude in zip(axes, amplitudes, strict=True):
        _draw_panel(axis, [row for row in rows if row["amplitude_m"] == amplitude and row["hand_eye_error"]])
        axis.set_title(f"circle of {100 * amplitude:g} cm radius")
    axes[0].set_ylabel("error of the distance, mm")
    figure.legend(*axes[-1].get_legend_handles_labels(), fontsize=10, ncols=2, loc="outside lower center")
    figure.savefig(path, dpi=110)


def _draw_panel(axis: Any, rows: Sequence[dict[str, Any]]) -> None:
    """Lines of one amplitude: the median over the runs of their mean absolute error."""
    for motion, estimator, flow, colour, style, marker, label in _LINES:
        chosen = [row for row in rows if (row["motion"], row["estimator"], row["flow"]) == (motion, estimator, flow)]
        points = [(row["distance_m"], 1e3 * row["mae_median_m"]) for row in chosen if row["mae_median_m"]]
        if points:
            axis.plot(*zip(*points, strict=True), style, color=colour, marker=marker, markersize=5, label=label)
    for estimator, colour in _BOUNDS:
        chosen = [row for row in rows if (row["motion"], row["estimator"]) == ("fixation", estimator)]
        # The mean absolute value of a normal error is sqrt(2 / pi) times its standard deviation.
        points = sorted({(row["distance_m"], 1e3 * 0.798 * row["bound_std_m"]) for row in chosen if row["bound_std_m"]})
        if points:
            label = "Cramer-Rao bounds while fixating" if estimator == "pose" else None
            axis.plot(*zip(*points, strict=True), "--", color=colour, alpha=0.5, linewidth=3.0, label=label)
    paper = [1e3 * error for error in PAPER.values()]
    axis.plot(list(PAPER), paper, "k*", markersize=13, label="the paper, fixating: less than this")
    axis.set(xscale="log", yscale="log", xlabel="distance, m")
    axis.set_xticks(_TICKS, [f"{tick:g}" for tick in _TICKS])
    axis.set_yticks(_ERROR_TICKS, [f"{tick:g}" for tick in _ERROR_TICKS])
    axis.minorticks_off()
    axis.grid(True, alpha=0.3)
