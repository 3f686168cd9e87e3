"""Dot chart of the benchmark: bars would begin at an arbitrary place of a logarithmic axis."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

_PEERS = ("lift", "fetch", "panda-gym", "DIS", "Farneback")
"""How names of what others made begin."""


def draw_figure(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Write a PNG with a dot per row, the median, and a line to the 95th percentile; logarithmic, ms."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 1.2 + 0.26 * len(rows)), layout="constrained")
    FigureCanvasAgg(figure)
    axis = figure.subplots()
    for own, colour, marker, label in ((True, "tab:blue", "o", "this project"), (False, "0.45", "s", "others")):
        shown = [(place, row) for place, row in enumerate(rows) if row["name"].startswith(_PEERS) is not own]
        places, medians = [place for place, _ in shown], [row["ms_median"] for _, row in shown]
        ends = [max(row["ms_p95"], row["ms_median"]) for _, row in shown]
        axis.hlines(places, medians, ends, color=colour, linewidth=1.5)
        axis.plot(medians, places, marker, color=colour, markersize=6, label=label)
        for place, median, end in zip(places, medians, ends, strict=True):
            axis.text(end * 1.1, place, f"{median:.3g}", va="center", fontsize=9, color=colour)
    axis.set_yticks(range(len(rows)), [row["name"] for row in rows], fontsize=9)
    axis.set(xscale="log", xlabel="ms per call: median, and a line to the 95th percentile")
    axis.set_ylim(len(rows) - 0.4, -0.6)  # the first row on top
    axis.grid(True, axis="x", alpha=0.3)
    axis.margins(x=0.12)
    axis.legend(loc="upper right", fontsize=10)
    figure.savefig(path, dpi=110)
