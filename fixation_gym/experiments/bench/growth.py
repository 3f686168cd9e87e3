"""How costs grow: with the size of the image, the number of obstacles, workers, the scenario, and the episode.

What belongs together is timed in turn, so that a machine whose speed drifts slows all of it alike.
"""

from __future__ import annotations

import dataclasses
import os
import time
from collections.abc import Iterator
from contextlib import closing
from itertools import count
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from fixation_gym.doctor import installed_versions
from fixation_gym.envs.config import SCENARIO_NAMES, resolve_scenario
from fixation_gym.evaluation.files import write_json
from fixation_gym.evaluation.storage import folder_lock, make_folder
from fixation_gym.experiments.bench.cases import ENDLESS, Size, label, make_perception, stepper
from fixation_gym.experiments.bench.first_use import first_use
from fixation_gym.experiments.bench.groups import Case, ProcessGroup
from fixation_gym.experiments.bench.growth_figure import draw_growth
from fixation_gym.experiments.bench.run import measure
from fixation_gym.experiments.bench.worker_speed import worker_rows
from fixation_policies.servo.servo_policy import ServoPolicy

GROWTH_FILE, GROWTH_FIGURE = "growth.json", "growth.png"
_SIZES: tuple[Size, ...] = ((32, 32), (64, 64), (128, 128), (192, 192), (240, 320), (480, 640))
_OBSTACLES = (0, 2, 4, 6, 8)
_EPISODES, _BIN = 6, 25
"""Episodes of the servo, and how many of their steps make one median."""
_RESETS, _FIRST_SCENE = 100, 5000
"""Resets of every scenario, and the seed of the first one."""


def growth(quick: bool, out: Path) -> dict[str, Any]:
    """Measure all growth and write ``growth.json`` and ``growth.png``.

    Args:
        quick: fewer rounds, workers and episodes.
        out: folder; made if needed, an earlier ``growth.json`` there is replaced.

    Returns:
        The content of ``growth.json``: ``sizes``, ``obstacles``, ``workers``, ``resets``, ``episode``, ``first_use``.

    Raises:
        UsageError: if the folder cannot be used.
    """
    make_folder(out)
    started, rounds = time.monotonic(), 3 if quick else 15
    with folder_lock(out):
        found: dict[str, Any] = {"first_use": first_use()}
        for name, build in (("sizes", _size_cases), ("obstacles", _obstacle_cases)):
            with closing(ProcessGroup(build)) as group:
                found[name] = measure([group], rounds)
        found["resets"] = reset_rows(10 if quick else _RESETS)
        found["episode"] = episode_rows(2 if quick else _EPISODES)
        found["workers"] = worker_rows((1, 2) if quick else (1, 2, 4, 8))
        found |= {"versions": installed_versions(), "gl": os.environ.get("MUJOCO_GL"), "cpus": os.cpu_count()}
        found["wall_s"] = time.monotonic() - started
        draw_growth(out / GROWTH_FIGURE, found)
        write_json(out / GROWTH_FILE, found)
    return found


def _size_cases() -> Iterator[Case]:
    """A step of ``opaque`` without image and with images of growing size."""
    for size in (None, *_SIZES):
        env = gym.make("FixationPick-v0", scenario="opaque", image_size=size, max_episode_steps=ENDLESS)
        env.reset(seed=0)
        yield Case("no image" if size is None else label(size), stepper(env), env.close)


def _obstacle_cases() -> Iterator[Case]:
    """A step in scenes of ``clutter`` with more and more obstacles, without image and with one of 128x128."""
    clutter = dataclasses.asdict(resolve_scenario("clutter"))
    for size in (None, (128, 128)):
        for obstacles in _OBSTACLES:
            scenario = clutter | {"obstacle_count": (obstacles, obstacles)} if obstacles else "clear"
            env = gym.make("FixationPick-v0", scenario=scenario, image_size=size, max_episode_steps=ENDLESS)
            env.reset(seed=0)
            suffix = "no image" if size is None else label(size)
            yield Case(f"{obstacles} obstacles, {suffix}", stepper(env), env.close)


