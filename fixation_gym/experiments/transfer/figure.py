"""The figure of the transfer experiment: success over severity, one panel per axis, one line per policy."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fixation_gym.evaluation.files import write_file
from fixation_gym.experiments.transfer.shifts import NONE, SEVERITIES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLUMNS = 4
_LEVELS = (NONE, *SEVERITIES)


def draw_figure(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Write a PNG: success without collision by axis and severity, with 95 % intervals."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    axes = [name for name in dict.fromkeys(row["axis"] for row in rows) if name != NONE] or [NONE]
    lines = math.ceil(len(axes) / _COLUMNS)
    figure = Figure(figsize=(12.0, 0.8 + 2.3 * lines), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(lines, _COLUMNS, sharey=True, squeeze=False).ravel()
    for panel, axis in zip(panels, axes, strict=False):
        _draw_axis(panel, axis, rows)
    for panel in panels[len(axes) :]:
        panel.set_visible(False)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=max(len(labels), 1), fontsize=9)
    figure.supylabel("success without collision, %", fontsize=9)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110)
    write_file(path, buffer.getvalue())


def _draw_axis(panel: Axes, axis: str, rows: Sequence[dict[str, Any]]) -> None:
    names = list(dict.fromkeys(row["config"] for row in rows))
    for number, name in enumerate(names):
        points = [row for row in rows if row["config"] == name and row["axis"] in (NONE, axis)]
        points.sort(key=lambda row: _LEVELS.index(row["severity"]))
        # Beside each other, so that intervals can be seen.
        x = [_LEVELS.index(row["severity"]) + 0.08 * (number - 0.5 * (len(names) - 1)) for row in points]
        rate, low, high = (
            [100.0 * row[key] for row in points]
            for key in ("collision_free", "collision_free_low", "collision_free_high")
        )
        seeds = points[0]["seeds"]
        label = f"{name}, {seeds} seeds" if seeds > 1 else f"{name}, one run"
        panel.plot(x, rate, color=f"C{number}", marker="o", markersize=3, label=label)
        panel.vlines(x, low, high, color=f"C{number}", linewidth=1, alpha=0.7)
    panel.set_title(axis.replace("_", " "), fontsize=9)
    panel.set_xticks(range(len(_LEVELS)), _LEVELS, fontsize=8)
    panel.set_ylim(-3.0, 103.0)
    panel.tick_params(labelsize=8)
    panel.grid(alpha=0.3)
