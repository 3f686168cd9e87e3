"""The figure of a comparison: learning curves over environment steps and over wall time, the servo as a line."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from fixation_gym.evaluation.files import write_file

_AXES = (("env_steps", 1e-3, "control steps, thousands"), ("wall_min", 1.0, "training, minutes"))
_ROWS = (("success", "success"), ("collision_free", "success without collision"))
_SERVO = "servo"


def draw_comparison(summary: dict[str, Any], path: Path) -> None:
    """Draw what ``compare`` found: interquartile means over seeds, bands are 95 % intervals.

    Curves are from the evaluations during training, the servo's line from its test on the training scenario; without
    such a test there is no line.
    """
    figure = Figure(figsize=(9.0, 6.5), layout="constrained")
    axes = figure.subplots(2, 2, sharex="col", sharey=True)
    scenario = summary["training"]["scenario"]
    servo = [row for row in summary["table"] if row["config"] == _SERVO and row["scenario"] == scenario]
    for row, (measure, title) in enumerate(_ROWS):
        for column, (key, unit, x_label) in enumerate(_AXES):
            ax = axes[row, column]
            for number, config in enumerate(summary["configs"]):
                points = [point for point in summary["curves"] if point["config"] == config]
                x = [unit * point[key] for point in points]
                seeds = points[0]["seeds"] if points else 0
                label = f"{config}, {seeds} {'seed' if seeds == 1 else 'seeds'}"
                ax.plot(x, [point[measure] for point in points], color=f"C{number}", marker=".", label=label)
                low, high = ([point[f"{measure}_{end}"] for point in points] for end in ("low", "high"))
                ax.fill_between(x, low, high, color=f"C{number}", alpha=0.2, linewidth=0)
            for line in servo:
                ax.axhline(line[measure], color="0.3", linestyle="--", label=_SERVO)
            ax.set_ylim(0.0, 1.02)
            ax.grid(alpha=0.3)
            if column == 0:
                ax.set_ylabel(title)
            if row == 1:
                ax.set_xlabel(x_label)
    axes[0, 0].legend(loc="lower right")
    figure.suptitle(f"Training on {scenario}: interquartile means over seeds, 95 % bootstrap intervals")
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=120)
    write_file(path, buffer.getvalue())
