"""Draw the figures of the pages Idea and Theory: ``python scripts/theory_figures.py [FOLDER]``.

They are computed with the package's own geometry, so a wrong sign there would show here.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from fixation_gym.geometry.rigid import inverse, transform
from fixation_gym.types import FloatArray

DOCS = Path(__file__).parent.parent / "docs"
Z_F = 0.45
"""Distance of the fixated object in the drawings, m."""
RED, ORANGE, BLUE, GREY = "#b2182b", "#e08214", "#2166ac", "0.45"
"""Colours that the colour-blind can tell apart; shapes differ, too."""
THINGS = {
    "in front": (np.array([0.07, 0.0, 0.27]), "s", ORANGE),
    "fixated": (np.array([0.0, 0.0, Z_F]), "o", RED),
    "behind": (np.array([-0.07, 0.0, 0.68]), "^", BLUE),
}
"""Place (x right, z forward) with the camera in the middle of its path, m."""


def camera_on_arc(angle: float) -> FloatArray:
    """Pose, shape (4, 4), of a camera that goes around the fixated point and looks at it; angle 0: in the middle."""
    cos, sin = np.cos(angle), np.sin(angle)
    pose = np.eye(4)
    pose[:3, :3] = [[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]]
    pose[:3, 3] = [Z_F * sin, 0.0, Z_F * (1.0 - cos)]
    return pose


def idea() -> Figure:
    """What a camera sees of three things while it moves to the right and holds the middle one still."""
    figure = Figure(figsize=(9.0, 4.6), layout="constrained")
    above, images = figure.subplots(1, 2, width_ratios=(1.0, 1.15))
    poses = [camera_on_arc(angle) for angle in (-0.32, 0.32)]
    arc = np.array([camera_on_arc(angle)[:3, 3] for angle in np.linspace(-0.32, 0.32, 30)])
    above.plot(arc[:, 0], arc[:, 2], color=GREY, linewidth=1.5, zorder=1)
    above.annotate("", arc[-1, ::2], arc[-4, ::2], arrowprops={"arrowstyle": "-|>", "color": GREY})
    for pose, name in zip(poses, ("before", "after"), strict=True):
        corners = transform(pose, np.array([[-0.024, 0, -0.02], [0.024, 0, -0.02], [0, 0, 0.022]]))
        above.fill(corners[:, 0], corners[:, 2], color="0.25")
        above.plot(*np.array([pose[:3, 3], THINGS["fixated"][0]])[:, ::2].T, ":", color=RED, linewidth=1.2)
        above.text(pose[0, 3] * 1.05, -0.05, f"camera {name}", ha="center", va="top", fontsize=11)
    for name, (place, marker, colour) in THINGS.items():
        above.plot(place[0], place[2], marker, color=colour, markersize=15)
        above.text(place[0] + 0.035, place[2], name, color=colour, fontsize=12, va="center")
    above.text(0.11, 0.13, "rotation\nkeeps the gaze", fontsize=10, color=GREY, ha="left")
    above.set_title("from above: the camera moves and turns", fontsize=12)
    above.set(xlim=(-0.3, 0.3), ylim=(-0.1, 0.76), aspect="equal")
    above.axis("off")
    for name, (place, marker, colour) in THINGS.items():
        seen = [transform(inverse(pose), place) for pose in poses]
        start, end = (point[0] / point[2] for point in seen)
        height = {"in front": -0.55, "fixated": 0.0, "behind": 0.55}[name]
        images.plot(start, height, marker, color=colour, markersize=15, alpha=0.35)
        images.plot(end, height, marker, color=colour, markersize=15)
        if name != "fixated":
            arrow = {"arrowstyle": "-|>", "color": colour, "linewidth": 2.0, "shrinkA": 9, "shrinkB": 9}
            images.annotate("", (end, height), (start, height), arrowprops=arrow)
    for text, height, colour in (
        ("behind: moves with the camera", 0.75, BLUE),
        ("fixated: stands still", 0.19, RED),
        ("in front: moves against the camera", -0.87, ORANGE),
    ):
        images.text(0.0, height, text, color=colour, ha="center", fontsize=12)
    images.set(xlim=(-0.75, 0.75), ylim=(-1.02, 1.02), xticks=[], yticks=[])
    images.set_title("in the image: sides are directions", fontsize=12)
    return figure


def zero_flow_surface() -> Figure:
    """Where the paper's rule and the exact test change sides, from above."""
    figure = Figure(figsize=(8.5, 5.2), layout="constrained")
    axis = figure.subplots()
    x = np.linspace(-0.7, 0.7, 201)
    depths = {0.0: Z_F / (1 + x**2), 0.5: Z_F * (1 - 0.5 * x) / (1 + x**2), 1.0: Z_F * (1 - x) / (1 + x**2)}
    seen = np.linspace(-0.52, 0.52, 101)
    circle = np.column_stack([seen * Z_F / (1 + seen**2), Z_F / (1 + seen**2)])
    axis.fill(*np.vstack([circle, Z_F * np.array([[0.52, 1.0], [-0.52, 1.0]])]).T, color=ORANGE, alpha=0.3)
    axis.axhline(Z_F, color=RED, linewidth=2.5)
    for ratio, style in ((0.0, "-"), (0.5, "--"), (1.0, ":")):
        axis.plot(x * depths[ratio], depths[ratio], style, color=BLUE, linewidth=2)
    for side in (-0.52, 0.52):
        axis.plot([0, side * 0.62], [0, 0.62], color=GREY, linewidth=1)
    axis.plot(0, 0, "^", color="0.2", markersize=13)
    axis.plot(0, Z_F, "o", color=RED, markersize=10)
    axis.text(0.41, Z_F + 0.012, "exact test: a plane", color=RED, fontsize=11, ha="right")
    axis.text(0.215, 0.33, "moves sideways", color=BLUE, fontsize=11)
    axis.text(-0.41, 0.40, "$v_Z = v_X / 2$", color=BLUE, fontsize=11)
    axis.text(-0.41, 0.555, "$v_Z = v_X$", color=BLUE, fontsize=11)
    note = {"color": "#8a5108", "fontsize": 11, "ha": "center", "va": "top"}
    line = {"arrowstyle": "-", "color": "#8a5108"}
    axis.annotate(
        "in front, but called\nbehind by the paper's rule", (-0.15, 0.43), (-0.05, 0.32), arrowprops=line, **note
    )
    axis.text(0.30, 0.615, "border of the image", color=GREY, fontsize=10, ha="right")
    axis.text(0.02, -0.005, "camera, moves to the right", fontsize=11, va="center")
    axis.set(xlim=(-0.42, 0.42), ylim=(-0.03, 0.66), aspect="equal")
    axis.set(xlabel="to the right, m", ylabel="forward, m")
    return figure


