"""The same seeds give the same episodes bit by bit: beside another environment, and in any process."""

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest

from fixation_gym.envs.pick_env import FixationPickEnv
from fixation_gym.envs.zfc_env import FixationPickZFC

pytestmark = pytest.mark.sim
SMALL = (64, 80)


def walk(env, seed, steps=8):
    """A digest of every observation, reward and distance, one after the other; yields after each step."""
    rng, digest = np.random.default_rng(seed), hashlib.sha256()
    obs, info = env.reset(seed=seed)
    for _ in range(steps):
        for value in (*obs.values(), info["distance_true_m"], info["clearance_m"]):
            digest.update(np.asarray(value).tobytes())
        obs, reward, *_, info = env.step(rng.uniform(-1, 1, env.action_space.shape).astype(np.float32))
        digest.update(np.float64(reward).tobytes())
        yield digest.hexdigest()


def test_two_environments_in_turn_see_what_they_see_alone():
    envs = [FixationPickZFC("mirror", image_size=SMALL), FixationPickEnv("moving_obstacle", image_size=SMALL)]
    alone = [list(walk(env, seed)) for seed, env in enumerate(envs)]
    in_turn = list(zip(*(walk(env, seed) for seed, env in enumerate(envs)), strict=True))
    assert in_turn == list(zip(*alone, strict=True))
    for env in envs:
        env.close()


ELSEWHERE = """
import sys
sys.path.insert(0, {folder!r})
from test_reproducible import SMALL, FixationPickZFC, walk
print(list(walk(FixationPickZFC("mixed", image_size=SMALL), 5))[-1])
"""


def test_processes_with_other_hash_seeds_see_the_same():
    env = FixationPickZFC("mixed", image_size=SMALL)
    here = list(walk(env, 5))[-1]
    env.close()
    for hash_seed in ("1", "2"):
        result = subprocess.run(
            [sys.executable, "-c", ELSEWHERE.format(folder=os.path.dirname(__file__))],
            env={**os.environ, "PYTHONHASHSEED": hash_seed},
            capture_output=True,
            text=True,
            timeout=300,
            check=True,
        )
        assert result.stdout.splitlines()[-1] == here
