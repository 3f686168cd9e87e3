"""Traces that are made up: phases with durations, and what is true in them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fixation_gym.evaluation.trace import SceneBox, Trace

STEP_S = 0.04
TARGET = SceneBox("target", (0.03, 0.03, 0.03), 0.2)
OBSTACLE = SceneBox("opaque", (0.03, 0.045, 0.10), 0.5)


def make_trace(
    phases: Sequence[tuple[str, int]],
    distance: Sequence[float] = (0.45, 0.18),
    rise: Sequence[float] = (0.0,),
    collided_from: int | None = None,
    error_m: float = 0.002,
    obstacle_shift: Sequence[float] = (0.0,),
) -> Trace:
    """A trace through (phase, number of steps) in order; distance, rise and obstacle shift are spread over all rows."""
    names = tuple(name for name, steps in phases for _ in range(steps))
    n = len(names)

    def spread(values: Sequence[float]) -> np.ndarray:
        return np.interp(np.linspace(0.0, 1.0, n), np.linspace(0.0, 1.0, len(values)), values)

    true = spread(distance)
    things = np.zeros((n, 2, 3))
    things[:, 0] = [0.55, 0.0, -0.08]
    things[:, 0, 2] += spread(rise)
    things[:, 1] = [0.45, 0.1, -0.012]
    things[:, 1, 1] += spread(obstacle_shift)
    tool = things[:, 0] + true[:, None] * np.array([-0.5, 0.3, 0.8])
    return Trace(
        time_s=STEP_S * np.arange(n),
        phases=names,
        distance_m=true + error_m,
        distance_std_m=np.full(n, 0.003),
        distance_true_m=true,
        clearance_m=np.full(n, 0.08),
        gripper_width_m=np.full(n, 0.08),
        camera_m=tool + np.array([-0.05, 0.0, 0.05]),
        tool_m=tool,
        things_m=things,
        collided=np.arange(n) >= (n if collided_from is None else collided_from),
        boxes=(TARGET, OBSTACLE),
    )