def distance_bounds() -> Figure:
    """Error of two filters against distance, with the bounds that the noise of the run allows."""
    with (DOCS / "results" / "distance.csv").open() as file:
        rows = [
            row
            for row in csv.DictReader(file)
            if (row["motion"], row["amplitude_m"], row["hand_eye_error"]) == ("fixation", "0.05", "True")
        ]
    figure = Figure(figsize=(8.0, 4.8), layout="constrained")
    axis = figure.subplots()
    _filter_lines(axis, rows, "hard", "warped", ORANGE, "^")
    _filter_lines(axis, rows, "pose", "", BLUE, "o")
    axis.text(0.9, 0.42, "paper's filter: twist and flow", color="#b35806", fontsize=12)
    axis.text(0.16, 0.1, "poses and centroids", color=BLUE, fontsize=12)
    axis.text(1.0, 0.03, "dashed: Cramér-Rao bound", color=GREY, fontsize=11)
    axis.plot([0.15, 2.0], [100 * 0.005 / 0.15, 100 * 0.13 / 2.0], "*", color="0.1", markersize=13)
    axis.text(0.16, 3.8, "paper: below 5 mm", fontsize=11)
    axis.text(2.0, 7.8, "paper: below 13 cm", fontsize=11, ha="center")
    ticks = (0.15, 0.31, 0.66, 1.4, 3.1, 6.6)
    axis.set(xscale="log", yscale="log", xlabel="distance, m", ylabel="error, % of the distance")
    axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.minorticks_off()
    axis.set_yticks((0.03, 0.1, 0.3, 1, 3, 10), ("0.03", "0.1", "0.3", "1", "3", "10"))
    axis.grid(alpha=0.3)
    return figure