def reset_rows(resets: int) -> list[dict[str, Any]]:
    """Times of so many resets without image of every scenario, nearly all of which is the search for a scene.

    Returns:
        A row per scenario with median, mean and longest time, ms, and one over all of those with obstacles.
    """
    times = {name: _reset_times(name, resets) for name in SCENARIO_NAMES}
    crowded = [name for name in SCENARIO_NAMES if resolve_scenario(name).has_obstacles]
    times["all with obstacles"] = [time_ms for name in crowded for time_ms in times[name]]
    return [
        {
            "name": name,
            "ms_median": float(np.median(own)),
            "ms_mean": float(np.mean(own)),
            "ms_max": max(own),
            "resets": len(own),
        }
        for name, own in times.items()
    ]


def _reset_times(scenario: str, resets: int) -> list[float]:
    env = gym.make("FixationPick-v0", scenario=scenario, image_size=None)
    env.reset(seed=0)  # builds the simulation
    times = []
    for seed in range(_FIRST_SCENE, _FIRST_SCENE + resets):
        begin = time.perf_counter()
        env.reset(seed=seed)
        times.append(1e3 * (time.perf_counter() - begin))
    env.close()
    return times


def episode_rows(episodes: int) -> list[dict[str, Any]]:
    """Times of ``ServoPolicy.act`` and of a step, 320x240, over the course of picks in ``opaque``.

    Returns:
        A row per 25 steps with the medians in ms, over all episodes that lasted so long.
    """
    env = gym.make("FixationPick-v0", scenario="opaque")
    policy = ServoPolicy(make_perception((240, 320)))
    acts: dict[int, list[float]] = {}
    steps: dict[int, list[float]] = {}
    for seed in range(episodes):
        observation, _ = env.reset(seed=seed)
        policy.reset(seed)
        for index in count():
            begin = time.perf_counter()
            action = policy.act(observation)
            between = time.perf_counter()
            observation, _, terminated, truncated, _ = env.step(action)
            acts.setdefault(index // _BIN, []).append(1e3 * (between - begin))
            steps.setdefault(index // _BIN, []).append(1e3 * (time.perf_counter() - between))
            if terminated or truncated:
                break
    env.close()
    return [
        {
            "step": _BIN * place,
            "act_ms": float(np.median(acts[place])),
            "step_ms": float(np.median(steps[place])),
            "calls": len(acts[place]),
        }
        for place in sorted(acts)
    ]


def format_growth(found: dict[str, Any]) -> str:
    """All series as text."""
    lines = [f"{name:32} {value:10.1f}" for name, value in found["first_use"].items()]
    lines += ["", f"{'step':32} {'median ms':>10} {'p95 ms':>10}"]
    for name in ("sizes", "obstacles"):
        lines += [f"{row['name']:32} {row['ms_median']:10.2f} {row['ms_p95']:10.2f}" for row in found[name]]
    lines += ["", f"{'reset without image':32} {'median ms':>10} {'mean ms':>10} {'longest':>10}"]
    lines += [
        f"{row['name']:32} {row['ms_median']:10.1f} {row['ms_mean']:10.1f} {row['ms_max']:10.1f}"
        for row in found["resets"]
    ]
    lines += ["", f"{'servo, from step':32} {'act ms':>10} {'step ms':>10}"]
    lines += [f"{row['step']:32d} {row['act_ms']:10.2f} {row['step_ms']:10.2f}" for row in found["episode"]]
    lines += ["", f"{'vector of environments':32} {'steps / s':>10} {'MB each':>10}"]
    lines += [
        f"{row['kind'] + ', ' + str(row['workers']):32} {row['steps_per_s']:10.1f} {row['mb_each']:10.0f}"
        for row in found["workers"]
    ]
    return "\n".join(lines)
