"""Environments whose observations Mitsuba renders: the same scenes, reproducible, and resumable in mid-episode."""

import gymnasium as gym
import numpy as np
import pytest

import fixation_gym  # noqa: F401
from fixation_gym.evaluation.config import EvaluationConfig

pytestmark = pytest.mark.sim
pytest.importorskip("mitsuba")
pytest.importorskip("pyoidn")
SIZE = (48, 64)
ACTION = np.array([0.3, 0.1, 0.4, 0.0, 0.1, 0.0, 0.0], np.float32)


@pytest.fixture(scope="module")
def env():
    env = gym.make("FixationPick-v0", scenario="mirror", image_size=SIZE, renderer="mitsuba")
    env.reset(seed=1)
    yield env
    env.close()


def pictures(env, seed, steps=3):
    shown = [env.reset(seed=seed)[0]["rgb"]]
    return np.array(shown + [env.step(ACTION)[0]["rgb"] for _ in range(steps)])


def test_equal_seeds_give_equal_pictures_after_other_scenes(env):
    first = pictures(env, 3)
    other = pictures(env, 4)
    assert np.any(first != other)
    np.testing.assert_array_equal(pictures(env, 3), first)


def test_scene_and_everything_but_the_picture_are_those_of_mujoco(env):
    plain = gym.make("FixationPick-v0", scenario="mirror", image_size=SIZE, sensor_noise="ideal")
    photoreal = gym.make(
        "FixationPick-v0", scenario="mirror", image_size=SIZE, sensor_noise="ideal", renderer="mitsuba"
    )
    for made in (plain, photoreal):
        made.reset(seed=3)
    assert plain.unwrapped.scene == photoreal.unwrapped.scene
    one, other = plain.step(ACTION)[0], photoreal.step(ACTION)[0]
    for key in one.keys() - {"rgb"}:
        np.testing.assert_array_equal(one[key], other[key])
    assert np.any(one["rgb"] != other["rgb"])
    plain.close()
    photoreal.close()


def test_episode_goes_on_from_a_state_with_the_same_pictures(env):
    env.reset(seed=5)
    env.step(ACTION)
    state = env.unwrapped.get_state()
    first = [env.step(ACTION)[0]["rgb"] for _ in range(2)]
    env.reset(seed=6)
    env.unwrapped.set_state(state)
    np.testing.assert_array_equal([env.step(ACTION)[0]["rgb"] for _ in range(2)], first)


def test_state_of_the_other_renderer_is_refused(env):
    plain = gym.make("FixationPick-v0", scenario="mirror", image_size=SIZE)
    plain.reset(seed=5)
    with pytest.raises(ValueError, match="renderer='mujoco', but this one has 'mitsuba'"):
        env.unwrapped.set_state(plain.unwrapped.get_state())
    plain.close()


def test_learners_environment_perceives_the_picture():
    env = gym.make("FixationPickZFC-v0", observation="privileged", image_size=SIZE, renderer="mitsuba")
    env.reset(seed=2)
    for _ in range(3):
        observation = env.step(np.zeros(4, np.float32))[0]
    assert observation["fixation"][2] == 1.0
    assert observation["true_map"].shape == (1, 32, 32)
    env.close()


def test_evaluation_runs_an_episode_and_names_renderer_and_variant():
    config = EvaluationConfig("random", scenarios=("clear",), image_size=(32, 32), renderer="mitsuba", episodes=1)
    config.check()
    described = config.run_description()
    assert described["renderer"] == "mitsuba"
    assert described["variant"] in ("llvm_ad_rgb", "scalar_rgb")
    assert "renderer" not in EvaluationConfig().run_description()
    assert config.cell(("clear", 0))["renderer"] == "mitsuba"
