"""The figure of the distance experiment: error against distance, as the paper's Fig. 3b."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fixation_gym.experiments.distance.statistics import PAPER

_ROBOT, _LENS = "mae_median_m", "mae_median_lens_m"
_LINES = (
    ("fixation", "pose", None, _ROBOT, "tab:red", "-", "o", "fixation, poses and centroid"),
    ("translation", "pose", None, _ROBOT, "tab:blue", "-", "s", "translation, poses and centroid"),
    ("fixation", "pose", None, _LENS, "tab:red", ":", "o", "the same, truth from the lens: fixation"),
    ("translation", "pose", None, _LENS, "tab:blue", ":", "s", "the same, truth from the lens: translation"),
    ("fixation", "hard", "warped", _ROBOT, "tab:red", "--", "^", "fixation, hard constraint (gradient flow, warped)"),
    ("fixation", "hard", "dis", _ROBOT, "tab:orange", "--", "v", "fixation, hard constraint (DIS flow)"),
    (
        "translation",
        "free",
        "warped",
        _ROBOT,
        "tab:blue",
        "--",
        "^",
        "translation, no constraint (gradient flow, warped)",
    ),
    ("translation", "free", "dis", _ROBOT, "tab:cyan", "--", "v", "translation, no constraint (DIS flow)"),
)
"""Motion, estimator, flow, field of the rows, colour, line style, marker and label."""
_TICKS = (0.066, 0.15, 0.31, 0.66, 1.4, 3.1, 6.6)


def draw_figure(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Write the figure: one panel per amplitude, log-log, with Cramer-Rao bound and the paper's two numbers."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    amplitudes = sorted({row["amplitude_m"] for row in rows})
    figure = Figure(figsize=(6.5 * len(amplitudes), 6.8), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(1, len(amplitudes), squeeze=False, sharex=True, sharey=True)[0]
    for axis, amplitude in zip(axes, amplitudes, strict=True):
        here = [row for row in rows if row["amplitude_m"] == amplitude and row["hand_eye_error"]]
        for motion, estimator, flow, field, colour, style, marker, label in _LINES:
            chosen = [r for r in here if (r["motion"], r["estimator"], r["flow"]) == (motion, estimator, flow)]
            points = [(r["distance_m"], r[field]) for r in chosen if r[field]]
            if points:
                axis.plot(*zip(*points, strict=True), style, color=colour, marker=marker, markersize=4, label=label)
        for estimator, style in (("pose", "-"), ("hard", "-.")):
            chosen = [r for r in here if (r["motion"], r["estimator"]) == ("fixation", estimator)]
            # The mean absolute value of a normal error is sqrt(2 / pi) times its standard deviation.
            points = sorted({(r["distance_m"], 0.798 * r["bound_std_m"]) for r in chosen if r["bound_std_m"]})
            if points:
                label = f"Cramer-Rao bound, {'poses' if estimator == 'pose' else 'twist and flow'}"
                axis.plot(*zip(*points, strict=True), style, color="0.4", linewidth=1.0, label=label)
        axis.plot(list(PAPER), list(PAPER.values()), "k*", markersize=12, label="paper, fixation (upper limits)")
        axis.set(xscale="log", yscale="log", xlabel="distance, m", title=f"circle of {100 * amplitude:g} cm radius")
        axis.set_xticks(_TICKS, [f"{tick:g}" for tick in _TICKS])
        axis.minorticks_off()
        axis.grid(True, alpha=0.3)
    axes[0].set_ylabel("mean absolute error of the distance (median over the runs), m")
    figure.legend(*axes[-1].get_legend_handles_labels(), fontsize=8, ncols=3, loc="outside lower center")
    figure.savefig(path, dpi=110)
