"""An episode goes on bit by bit from a state, here, in a copy, and in another process."""

import copy
import pickle
import subprocess
import sys
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

import fixation_gym  # noqa: F401
from fixation_gym.envs.config import SCENARIOS
from fixation_gym.envs.pick_env import FixationPickEnv
from fixation_gym.envs.sensor_noise import SENSOR_NOISE, SensorNoise
from fixation_gym.envs.zfc_env import FixationPickZFC

pytestmark = pytest.mark.sim
SIZE = (96, 128)
NOMINAL = SENSOR_NOISE["nominal"]
MOVING = {"base": "mixed", "moving_count": (1, 1), "target_moves": 1.0, "push_time": (0.2, 1.0)}


def actions(env, seed, count):
    rng = np.random.default_rng(seed)
    return [rng.uniform(-0.6, 0.6, env.action_space.shape).astype(np.float32) for _ in range(count)]


def walk(env, steps):
    """Everything that the steps return, as one flat list of arrays."""
    trail = []
    for action in steps:
        obs, reward, terminated, truncated, info = env.step(action)
        trail += [np.asarray(value) for value in obs.values()]
        trail += [np.array([reward, terminated, truncated, info["clearance_m"], info["distance_true_m"]])]
    return trail


def assert_same(first, second):
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.fixture(params=["pick", "zfc", "ways", "privileged", "any_colour", "realistic"])
def env(request):
    made = {
        "pick": lambda: FixationPickEnv(MOVING, image_size=SIZE),
        "zfc": lambda: FixationPickZFC(MOVING, image_size=SIZE),
        "ways": lambda: FixationPickZFC(MOVING, "ways", image_size=SIZE),
        "privileged": lambda: FixationPickZFC("opaque", "privileged", image_size=SIZE),
        "realistic": lambda: FixationPickZFC(MOVING, image_size=SIZE, sensor_noise="realistic"),
        "any_colour": lambda: FixationPickZFC("any_colour", image_size=SIZE),
    }[request.param]()
    made.reset(seed=7)
    walk(made, actions(made, 0, 12))
    yield made
    made.close()


def test_an_episode_goes_on_from_a_state_and_the_next_ones_are_the_same_too(env):
    state, steps = env.get_state(), actions(env, 1, 14)
    first = walk(env, steps)
    next_scene = (env.reset()[0], env.scene)[1]
    env.set_state(state)
    assert_same(walk(env, steps), first)
    env.reset()
    assert env.scene == next_scene


def test_a_copy_goes_on_by_itself_and_draws_the_same_scenes(env):
    steps = actions(env, 1, 6)
    other = copy.deepcopy(env)
    assert other.np_random_seed == env.np_random_seed == 7
    assert_same(walk(other, steps), walk(env, steps))
    other.reset()
    env.reset()
    assert other.scene == env.scene
    other.close()


def test_an_environment_that_was_closed_goes_on_from_a_state(env):
    state, steps = env.get_state(), actions(env, 1, 3)
    first = walk(env, steps)
    env.close()
    assert env.sim.model.nbody > 0  # a look at the simulation is no reset
    with pytest.raises(gym.error.ResetNeeded):
        env.step(steps[0])
    env.set_state(state)
    assert_same(walk(env, steps), first)


def test_a_state_is_small(env):
    assert len(pickle.dumps(env.get_state())) < 4e6


def test_another_process_goes_on_from_a_pickle(tmp_path):
    env = gym.make("FixationPickZFC-v0", scenario=MOVING, image_size=SIZE)
    env.reset(seed=7)
    walk(env, actions(env, 0, 12))
    (tmp_path / "env.pickle").write_bytes(pickle.dumps((env.unwrapped, env.unwrapped.get_state())))
    code = (
        "import pickle, sys, numpy as np\n"
        "env, state = pickle.load(open(sys.argv[1], 'rb'))\n"
        "for _ in range(3): env.step(np.zeros(4, np.float32))\n"
        "env.set_state(state)\n"
        "for _ in range(5): obs, *_ = env.step(np.full(4, -0.2, np.float32))\n"
        "np.savez(sys.argv[2], **obs)\n"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "env.pickle"), str(tmp_path / "obs.npz")], check=True)
    for _ in range(5):
        obs, *_ = env.step(np.full(4, -0.2, np.float32))
    there = np.load(tmp_path / "obs.npz")
    for key, value in obs.items():
        np.testing.assert_array_equal(there[key], value, err_msg=key)
    env.close()


def test_foreign_states_are_refused_with_a_sentence():
    env = FixationPickEnv(image_size=SIZE)
    with pytest.raises(gym.error.ResetNeeded):
        env.get_state()
    env.reset(seed=0)
    state = env.get_state()
    for other, message in (
        ({"qpos": 1}, "what get_state returned, got dict"),
        (replace(state, written_by="fixation-gym 0.0"), r"written by fixation-gym 0\.0, but this is"),
        (
            replace(state, settings={**state.settings, "image_size": (64, 80)}),
            r"image_size=\(64, 80\), but this one has",
        ),
        (replace(state, settings={}), "another kind of environment"),
        (
            replace(state, settings={**state.settings, "sensor_noise": SensorNoise(read_noise=3.0)}),
            r"with sensor_noise=\{.*'read_noise': 3\.0.*\}, but this one has \{.*'read_noise': 1\.0.*\}",
        ),
        (
            replace(state, settings={**state.settings, "scenario": SCENARIOS["shelf"]}),
            "with scenario='shelf', but this one has 'clear'",
        ),
    ):
        with pytest.raises(ValueError, match=message):
            env.set_state(other)
    env.close()


def test_a_preset_is_the_same_by_its_name_and_by_its_value():
    named, valued = FixationPickEnv(image_size=SIZE), FixationPickEnv(image_size=SIZE, sensor_noise=NOMINAL)
    named.reset(seed=0)
    valued.set_state(named.get_state())
    steps = actions(named, 1, 3)
    assert_same(walk(valued, steps), walk(named, steps))
    for env in (named, valued):
        env.close()


def test_an_environment_that_was_never_reset_can_be_copied():
    env = pickle.loads(pickle.dumps(FixationPickZFC("shelf", image_size=SIZE)))
    assert env.scenario.name == "shelf"
    assert env.scene is None
