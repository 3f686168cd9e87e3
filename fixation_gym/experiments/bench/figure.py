"""Bar chart of the benchmark."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any


def draw_figure(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Write a PNG with a bar per row: median, and a line to the 95th percentile; logarithmic, ms."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    names = [row["name"] for row in rows][::-1]
    medians = [row["ms_median"] for row in rows][::-1]
    reach = [max(0.0, row["ms_p95"] - row["ms_median"]) for row in rows][::-1]
    peers = ("lift", "fetch", "panda-gym", "DIS", "Farneback")
    colours = ["0.65" if name.startswith(peers) else "tab:red" for name in names]
    figure = Figure(figsize=(9.0, 0.8 + 0.24 * len(rows)), layout="constrained")
    FigureCanvasAgg(figure)
    axis = figure.subplots()
    axis.barh(names, medians, xerr=[[0.0] * len(rows), reach], color=colours, ecolor="0.3", capsize=2)
    for place, median in enumerate(medians):
        axis.text(median * 0.94, place, f"{median:.3g}", va="center", ha="right", fontsize=7, color="white")
    axis.set(xscale="log", xlabel="ms per call: median, line to the 95th percentile (grey: others)")
    axis.grid(True, axis="x", which="both", alpha=0.25)
    axis.tick_params(axis="y", labelsize=8)
    axis.margins(y=0.01)
    figure.savefig(path, dpi=110)
