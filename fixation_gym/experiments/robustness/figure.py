"""The figure of the robustness experiment: map and servo by degradation, with what is wanted of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WANTED_PRECISION = 0.8
"""Share of the clean precision."""
WANTED_CLEAR = 0.01
"""Clear cells in alarm, at most."""
_COLOUR = "tab:blue"


def draw_figure(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write a PNG: front precision, clear cells in alarm, success without collision."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 1.4 + 0.32 * len(rows)), layout="constrained")
    FigureCanvasAgg(figure)
    names = [row["meaning"] for row in rows]
    precision, clear, free = figure.subplots(1, 3, sharey=True)
    _bars(precision, names, [row["precision_of_clean"] for row in rows], "front precision, of the clean one")
    precision.axvline(WANTED_PRECISION, color="0.3", linestyle="--", linewidth=1)
    _bars(clear, names, [_percent(row["clear_alarmed"]) for row in rows], "clear cells in alarm, %")
    clear.axvline(100.0 * WANTED_CLEAR, color="0.3", linestyle="--", linewidth=1)
    shares = [row["free"] / row["episodes"] for row in rows]
    _bars(free, names, [100.0 * share for share in shares], "success without collision, %, with 95 % interval")
    for place, (row, share) in enumerate(zip(rows, shares, strict=True)):
        free.plot([100.0 * row["free_low"], 100.0 * row["free_high"]], [place, place], color="0.2", linewidth=1)
        free.plot([100.0 * share], [place], "o", color="0.2", markersize=3)
    free.set_xlim(0.0, 100.0)
    figure.savefig(path, dpi=110)


def _bars(axis: Axes, names: Sequence[str], values: Sequence[float | None], label: str) -> None:
    axis.barh(names, [0.0 if value is None else value for value in values], color=_COLOUR, alpha=0.6)
    axis.set_xlabel(label, fontsize=8)
    axis.tick_params(labelsize=8)
    axis.grid(True, axis="x", alpha=0.25)
    if not axis.yaxis_inverted():
        axis.invert_yaxis()


def _percent(value: float | None) -> float | None:
    return None if value is None else 100.0 * value
