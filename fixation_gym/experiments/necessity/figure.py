"""The figure of the necessity experiment: how often each straight fast way succeeds, one map per scenario."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fixation_gym.experiments.necessity.statistics import ALL
from fixation_gym.experiments.necessity.ways import (
    ELEVATIONS,
    FROM_VIEW,
    STRAIGHT,
    VIEW_ELEVATIONS,
    VIEW_OFFSETS,
    azimuth_cells,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import SubFigure

Rates = Mapping[str, float]
"""Share of successes by the name of the way."""
_COLUMNS = 2
_MAP = "cividis"
_HIGHEST = 0.6
"""Rate from which on the colour is the last one."""
_LIGHT = 0.6
"""Share of ``_HIGHEST`` from which on text is black."""


def draw_figure(path: Path, rows: Sequence[Mapping[str, Any]], table: Sequence[Mapping[str, Any]]) -> None:
    """Write the figure: per scenario the fixed azimuths, and beside them those that count from the first view."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    panels = [row for row in table if row["scenario"] != ALL]
    columns = min(_COLUMNS, len(panels))
    lines = -(-len(panels) // columns)
    figure = Figure(figsize=(4.0 * columns, 2.2 * lines + 0.8), layout="constrained")
    FigureCanvasAgg(figure)
    above, below = figure.subfigures(2, 1, squeeze=False, height_ratios=(2.2 * lines, 0.8)).ravel()
    for part, row in zip(above.subfigures(lines, columns, squeeze=False).ravel(), panels, strict=False):
        here = [item for item in rows if item["scenario"] == row["scenario"] and item["chosen_on_n"]]
        _draw_panel(part, row, {item["member"]: item["chosen_on_k"] / item["chosen_on_n"] for item in here})
    scale = ScalarMappable(Normalize(0.0, 100.0 * _HIGHEST), _MAP)
    bar = below.colorbar(scale, cax=below.add_axes((0.25, 0.6, 0.5, 0.2)), orientation="horizontal", extend="max")
    bar.set_label("success without collision of straight fast ways, % of the even seeds", fontsize=8)
    bar.ax.tick_params(labelsize=7)
    figure.savefig(path, dpi=100)


def _draw_panel(part: SubFigure, row: Mapping[str, Any], rates: Rates) -> None:
    """One scenario: two maps side by side."""
    best = f"best way {100.0 * row['best_rate']:.0f} % [{100.0 * row['best_low']:.0f}, {100.0 * row['best_high']:.0f}]"
    part.suptitle(f"{row['scenario']}: {best}", fontsize=9)
    fixed, relative = part.subplots(1, 2, width_ratios=(3, 2))
    for axis in (fixed, relative):
        axis.set_yticks(range(len(ELEVATIONS)), [str(elevation) for elevation in ELEVATIONS])
        axis.set_ylim(-0.5, len(ELEVATIONS) - 0.5)
        axis.tick_params(labelsize=7, length=2)
        axis.set_facecolor("0.85")
    relative.set_yticklabels([])
    fixed.set_ylabel("elevation, deg", fontsize=8)
    ways = iter(STRAIGHT)
    for line, elevation in enumerate(ELEVATIONS):
        for low, high in azimuth_cells(elevation):
            _draw_cell(fixed, line, low, high, rates.get(next(ways).name))
    fixed.set(xlim=(-72.0, 132.0), xticks=range(-60, 121, 30))
    fixed.set_xlabel("azimuth, deg", fontsize=8)
    offsets = iter(FROM_VIEW)
    for elevation in VIEW_ELEVATIONS:
        for index in range(len(VIEW_OFFSETS)):
            _draw_cell(relative, ELEVATIONS.index(elevation), index - 0.5, index + 0.5, rates.get(next(offsets).name))
    relative.set(xlim=(-0.5, len(VIEW_OFFSETS) - 0.5))
    relative.set_xticks(range(len(VIEW_OFFSETS)), [f"{offset:+d}" if offset else "0" for offset in VIEW_OFFSETS])
    relative.set_xlabel("against first view", fontsize=8)


def _draw_cell(axis: Axes, line: int, low: float, high: float, rate: float | None) -> None:
    """One way: its rate as colour and in percent; an empty frame if it was not tried."""
    from matplotlib import colormaps
    from matplotlib.patches import Rectangle

    share = None if rate is None else min(rate / _HIGHEST, 1.0)
    colour = "none" if share is None else colormaps[_MAP](share)
    axis.add_patch(Rectangle((low, line - 0.5), high - low, 1.0, facecolor=colour, edgecolor="white", linewidth=0.6))
    if rate is not None and share is not None:
        ink = "black" if share > _LIGHT else "white"
        place = 0.5 * (low + high), line
        axis.text(*place, f"{100.0 * rate:.0f}", color=ink, fontsize=7, ha="center", va="center_baseline")