def _filter_lines(axis: Any, rows: Any, estimator: str, flow: str, colour: str, marker: str) -> None:
    chosen = [row for row in rows if (row["estimator"], row["flow"]) == (estimator, flow)]
    distance, error, bound = (
        np.array([float(row[field]) for row in chosen]) for field in ("distance_m", "mae_median_m", "bound_std_m")
    )
    axis.plot(distance, 100 * error / distance, marker=marker, color=colour, linewidth=2)
    # The mean absolute value of a normal error is sqrt(2 / pi) times its standard deviation.
    mean_absolute = 100 * np.sqrt(2 / np.pi) * bound / distance
    axis.plot(distance, mean_absolute, "--", color=colour, linewidth=1.5)


def body() -> Figure:
    """Why the grasp needs a body: lines of sight touch it, the table carries it, the visible centre is not its own."""
    figure = Figure(figsize=(8.0, 4.4), layout="constrained")
    axis = figure.subplots()
    half = np.array([0.03, 0.045])
    centre = np.array([0.0, half[1]])
    axis.add_patch(Rectangle((-0.25, -0.02), 0.6, 0.02, color="0.8"))
    axis.add_patch(Rectangle((-half[0], 0.0), 2 * half[0], 2 * half[1], color=RED, alpha=0.75))
    corners = centre + half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for camera in (np.array([0.13, 0.27]), np.array([-0.19, 0.20])):
        angles = np.arctan2(*(corners - camera).T[::-1])
        for corner in corners[[int(np.argmin(angles % (2 * np.pi))), int(np.argmax(angles % (2 * np.pi)))]]:
            end = camera + 1.25 * (corner - camera)
            axis.plot(*np.array([camera, end]).T, color=BLUE, linewidth=1)
        axis.plot(*camera, "o", color="0.2", markersize=11)
    axis.plot(*centre, "+", color="white", markersize=14, markeredgewidth=2.5)
    axis.plot(0.008, 2 * half[1], "o", color="black", markersize=7)
    line = {"arrowstyle": "-", "color": "0.2"}
    for text, point, height in (
        ("centre of the body:\nwhere the grasp goes", centre, 0.035),
        ("middle of what is visible:\nwhere the gaze is held", np.array([0.008, 2 * half[1]]), 0.125),
    ):
        axis.annotate(text, tuple(point), (0.11, height), fontsize=11, va="center", arrowprops=line)
    axis.text(0.145, 0.268, "camera, later", fontsize=11, va="center")
    axis.text(-0.205, 0.2, "camera", fontsize=11, va="center", ha="right")
    axis.text(-0.24, -0.011, "table, at a known height", fontsize=10, va="center")
    axis.text(-0.24, 0.10, "tangents of\nthe outlines", fontsize=11, color=BLUE)
    axis.set(xlim=(-0.26, 0.28), ylim=(-0.025, 0.29), aspect="equal")
    axis.axis("off")
    return figure


FIGURES = {"idea": idea, "zero-flow-surface": zero_flow_surface, "distance-bounds": distance_bounds, "body": body}
"""Name of the file without .svg, and what draws it."""


def main(folder: Path) -> None:
    """Write all figures, the same bytes from the same code and data."""
    matplotlib.rcParams["svg.hashsalt"] = "fixation-gym"
    for name, draw in FIGURES.items():
        draw().savefig(folder / f"{name}.svg", metadata={"Date": None})


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS / "images")
