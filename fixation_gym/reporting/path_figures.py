"""Figures of single episodes: paths in the scene from above and from the side, and distance over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fixation_gym.evaluation.failures import Failure
from fixation_gym.evaluation.trace import SceneBox, Trace
from fixation_gym.reporting.figures import new_figure, png
from fixation_gym.types import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.transforms import Transform

_BOX_COLOURS = {
    "target": "#d62728",
    "opaque": "#8c6d46",
    "translucent": "#7fb8c9",
    "mirror": "#9aa5b1",
    "wire": "#b0b0b0",
    "glass": "#9fd3c7",
    "chrome": "#7d8792",
    "lacquer": "#b58bc0",
    "plastic": "#cfc9a5",
}
_MOVED_M = 0.005
"""Of a box that ends so far from where it stood, the way is drawn; and the box, too, unless it toppled. m."""
_PHASE_SHADES = {
    "search": "#f2e9d8",
    "fixate": "#e3edf7",
    "approach": "#e4f3e6",
    "grasp": "#fbe0d6",
    "close": "#f6cdbd",
    "lift": "#efe1f5",
    "recover": "#eeeeee",
}
_MARGIN_M = 0.03


def path_figure(paths: Sequence[tuple[str, str, Trace]]) -> bytes:
    """Paths of (label, colour, trace) of one scene, from above and from the side."""
    figure = new_figure(10.5, 4.0)
    above, side = figure.subplots(1, 2)
    draw_paths(above, side, paths)
    above.legend(fontsize=8, frameon=False, loc="best")
    return png(figure)


def episode_figure(label: str, colour: str, trace: Trace, failure: Failure | None) -> bytes:
    """One episode: paths from above and from the side, distance and std over time with phases."""
    figure = new_figure(11.5, 3.0)
    above, side, time = figure.subplots(1, 3, width_ratios=(1.0, 1.15, 1.6))
    draw_paths(above, side, [(label, colour, trace)], None if failure is None else failure.time_s)
    draw_distance(time, colour, trace, failure)
    return png(figure, dpi=90)


def draw_paths(above: Axes, side: Axes, paths: Sequence[tuple[str, str, Trace]], moment: float | None = None) -> None:
    """Draw the scene of the first trace, and of all the path of tool (line) and camera (dots).

    Args:
        above: gets base y to the left and x up, as seen from behind the robot.
        side: gets the vertical plane through the target that holds the first line of sight.
        paths: label, colour and trace; all of the same scene.
        moment: time to mark on the last path, s.
    """
    first = paths[0][2]
    target = first.things_m[0, 0]
    sight = first.camera_m[0, :2] - target[:2]
    sight = sight / max(float(np.linalg.norm(sight)), 1e-9)
    for index, box in enumerate(first.boxes):
        start, end = first.things_m[0, index], first.things_m[-1, index]
        _draw_box(above, side, box, start, target, sight, moved=False)
        if np.linalg.norm(end - start) > _MOVED_M and box.name != "target":
            if abs(end[2] - start[2]) < _MOVED_M:  # it still stands
                _draw_box(above, side, box, end, target, sight, moved=True)
            way, colour = first.things_m[:, index], _BOX_COLOURS.get(box.name, "#999999")
            above.plot(*_from_above(way).T, "--", color=colour, linewidth=1.0)
            side.plot(*_from_side(way, target, sight).T, "--", color=colour, linewidth=1.0)

    for index, (label, colour, trace) in enumerate(paths):
        row = None if moment is None else min(int(np.searchsorted(trace.time_s, moment - 1e-3)), len(trace.time_s) - 1)
        for axis, flat in ((above, _from_above), (side, lambda points: _from_side(points, target, sight))):
            camera, tool = flat(trace.camera_m), flat(trace.tool_m)
            axis.plot(*camera.T, ":", color=colour, linewidth=0.9, alpha=0.7)
            wide = index == 0 and len(paths) > 1  # the same path of another policy must not hide the first
            width = 2.8 if wide else 1.5
            axis.plot(*tool.T, color=colour, linewidth=width, label=label if axis is above else None)
            axis.plot(*tool[0], "o", color=colour, markersize=4, markerfacecolor="white")
            axis.plot(*tool[-1], "s", color=colour, markersize=4)
            if row is not None:
                axis.plot(*tool[row], "X", color="black", markersize=8, zorder=5)
    table = target[2] - first.boxes[0].half_extent[2]
    side.axhline(table, color="0.5", linewidth=0.8)
    above.invert_xaxis()
    above.set(xlabel="y, m", ylabel="x, m", title="from above")
    side.set(xlabel="along the first line of sight, m", ylabel="height z, m", title="from the side")
    for axis in (above, side):
        axis.set_aspect("equal", adjustable="datalim")
        axis.title.set_fontsize(9)
        axis.tick_params(labelsize=8)
        axis.grid(True, alpha=0.2)
        axis.margins(_MARGIN_M)


def draw_distance(axis: Axes, colour: str, trace: Trace, failure: Failure | None) -> None:
    """Estimated distance with two stds, true distance and clearance over time; phases shaded."""
    for phase, start, end in phase_spans(trace):
        axis.axvspan(start, end, color=_PHASE_SHADES.get(phase, "#f5f5f5"), linewidth=0)
        if end - start > 0.07 * trace.time_s[-1]:
            axis.text(0.5 * (start + end), 0.985, phase, fontsize=7, ha="center", va="top", transform=_across(axis))
    low, high = (100.0 * (trace.distance_m + sign * 2.0 * trace.distance_std_m) for sign in (-1.0, 1.0))
    axis.fill_between(trace.time_s, low, high, color=colour, alpha=0.25, linewidth=0)
    axis.plot(trace.time_s, 100.0 * trace.distance_m, color=colour, linewidth=1.3, label="estimate ± 2 std")
    axis.plot(trace.time_s, 100.0 * trace.distance_true_m, "--", color="black", linewidth=1.0, label="true distance")
    axis.plot(trace.time_s, 100.0 * trace.clearance_m, color="#8c6d46", linewidth=0.9, label="clearance")
    if failure is not None and failure.time_s is not None:
        axis.axvline(failure.time_s, color="black", linewidth=1.0)
        side = "right" if failure.time_s > 0.6 * trace.time_s[-1] else "left"
        text = f" {failure.kind.value} "
        axis.text(failure.time_s, 0.91, text, fontsize=8, va="top", ha=side, transform=_across(axis))
    axis.set(xlim=(0.0, trace.time_s[-1]), ylim=(-2.0, 70.0), xlabel="time, s", ylabel="cm")
    axis.tick_params(labelsize=8)
    axis.legend(fontsize=7, loc="upper right", bbox_to_anchor=(1.0, 0.83), framealpha=0.7)


def phase_spans(trace: Trace) -> list[tuple[str, float, float]]:
    """(phase, start, end) of every uninterrupted phase, s; without phases, none."""
    spans: list[tuple[str, float, float]] = []
    start = 0
    for row in range(1, len(trace.phases) + 1):
        if row == len(trace.phases) or trace.phases[row] != trace.phases[start]:
            if trace.phases[start]:
                end = float(trace.time_s[min(row, len(trace.phases) - 1)])
                spans.append((trace.phases[start], float(trace.time_s[start]), end))
            start = row
    return spans


def footprint(box: SceneBox, centre: FloatArray) -> FloatArray:
    """Corners of a box seen from above, shape (4, 2), in base, m."""
    c, s = np.cos(box.yaw), np.sin(box.yaw)
    x, y = box.half_extent[:2]
    corners = np.array([[x, y], [-x, y], [-x, -y], [x, -y]])
    return centre[:2] + corners @ np.array([[c, s], [-s, c]])


def _draw_box(
    above: Axes, side: Axes, box: SceneBox, centre: FloatArray, target: FloatArray, sight: FloatArray, moved: bool
) -> None:
    from matplotlib.patches import Polygon

    colour = _BOX_COLOURS.get(box.name, "#999999")
    face, style, alpha = ("none", "--", 0.9) if moved else (colour, "-", 0.55)
    corners = footprint(box, centre)
    along = (corners - target[:2]) @ sight
    bottom, top = centre[2] - box.half_extent[2], centre[2] + box.half_extent[2]
    left, right = float(along.min()), float(along.max())
    upright = np.array([[left, bottom], [right, bottom], [right, top], [left, top]])
    for axis, outline in ((above, _from_above(np.column_stack([corners, np.zeros(4)]))), (side, upright)):
        axis.add_patch(Polygon(outline, facecolor=face, edgecolor=colour, linestyle=style, alpha=alpha))
        axis.update_datalim(outline)


def _from_above(points: FloatArray) -> FloatArray:
    return points[:, [1, 0]]


def _from_side(points: FloatArray, target: FloatArray, sight: FloatArray) -> FloatArray:
    return np.column_stack([(points[:, :2] - target[:2]) @ sight, points[:, 2]])


def _across(axis: Axes) -> Transform:
    """Seconds to the right, shares of the height upwards."""
    return axis.get_xaxis_transform()
