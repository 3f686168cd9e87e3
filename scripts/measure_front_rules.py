"""What each front rule says of obstacles by their material, on the same pictures: missed, false surfaces, false alarms.

python scripts/measure_front_rules.py --renderer mujoco --episodes 10 --out out/front_rules

The servo acts; every rule has a perception of its own that sees the same observations. Truth is the first surface that
the simulator renders on the grid of the flow. Finished episodes are kept, and the same command goes on.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import tyro

import fixation_gym  # noqa: F401  # registers the environments
from fixation_gym.envs.truth_view import Truth, TruthView
from fixation_gym.evaluation.config import episode_seeds
from fixation_gym.evaluation.storage import EPISODES_FILE
from fixation_gym.evaluation.workers import kept, prepare_process
from fixation_gym.experiments.runner import Cell, Experiment
from fixation_gym.experiments.scenarios.statistics import bootstrap_ratio
from fixation_gym.perception import Perception, PerceptionSettings, ZeroFlowSettings
from fixation_gym.perception.percept import Percept
from fixation_gym.perception.zero_flow.depth_rules import depth_rule, motion_stereo, plane_parallax
from fixation_gym.perception.zero_flow.front_rule import dot_product_rule, exact_rule
from fixation_gym.perception.zero_flow.zero_flow import ZeroFlow
from fixation_gym.robots import ROBOT
from fixation_gym.types import MaskArray, Observation
from fixation_policies.catalogue import make_policy

RULES = {
    "exact": exact_rule,
    "dot_product": dot_product_rule,
    "depth": depth_rule,
    "motion_stereo": motion_stereo,
    "plane_parallax": plane_parallax,
}
MATERIALS = ("see-through", "mirror face", "chrome", "opaque")
MEASURES = {
    "missed": ("missed", "front"),
    "called behind": ("behind", "front"),
    "false surface": ("elsewhere", "measured"),
    "false alarm": ("alarm", "free"),
}
"""Of the pixels of obstacles in front: without a call in front, and called behind; of those with a depth: more than
10 % off the first surface; of the pixels of table and room that are not nearer than the target: called in front."""
_MARGIN, _CENTRED, _STRIDE = 0.10, 0.06, 4


@dataclass(frozen=True)
class Config:
    """What to look at."""

    out: Path
    renderer: str = "mujoco"
    scenarios: tuple[str, ...] = ("translucent", "mirror", "glass", "chrome", "two_mirrors")
    episodes: int = 10
    seed: int = 22022
    seconds: float = 3.0
    """Of every episode, from its beginning."""


def materials(truth: Truth, model: Any) -> dict[str, MaskArray]:
    """Pixels of obstacles by the material of their first surface, and of all that is no obstacle and no target."""
    owners = np.array([*(model.body(body).name for body in model.geom_bodyid), ""])[truth.geom]
    obstacle = np.char.startswith(owners, "obstacle")
    names = np.array([*("" if i < 0 else model.mat(i).name for i in model.geom_matid), ""])[truth.geom]
    clear = np.append(model.geom_rgba[:, 3] < 1.0, False)[truth.geom]
    mirror, metal = np.isfinite(truth.image_depth), np.isin(names, ("chrome", "brushed"))
    kinds = (obstacle & clear & ~mirror, obstacle & mirror, obstacle & metal, obstacle & ~clear & ~mirror & ~metal)
    return dict(zip(MATERIALS, kinds, strict=True)) | {"free": ~obstacle & (owners != "target")}


def counts(test: ZeroFlow, truth: Truth, kinds: dict[str, MaskArray], target_m: float) -> Counter[str]:
    """Counts of pixels in one picture; keys are "material: what"."""
    called = test.supported & (test.p_nearer > 0.5)
    measured = np.isfinite(test.inverse_depth)
    with np.errstate(invalid="ignore"):
        elsewhere = measured & (np.abs(test.inverse_depth * truth.depth - 1.0) > _MARGIN)
    result: Counter[str] = Counter()
    for kind in MATERIALS:
        front = kinds[kind] & (truth.depth < (1.0 - _MARGIN) * target_m)
        masks = {
            "front": front,
            "missed": front & ~called,
            "behind": front & test.supported & ~called,
            "measured": front & measured,
            "elsewhere": front & elsewhere,
        }
        result.update({f"{kind}: {name}": int(np.count_nonzero(mask)) for name, mask in masks.items()})
    free = kinds["free"] & (truth.depth > target_m)
    result.update({"free: free": int(np.count_nonzero(free)), "free: alarm": int(np.count_nonzero(free & called))})
    return result


def look(env: gymnasium.Env, policy: Any, seed: int, seconds: float) -> dict[str, Counter[str]]:
    """Counts of an episode's first seconds by each rule."""
    base: Any = env.unwrapped
    table = ROBOT.workspace.table_height
    settings = {name: PerceptionSettings(zero_flow=ZeroFlowSettings(rule=rule)) for name, rule in RULES.items()}
    eyes = {name: Perception(base.intrinsics, own, support_height_m=table) for name, own in settings.items()}
    totals = {name: Counter[str]() for name in RULES}
    obs, info = env.reset(seed=seed)
    policy.reset(seed)
    grid = eyes["exact"].flow_intrinsics
    with closing(TruthView(base.model, grid)) as view:
        before: tuple[Any, float] | None = None
        for step in range(round(seconds * base.control_frequency)):
            percepts: dict[str, Percept] = {name: eye.update(Observation.from_dict(obs)) for name, eye in eyes.items()}
            now = base.picture_qpos.copy(), float(info["distance_true_m"])
            exact = percepts["exact"]
            centred = float(np.linalg.norm(exact.fixation.centroid)) < _CENTRED
            if before is not None and centred and exact.zfc.fixated_inverse_depth > 0.0 and step % _STRIDE == 0:
                truth = view.look(before[0])
                kinds = materials(truth, base.model)
                for name, percept in percepts.items():
                    totals[name] += counts(percept.zfc, truth, kinds, before[1])
            before = now
            obs, _, terminated, _, info = env.step(policy.act(obs))
            if terminated:
                break
    return totals


