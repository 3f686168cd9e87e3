"""A closed environment leaves nothing behind: evaluations open one after the other in a process."""

import gc
import subprocess
import sys
from ast import literal_eval

import gymnasium
import numpy as np
import pytest

import fixation_gym  # noqa: F401

pytestmark = pytest.mark.sim
HEAVY = ("PickSim", "TaskModel", "View", "MjModel", "MjData", "MjrContext", "GLContext")


def heavy_objects():
    """Models, data and GL contexts that this process holds, also those that only refer to each other."""
    return sum(type(thing).__name__ in HEAVY for thing in gc.get_objects())


def test_a_closed_environment_frees_models_and_contexts():
    gc.collect()
    before = heavy_objects()
    env = gymnasium.make("FixationPick-v0", scenario="mirror", image_size=(32, 32))
    env.reset(seed=0)
    assert heavy_objects() > before
    env.close()
    gc.collect()  # a first call that numba compiles leaves its callers' frames in circles until Python looks for those
    assert heavy_objects() == before


def test_a_closed_environment_can_be_reset_again():
    env = gymnasium.make("FixationPick-v0", image_size=(32, 32))
    first, _ = env.reset(seed=3)
    env.close()
    again, _ = env.reset(seed=3)
    assert (first["rgb"] == again["rgb"]).all()
    env.close()


ROUNDS = """
import gymnasium, fixation_gym
def resident_mb():
    with open("/proc/self/status") as file:
        return next(int(line.split()[1]) / 1024 for line in file if line.startswith("RssAnon:"))
def round():
    env = gymnasium.make("FixationPick-v0", image_size=(32, 32))
    env.reset(seed=0)
    opened = resident_mb()
    env.close()
    return opened, resident_mb()
print(round(), *(round() for _ in range(4)), sep=";")
"""


def test_closed_environments_give_their_memory_back():
    result = subprocess.run([sys.executable, "-c", ROUNDS], capture_output=True, text=True, timeout=300, check=True)
    opened, closed = np.array([literal_eval(pair) for pair in result.stdout.split(";")]).T  # MB
    assert (closed < opened - 30.0).all()
    assert closed.max() - closed[0] < 130.0  # what one of them takes: four more do not add up
