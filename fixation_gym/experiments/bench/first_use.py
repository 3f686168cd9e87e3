"""What a process spends until its first observation, and its memory then, after more scenarios, and after closing."""

from __future__ import annotations

import json
import subprocess
import sys
import time

import numpy as np

from fixation_gym.experiments.bench.processes import resident_kib

_TIMES = 5
"""Processes whose medians are taken; one before them fills the caches."""
_CODE = "import time; begin = time.process_time(), time.perf_counter(); from {} import run_first_use as run; run(begin)"


def first_use() -> dict[str, float]:
    """Medians over fresh processes with warm caches; the default image of 320x240.

    Returns:
        Import, ``gym.make`` and the first reset, in CPU time and by the clock, s. Then resident memory, MB: when the
        package is imported, which loads neither MuJoCo nor numba; after the reset; after ``close``; and with the last
        of eleven scenarios that were opened and closed in turn.
    """
    found = []
    for _ in range(1 + _TIMES):
        command = [sys.executable, "-c", _CODE.format(__name__)]
        result = subprocess.run(command, capture_output=True, text=True, check=True)
        found.append(json.loads(result.stdout.splitlines()[-1]))
    return {name: float(np.median([one[name] for one in found[1:]])) for name in found[0]}


def run_first_use(begin: tuple[float, float]) -> None:
    """Body of such a process: print what it took as JSON; ``begin`` is CPU time and clock before the first import."""
    import gymnasium as gym

    import fixation_gym  # noqa: F401 - registers the environment
    from fixation_gym.envs.config import SCENARIO_NAMES

    imported = resident_kib() / 1024
    env = gym.make("FixationPick-v0", scenario="opaque")
    env.reset(seed=0)
    used = time.process_time() - begin[0], time.perf_counter() - begin[1]
    opened = resident_kib() / 1024
    env.close()
    closed = several = resident_kib() / 1024
    for name in SCENARIO_NAMES[:11]:
        env = gym.make("FixationPick-v0", scenario=name)
        env.reset(seed=0)
        several = resident_kib() / 1024
        env.close()
    found = {
        "import, make and reset, CPU s": used[0],
        "the same by the clock, s": used[1],
        "memory when imported, MB": imported,
        "after the first reset, MB": opened,
        "after close, MB": closed,
        "eleven scenarios in turn, MB": several,
    }
    print(json.dumps(found))
