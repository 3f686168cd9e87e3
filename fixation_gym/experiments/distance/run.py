"""The paper's Fig. 3b: error of the distance against distance, fixating and only translating. Resumable."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np

from fixation_gym.evaluation.files import write_csv
from fixation_gym.evaluation.workers import kept, prepare_process
from fixation_gym.experiments.distance.config import DistanceConfig
from fixation_gym.experiments.distance.sequence import CENTROID_STD_PX, INTRINSICS, Condition, Motion
from fixation_gym.experiments.distance.statistics import format_table, summarise
from fixation_gym.experiments.runner import Cell, Experiment

SEQUENCES_FILE, CSV_FILE, FIGURE_FILE = "sequences.jsonl", "rows.csv", "distance.png"

Key = tuple[float, float, str, int]
"""(distance, amplitude, motion, seed)"""


def cell_key(cell: Cell) -> Key:
    """What tells the results of one run apart."""
    return cell["distance_m"], cell["amplitude_m"], cell["motion"], cell["seed"]


EXPERIMENT = Experiment(
    command="distance",
    unit="sequence",
    file=SEQUENCES_FILE,
    outputs=(CSV_FILE, FIGURE_FILE),
    key=cell_key,
    content=frozenset({"distance_m", "amplitude_m", "motion", "seed", "results"}),
    note=lambda value: f"{value['distance_m']:g} m, {value['motion']}",
    table=format_table,
)


def run_cell(cell: Cell) -> dict[str, Any]:
    """Record the sequence of a cell and run every estimator on it; returns the cell with ``results`` and ``bounds``."""
    prepare_process()
    from fixation_gym.envs.sensor_noise import SENSOR_NOISE
    from fixation_gym.experiments.distance.estimates import assess, bounds, methods, run
    from fixation_gym.experiments.distance.recording import record
    from fixation_gym.experiments.distance.rig import PrintRig

    condition = Condition(**{name: value for name, value in cell.items() if name != "noise"})
    noise = SENSOR_NOISE[cell["noise"]]
    motion = get_args(Motion).index(condition.motion)
    lengths = round(condition.distance_m * 1e4), round(condition.amplitude_m * 1e4)
    rng = np.random.default_rng([condition.seed, *lengths, motion])
    recording = record(kept(PrintRig, close=PrintRig.close), condition, noise, rng)
    results = [assess(recording, method, run(recording, method)) for method in methods(recording, noise)]
    errors = [frame.gaze_error_px for frame in recording.frames[recording.measured]]
    value = {
        **cell,
        "results": results,
        "bounds": bounds(recording, CENTROID_STD_PX / INTRINSICS.fx),
        "gaze_error_px": float(np.mean(errors)),
        "visible": float(np.mean([frame.seen.segmentation.visible for frame in recording.frames])),
    }
    return cast("dict[str, Any]", _without_nan(value))


def _without_nan(value: Any) -> Any:
    """None for numbers that are not finite, as JSON needs it."""
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def measure(config: DistanceConfig, out: Path, run: Callable[[Cell], dict[str, Any]] = run_cell) -> dict[str, Any]:
    """Run the sequences that a folder does not have yet, and write summary, CSV and figure; see ``runner``."""
    from fixation_gym.experiments.distance.figure import draw_figure

    settings = {"seed": config.seed, "noise": config.noise}
    with EXPERIMENT.opened(out, settings, run, config.workers) as folder:
        statistics = summarise(folder.results(config.cells()), config.noise)
        about = {"quick": config.quick, "seeds": config.repetitions, "sequences_resumed": folder.resumed}
        summary = folder.write_summary(statistics, about)
        write_csv(out / CSV_FILE, summary["rows"])
        draw_figure(out / FIGURE_FILE, summary["rows"])
    return summary
