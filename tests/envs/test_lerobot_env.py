"""The environment in LeRobot's layout, without LeRobot: `make clients` runs its own programs."""

import gymnasium as gym
import numpy as np
import pytest

import fixation_gym.lerobot_env  # noqa: F401
from fixation_gym.envs.perceiving import perception_for
from fixation_gym.export.recording import NAMES
from fixation_gym.lerobot_env.env import make_env
from fixation_gym.lerobot_env.layout import LeRobotLayout, make_pick
from fixation_gym.types import Observation

pytestmark = pytest.mark.sim
SMALL = (64, 80)


@pytest.fixture(scope="module")
def laid_out():
    env = gym.make("fixation_gym/FixationPick-v0", scenario="opaque", image_size=SMALL, episode_length=5)
    yield env
    env.close()


def test_pictures_and_state_are_those_of_the_environment_under_lerobots_names(laid_out):
    plain = gym.make("fixation_gym:FixationPick-v0", scenario="opaque", image_size=SMALL)
    perception = perception_for(plain.unwrapped.scenario, plain.unwrapped.intrinsics)
    (seen, _), (sensed, _) = laid_out.reset(seed=2), plain.reset(seed=2)
    for step in range(5):
        cells = perception.update(Observation.from_dict(sensed)).zfc.cells
        assert seen in laid_out.observation_space
        np.testing.assert_array_equal(seen["pixels"]["wrist"], sensed["rgb"])
        np.testing.assert_array_equal(seen["pixels"]["zero_flow_map"], np.stack([cells] * 3, axis=-1))
        np.testing.assert_array_equal(seen["agent_pos"], [*sensed["joint_pos"], *sensed["gripper_width"]])
        action = np.full(7, 0.1 * step, np.float32)
        (seen, *_, truncated, info), (sensed, *_) = laid_out.step(action), plain.step(action)
        assert truncated == (step == 4)
        assert info["is_success"].dtype == bool
    plain.close()


def test_lerobot_finds_what_it_asks_an_environment_for(laid_out):
    assert type(laid_out) is LeRobotLayout  # the outermost one is asked for the task
    assert laid_out.task_description.startswith("pick up")
    assert laid_out.get_wrapper_attr("_max_episode_steps") == 5
    assert laid_out.unwrapped.metadata["render_fps"] == 25
    assert laid_out.observation_space["agent_pos"].shape == (len(NAMES["observation.state"]),)


def test_the_hub_gets_several_as_one():
    envs = make_env(n_envs=2)
    seen, _ = envs.reset(seed=[0, 1])
    assert seen["pixels"]["wrist"].shape == (2, 240, 320, 3)
    assert envs.call("task_description")[1].startswith("pick up")
    frames = envs.call("render")
    assert frames[0].shape == frames[1].shape
    assert not np.array_equal(frames[0], frames[1])
    envs.close()


def test_without_the_map_nothing_is_perceived():
    env = make_pick(image_size=SMALL, zero_flow_map=False)
    seen, _ = env.reset(seed=0)
    assert list(seen["pixels"]) == ["wrist"]
    assert env.unwrapped.percept is None
    env.close()


def test_another_environment_is_refused():
    with pytest.raises(ValueError, match="LeRobotLayout is for FixationPick-v0 with an image_size"):
        LeRobotLayout(gym.make("fixation_gym:FixationPickZFC-v0"))
    with pytest.raises(ValueError, match="LeRobotLayout is for FixationPick-v0 with an image_size"):
        make_pick(image_size=None)
