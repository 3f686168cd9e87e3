"""The paper's Fig. 4: what is in front of the fixated object, in four hard scenes, against the truth. Resumable."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fixation_gym.evaluation.config import SEED_BLOCK
from fixation_gym.evaluation.files import write_csv
from fixation_gym.evaluation.workers import kept, prepare_process
from fixation_gym.experiments.runner import Cell, Experiment
from fixation_gym.experiments.scenarios.config import Key, ScenariosConfig
from fixation_gym.experiments.scenarios.scenes import CLEAR, MATERIAL_SCENES, SCENES, VARIANTS
from fixation_gym.experiments.scenarios.statistics import format_table, rows_of, summarise

if TYPE_CHECKING:
    from fixation_gym.experiments.scenarios.rig import ScenarioRig

RUNS_FILE, CSV_FILE, FIGURE_FILE = "runs.jsonl", "rows.csv", "scenarios.png"
VIDEO_FILES = {scene: f"{scene}.mp4" for scene in (*SCENES, *MATERIAL_SCENES)}


def cell_key(cell: Cell) -> Key:
    """What tells the results of one run apart."""
    return cell["scene"], cell["variant"], cell["seed"]


EXPERIMENT = Experiment(
    command="scenarios",
    unit="run",
    file=RUNS_FILE,
    outputs=(CSV_FILE, FIGURE_FILE, *VIDEO_FILES.values()),
    key=cell_key,
    content=frozenset({"scene", "variant", "seed", "frames"}),
    note=lambda value: f"{value['scene']}, {value['variant']}",
    table=format_table,
)


def instance_rng(cell: Cell) -> np.random.Generator:
    """The generator of an instance and of its noise."""
    scene = (*SCENES, CLEAR, *MATERIAL_SCENES).index(cell["scene"])
    return np.random.default_rng([cell["seed"], scene, VARIANTS.index(cell["variant"]), 4])


def rig_for(noise: str, renderer: str) -> ScenarioRig:
    """The rig of this process with some sensor noise, whose pictures somebody makes."""
    prepare_process()
    from fixation_gym.envs.sensor_noise import SENSOR_NOISE
    from fixation_gym.experiments.scenarios.rig import ScenarioRig

    return kept(ScenarioRig, SENSOR_NOISE[noise], renderer, close=ScenarioRig.close)


def run_cell(cell: Cell) -> dict[str, Any]:
    """Look at the instance of a cell; returns the cell with its scores."""
    rig = rig_for(cell["noise"], cell["renderer"])
    from fixation_gym.experiments.scenarios.scoring_run import run_clear, run_scene

    rng = instance_rng(cell)
    if cell["scene"] == CLEAR:
        return {**cell, **run_clear(rig, cell["variant"], rng)}
    return {**cell, **run_scene(rig, cell["scene"], cell["variant"], rng)}


def measure(config: ScenariosConfig, out: Path, run: Callable[[Cell], dict[str, Any]] = run_cell) -> dict[str, Any]:
    """Make the runs that a folder does not have yet, and write summary, CSV, figure and videos; see ``runner``."""
    cells, settings = config.cells(), {"seed": config.seed, "noise": config.noise}
    if config.renderer != "mujoco":
        settings["renderer"] = config.renderer
    with EXPERIMENT.opened(out, settings, run, config.workers) as folder:
        statistics = summarise(folder.results(cells.values()))
        about = {"quick": config.quick, "instances": config.repetitions, "runs_resumed": folder.resumed}
        summary = folder.write_summary(statistics, about)
        write_csv(out / CSV_FILE, rows_of(summary["scenes"]))
        if config.film:
            from fixation_gym.experiments.scenarios.pictures import film

            seed = config.seed * SEED_BLOCK
            examples = {scene: {"scene": scene, "variant": VARIANTS[0], "seed": seed} for scene in config.scenes}
            videos = {scene: out / VIDEO_FILES[scene] for scene in config.scenes}
            generators = {scene: instance_rng(cell) for scene, cell in examples.items()}
            film(rig_for(config.noise, config.renderer), generators, videos, out / FIGURE_FILE)
    return summary
