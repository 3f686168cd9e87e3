"""What worker processes add, whether memory grows, and robosuite's default reset: each in processes of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from typing import Any

import numpy as np

_STEPS = 400
_ONE_THREAD = {name: "1" for name in ("LP_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
"""Software GL and linear algebra take every core unless told otherwise."""
_LIFT_RESETS = 8
_MEMORY_STEPS, _MEMORY_RESETS = 50_000, 500


def steps_per_second(workers: int) -> float:
    """Steps per second of so many processes together, each with a 128x128 image and one thread."""
    code = f"from {__name__} import run_worker; run_worker()"
    environment = os.environ | _ONE_THREAD
    processes = [
        subprocess.Popen([sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, stdin=subprocess.PIPE)
        for _ in range(workers)
    ]
    for process in processes:  # all have built their environment
        assert process.stdout is not None
        process.stdout.readline()
    for process in processes:
        assert process.stdin is not None
        process.stdin.write(b"go\n")
        process.stdin.flush()
    seconds = [float(process.communicate()[0]) for process in processes]
    return workers * _STEPS / max(seconds)


def run_worker() -> None:
    """Body of a worker: build, say so, wait for the start, step, print the seconds taken."""
    import cv2

    cv2.setNumThreads(1)
    env = _make((128, 128))
    action = _action(env)
    for _ in range(20):
        env.step(action)
    print("ready", flush=True)
    sys.stdin.readline()
    begin = time.perf_counter()
    for _ in range(_STEPS):
        env.step(action)
    print(time.perf_counter() - begin, flush=True)


def lift_reset_rows() -> list[dict[str, Any]]:
    """Rows of robosuite's default reset, which compiles the model again, without and with a 128x128 image."""
    code = f"from {__name__} import run_lift_resets; run_lift_resets()"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return json.loads(result.stdout.splitlines()[-1])


def run_lift_resets() -> None:
    """Body of that process: print the rows as JSON."""
    from fixation_gym.gl import select_backend

    select_backend()
    from fixation_gym.envs.config import CONTROL_FREQUENCY
    from fixation_gym.envs.robosuite_backend import make_lift

    rows = []
    for size, suffix in ((None, ""), (128, " 128x128")):
        env = make_lift(CONTROL_FREQUENCY, size, hard_reset=True)
        env.reset()
        times = []
        for _ in range(_LIFT_RESETS):
            begin = time.perf_counter()
            env.reset()
            times.append(1e3 * (time.perf_counter() - begin))
        median, p95 = float(np.median(times)), float(np.percentile(times, 95))
        rows.append({"name": f"lift reset{suffix}", "ms_median": median, "ms_p95": p95, "calls": len(times)})
        env.close()
    print(json.dumps(rows))


def memory_slope_kib() -> dict[str, Any]:
    """Growth of the resident memory over 500 resets and 50,000 steps with a small image, in a process of its own."""
    code = f"from {__name__} import run_memory; run_memory()"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return json.loads(result.stdout.splitlines()[-1])


def run_memory() -> None:
    """Body of the memory process: print the slope of the resident memory as JSON."""
    env = _make((48, 64))
    action = _action(env)
    per_reset = _MEMORY_STEPS // _MEMORY_RESETS
    resident = []
    for _ in range(_MEMORY_RESETS):
        for _ in range(per_reset):
            env.step(action)
        env.reset()
        resident.append(resident_kib())
    settled = np.array(resident[_MEMORY_RESETS // 5 :])  # caches fill at first
    slope = float(np.polyfit(np.arange(len(settled)) * per_reset, settled, 1)[0])
    print(
        json.dumps(
            {
                "steps": _MEMORY_STEPS,
                "resets": _MEMORY_RESETS,
                "kib_per_1000_steps": 1000.0 * slope,
                "resident_mib": [float(settled[0]) / 1024, float(settled[-1]) / 1024],
            }
        )
    )


def resident_kib() -> float:
    """Resident memory of this process, KiB."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1024


def _make(image_size: tuple[int, int]) -> Any:
    import gymnasium as gym

    import fixation_gym  # noqa: F401 - registers the environment

    env = gym.make("FixationPick-v0", scenario="opaque", image_size=image_size, max_episode_steps=10**9)
    env.reset(seed=0)
    return env


def _action(env: Any) -> np.ndarray:
    action = np.zeros(env.action_space.shape, np.float32)
    action[0] = 0.05
    return action
