"""``gym.make_vec`` without a mode: workers whose observations, errors and ends are those of single environments."""

import os
import signal

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import fixation_gym  # noqa: F401
from fixation_gym.envs.vector import _ONE_THREAD, WorkerEnvs, WorkerError

pytestmark = pytest.mark.sim
SMALL = (32, 40)


@pytest.fixture(scope="module")
def workers():
    threads = {name: os.environ.get(name) for name in _ONE_THREAD}
    envs = gym.make_vec("FixationPickZFC-v0", num_envs=2, image_size=SMALL, observation="rgb", max_episode_steps=3)
    assert isinstance(envs, WorkerEnvs)
    assert {name: os.environ.get(name) for name in _ONE_THREAD} == threads
    yield envs
    envs.close()
    assert not any(process.is_alive() for process in envs.processes)


def test_observations_are_those_of_single_environments_bit_by_bit(workers):
    assert workers.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    seen, _ = workers.reset(seed=5)
    actions = np.random.default_rng(0).uniform(-1, 1, (3, 2, 4)).astype(np.float32)
    vector = [seen, *(workers.step(action)[0] for action in actions)]
    for index in range(2):
        single = gym.make("FixationPickZFC-v0", image_size=SMALL, observation="rgb", max_episode_steps=3)
        alone = [single.reset(seed=5 + index)[0], *(single.step(action[index])[0] for action in actions)]
        single.close()
        for there, here in zip(vector, alone, strict=True):
            for key, value in here.items():
                np.testing.assert_array_equal(there[key][index], value)


def test_an_episode_that_has_ended_begins_again_with_the_next_step(workers):
    workers.reset(seed=0)
    still = np.zeros((2, 4), np.float32)
    truncated = [workers.step(still)[3].tolist() for _ in range(4)]
    assert truncated == [[False, False]] * 2 + [[True, True], [False, False]]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"num_envs": 0}, "num_envs must be at least 1, got 0"),
        ({"num_envs": 2, "wait_s": 0.0}, "wait_s must be above 0"),
        ({"num_envs": 2, "scenario": "nowhere"}, "unknown scenario 'nowhere'"),
    ],
)
def test_wrong_arguments_are_said_before_a_worker_starts(arguments, message):
    with pytest.raises(ValueError, match=message):
        gym.make_vec("FixationPick-v0", **arguments)


def test_what_a_worker_raises_is_raised_here_with_its_traceback():
    envs = gym.make_vec("FixationPick-v0", num_envs=1, image_size=None)
    with pytest.raises(gym.error.ResetNeeded) as told:
        envs.call("_require_reset")
    assert isinstance(told.value.__cause__, WorkerError)
    assert "in worker 0:\nTraceback" in str(told.value.__cause__)
    assert envs.closed


def test_a_worker_that_is_killed_or_stopped_is_told():
    for number, message in ((signal.SIGKILL, "a worker process ended"), (signal.SIGSTOP, "did not answer within 2 s")):
        envs = gym.make_vec("FixationPick-v0", num_envs=1, image_size=None)
        envs.parent_pipes[0].wait_s = envs._wait_s = 2.0
        os.kill(envs.processes[0].pid, number)
        with pytest.raises(WorkerError, match=message):
            envs.get_attr("control_frequency")
        assert envs.closed
