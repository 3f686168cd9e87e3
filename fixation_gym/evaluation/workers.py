"""Episodes in this process, in worker processes (loky), or on a Ray cluster: one function over cells."""

from __future__ import annotations

import atexit
import importlib.util
import os
from collections.abc import Callable, Generator, Hashable, Iterable, Sequence
from typing import Any, TypeVar, cast

import gymnasium

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.rollout import run_episode
from fixation_gym.evaluation.starter import end_with
from fixation_policies.base import Policy

BACKENDS = ("loky", "ray")

Cell = dict[str, Any]
"""One episode to run: env_id, scenario, policy, detector, seed, sensor_noise, image_size, renderer; JSON-able."""

Thing = TypeVar("Thing")
_kept: dict[tuple[Any, ...], tuple[Any, Callable[[Any], object]]] = {}  # at most one: environments and rigs are large


def run_cell(cell: Cell) -> dict[str, Any]:
    """Run the episode that a cell describes and return its ``EpisodeResult`` as a dict, with the trace."""
    env, policy = world(cell)
    result = run_episode(env, policy, cell["seed"], scenario=cell["scenario"], policy_name=cell["policy"])
    return {**result.to_json(), "trace": result.trace}


def world(cell: Cell, render_mode: str | None = None) -> tuple[gymnasium.Env, Policy]:
    """Environment and policy of a cell.

    They stay alive for the next cell of the same scenario: building an environment takes seconds, a reset does not.
    """
    items = ((name, value) for name, value in sorted(cell.items()) if name != "seed")
    settings = tuple((name, tuple(value) if isinstance(value, list) else value) for name, value in items)
    return kept(_build_world, settings, render_mode, close=lambda world: world[0].close())


def _build_world(settings: tuple[tuple[str, Any], ...], render_mode: str | None) -> tuple[gymnasium.Env, Policy]:
    cell = dict(settings)
    env = make_env(cell, render_mode)
    return env, make_policy(cell["policy"], env, cell.get("detector"))


def kept(build: Callable[..., Thing], *settings: Hashable, close: Callable[[Thing], object]) -> Thing:
    """What ``build`` makes of the settings, kept for the next cell of this process; anything else is closed first."""
    key = (build, *settings)
    if key not in _kept:
        close_kept()
        _kept[key] = build(*settings), close
    return _kept[key][0]


@atexit.register
def close_kept() -> None:
    """Close what this process keeps."""
    while _kept:
        thing, close = _kept.popitem()[1]
        close(thing)


def make_env(cell: Cell, render_mode: str | None = None, render_view: str = "overlay") -> gymnasium.Env:
    """Build the environment of a cell.

    Raises:
        MissingGLError: if nothing can render here.
    """
    prepare_process()  # before the environment's module imports robosuite
    from fixation_policies.catalogue import needed_environment

    return gymnasium.make(
        cell["env_id"],
        scenario=cell["scenario"],
        sensor_noise=cell["sensor_noise"],
        image_size=tuple(cell["image_size"]),
        render_mode=render_mode,
        render_view=render_view,
        renderer=cell["renderer"],
        **needed_environment(cell["policy"]).arguments,
    )


def make_policy(name: str, env: gymnasium.Env, detector: str | None = None) -> Policy:
    """Build a policy by its name, with a detector by its name."""
    from fixation_policies import catalogue

    return catalogue.make_policy(name, env, detector)


def check_backend(backend: str, workers: int) -> None:
    """Check that the workers can be had.

    Raises:
        UsageError: if not, saying what is allowed or missing.
    """
    if workers < 1:
        raise UsageError(f"--workers must be at least 1, got {workers}")
    if backend not in BACKENDS:
        raise UsageError(f"unknown backend '{backend}'; choose one of {', '.join(BACKENDS)}")
    if backend == "ray" and importlib.util.find_spec("ray") is None:
        raise UsageError("--backend ray needs the package ray, which is not installed; use --backend loky")


def run_cells(
    cells: Sequence[Cell],
    workers: int,
    backend: str = "loky",
    run: Callable[[Cell], dict[str, Any]] = run_cell,
) -> Generator[dict[str, Any], None, None]:
    """Run all cells and yield each result as soon as it is there (with Ray, as soon as its batch is).

    With more than one worker, the order is not that of the cells.

    Raises:
        UsageError: if a worker process dies.
    """
    if not cells or (workers == 1 and backend == "loky"):
        yield from map(run, cells)
        return
    import joblib
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    # Workers inherit this. More threads than cores only get into each other's way.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    if backend == "loky":
        watch: dict[str, Any] = {"initializer": end_with, "initargs": (os.getpid(),)}
        parallel = joblib.Parallel(n_jobs=workers, backend="loky", return_as="generator_unordered", **watch)
        try:
            yield from _results(parallel(joblib.delayed(run)(cell) for cell in cells))
        except TerminatedWorkerError as error:
            raise UsageError(
                "a worker process died (killed, out of memory, or a crash of the graphics driver); what is finished is "
                "kept, and the same command goes on"
            ) from error
        return
    from ray.exceptions import RayError  # pyright: ignore[reportMissingImports]
    from ray.util.joblib import register_ray  # pyright: ignore[reportMissingImports]

    _join_cluster(workers)
    register_ray()
    batch = 4 * workers  # joblib's Ray backend only returns whole lists; smaller ones lose less when killed
    try:
        for start in range(0, len(cells), batch):
            parallel = joblib.Parallel(n_jobs=workers, backend="ray")
            yield from _results(parallel(joblib.delayed(run)(cell) for cell in cells[start : start + batch]))
    except RayError as error:
        reason = str(error).strip().splitlines()[-1]
        raise UsageError(
            f"Ray says {type(error).__name__}: {reason}; finished batches are kept, and the same command goes on"
        ) from error


def _join_cluster(workers: int) -> None:
    """Join the Ray cluster of RAY_ADDRESS or of this machine. If there is none, joblib's backend starts one.

    Raises:
        UsageError: if there is none at RAY_ADDRESS, or it has fewer CPUs than ``workers``.
    """
    import ray  # pyright: ignore[reportMissingImports]

    address = os.environ.get("RAY_ADDRESS")
    if not ray.is_initialized() and address != "local":
        try:
            ray.init("auto")
        except (ConnectionError, ValueError) as error:
            if address is not None:
                raise UsageError(f"there is no Ray cluster at RAY_ADDRESS={address}; start or unset it") from error
    if ray.is_initialized() and workers > (cpus := int(ray.cluster_resources().get("CPU", 0))):
        raise UsageError(f"--workers must be at most {cpus}, the CPUs of the Ray cluster, got {workers}")


def _results(values: Any) -> Iterable[dict[str, Any]]:
    return cast("Iterable[dict[str, Any]]", values)  # joblib's types allow None, which run never returns


def prepare_process() -> None:
    """Choose a GL library and one thread for OpenCV, before anything is rendered in this process.

    Raises:
        MissingGLError: if nothing can render here.
    """
    from fixation_gym.gl import select_backend

    select_backend()
    import cv2

    cv2.setNumThreads(1)  # images are small: threads cost more than they gain