EXPERIMENT = Experiment(
    command="measure_front_rules",
    unit="episode",
    file=EPISODES_FILE,
    outputs=(),
    key=lambda cell: (cell["scenario"], cell["seed"]),
    content=frozenset({"scenario", "seed", "rules"}),
    note=lambda value: value["scenario"],
    table=lambda summary: as_table(summary["episodes"]),
)


def run_cell(cell: Cell) -> dict[str, Any]:
    """Look at the episode of a cell."""
    env, policy = kept(_world, cell["scenario"], cell["renderer"], close=lambda world: world[0].close())
    return {**cell, "rules": look(env, policy, cell["seed"], cell["seconds"])}


def _world(scenario: str, renderer: str) -> tuple[gymnasium.Env, Any]:
    prepare_process()
    env = gymnasium.make("FixationPick-v0", scenario=scenario, renderer=renderer, depth_camera=True)
    return env, make_policy("servo", env)


def main(config: Config) -> None:
    """Measure and print; other settings have a folder of their own."""
    settings = {"renderer": config.renderer, "seconds": config.seconds}
    seeds = episode_seeds(config.seed, config.episodes)
    cells = [{"scenario": scenario, "seed": seed, **settings} for scenario in config.scenarios for seed in seeds]
    out = config.out / f"{config.renderer}-{config.seconds:g}s"
    with EXPERIMENT.opened(out, settings, run_cell, 1) as folder:
        summary = folder.write_summary({"episodes": folder.results(cells)}, {})
    EXPERIMENT.show(summary, out)


def as_table(results: Sequence[Mapping[str, Any]]) -> str:
    """Shares of pixels by material, measure and rule, with 95 % intervals drawn over episodes."""
    lines = ["| material | pixels | measure | " + " | ".join(RULES) + " |", "|---" * (3 + len(RULES)) + "|"]
    for kind in (*MATERIALS, "free"):
        for measure, (part, whole) in MEASURES.items():
            if (measure == "false alarm") == (kind == "free"):
                pairs = {
                    rule: [
                        (item["rules"][rule].get(f"{kind}: {part}", 0), item["rules"][rule].get(f"{kind}: {whole}", 0))
                        for item in results
                    ]
                    for rule in RULES
                }
                pixels = int(sum(pair[1] for pair in pairs["exact"]))
                shares = " | ".join(in_words(*bootstrap_ratio(pairs[rule])) for rule in RULES)
                lines.append(f"| {kind} | {pixels} | {measure} | {shares} |")
    return "\n".join(lines)


def in_words(share: float | None, interval: list[float] | None) -> str:
    """A share with its interval; a dash where there was nothing to count."""
    return "-" if share is None or interval is None else f"{share:.2f} [{interval[0]:.2f}, {interval[1]:.2f}]"


if __name__ == "__main__":
    main(tyro.cli(Config, description=__doc__))
