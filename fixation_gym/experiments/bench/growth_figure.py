"""Four charts of how costs grow, one question each."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

_BLUE, _ORANGE = "#0072b2", "#d55e00"


def draw_growth(path: Path, found: dict[str, Any]) -> None:
    """Write a PNG with a chart each for image size, obstacles, length of the episode, and workers."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 6.4), layout="constrained")
    FigureCanvasAgg(figure)
    sizes, obstacles, episode, workers = figure.subplots(2, 2).ravel()
    _draw_sizes(sizes, found["sizes"])
    _draw_obstacles(obstacles, found["obstacles"])
    _draw_episode(episode, found["episode"])
    _draw_workers(workers, found["workers"])
    for axis in (sizes, obstacles, episode, workers):
        axis.set_ylim(bottom=0.0)
        axis.grid(True, alpha=0.3)
    for axis in (obstacles, episode, workers):
        axis.legend(fontsize=9)
    figure.savefig(path, dpi=110)


def _draw_sizes(axis: Any, rows: Sequence[dict[str, Any]]) -> None:
    sizes = [[int(part) for part in row["name"].split("x")] if "x" in row["name"] else [0, 0] for row in rows]
    pixels = [width * height / 1000.0 for width, height in sizes]
    axis.plot(pixels, [row["ms_median"] for row in rows], "o-", color=_BLUE)
    axis.set(xlabel="pixels of the image, thousands (0: no image)", ylabel="ms per step", title="Size of the image")


def _draw_obstacles(axis: Any, rows: Sequence[dict[str, Any]]) -> None:
    for size, colour, marker in (("no image", _BLUE, "o"), ("128x128", _ORANGE, "s")):
        shown = [row for row in rows if row["name"].endswith(size)]
        numbers = [int(row["name"].split()[0]) for row in shown]
        axis.plot(numbers, [row["ms_median"] for row in shown], marker + "-", color=colour, label=size)
    axis.set(xlabel="obstacles in the scene", ylabel="ms per step", title="Obstacles")


def _draw_episode(axis: Any, rows: Sequence[dict[str, Any]]) -> None:
    steps = [row["step"] for row in rows]
    axis.plot(steps, [row["act_ms"] for row in rows], "o-", color=_BLUE, label="servo: one action")
    axis.plot(steps, [row["step_ms"] for row in rows], "s-", color=_ORANGE, label="environment: one step")
    axis.set(xlabel="step of the episode", ylabel="ms, image of 320x240", title="Length of the episode")


def _draw_workers(axis: Any, rows: Sequence[dict[str, Any]]) -> None:
    for kind, colour, marker in (("gym.make_vec", _BLUE, "o"), ("SubprocVecEnv", _ORANGE, "s")):
        shown = [row for row in rows if row["kind"] == kind]
        numbers, speeds = [row["workers"] for row in shown], [row["steps_per_s"] for row in shown]
        axis.plot(numbers, speeds, marker + "-", color=colour, label=kind)
    axis.set_xticks(sorted({row["workers"] for row in rows}))
    axis.set(xlabel="environments, one process each", ylabel="steps per second, all together", title="Workers")
