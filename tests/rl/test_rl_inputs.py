"""What the networks see: memory of views, ranges, and the same for training and agents."""

import numpy as np
import pytest

from fixation_gym.envs.zfc_observation import zfc_observation_space
from fixation_policies.rl.inputs import VIEWS, busy, input_space, network_inputs, observation_name, remember


def zfc_obs(cells, stage=None):
    proprio = np.zeros(24, np.float32)
    proprio[12] = -0.7
    if stage is not None:
        proprio[20 + stage] = 1.0
    fixation = np.array([0.01, -0.02, 1.0, 0.4, 0.01], np.float32)
    return {"zfc_map": np.full((1, 32, 32), cells / 255.0, np.float32), "fixation": fixation, "proprio": proprio}


def seen(*maps):
    """The view after maps that are the same in all cells: one value for now, one for the memory."""
    memory = None
    for cells in maps:
        memory = remember(memory, zfc_obs(cells))
    view = network_inputs(zfc_obs(maps[-1]), memory)["view"]
    return [int(value) for value in view[:, 5, 7]]


def test_unknown_stays_unknown():
    assert seen(128, 128, 128) == [128, 128]


def test_evidence_adds_up_until_it_is_full():
    assert seen(255)[0] == 255
    assert seen(255)[1] == 128 + round(127 * 0.25)
    assert seen(*[255] * 20) == [255, 255]
    assert seen(*[1] * 20) == [1, 1]


def test_evidence_fades_to_half_in_a_second_without_sight():
    now, memory = seen(*[255] * 20, *[128] * 25)
    assert now == 128
    assert memory == pytest.approx(128 + 127 * 0.97**25, abs=1)
    assert 0.4 < 0.97**25 < 0.6


def test_images_show_what_changed():
    black, white = (zfc_obs(128) | {"rgb": np.full((96, 128, 3), grey, np.uint8)} for grey in (0, 200))
    for obs in (black, white):
        del obs["zfc_map"]
    memory = remember(remember(None, black), white)
    view = network_inputs(white, memory)["view"]
    assert view.shape == (6, 48, 48)
    assert set(view[:3].ravel()) == {200}
    assert set(view[3:].ravel()) == {20}


@pytest.mark.parametrize("observation", VIEWS)
def test_inputs_are_in_their_space_for_every_observation(observation):
    space = zfc_observation_space(observation, (64, 80))
    space.seed(0)
    memory = None
    for _ in range(20):
        obs = space.sample()
        memory = remember(memory, obs)
        assert input_space(observation).contains(network_inputs(obs, memory))


def test_inputs_differ_between_configurations_only_in_the_view():
    obs = zfc_obs(200)
    blind = {key: obs[key] for key in ("fixation", "proprio")}
    with_map, without = network_inputs(obs, remember(None, obs)), network_inputs(blind, remember(None, blind))
    assert set(with_map) - set(without) == {"view"}
    np.testing.assert_array_equal(with_map["vector"], without["vector"])


def test_busy_in_every_stage_and_only_there():
    assert not busy(zfc_obs(128))
    assert all(busy(zfc_obs(128, stage)) for stage in range(4))


@pytest.mark.parametrize("observation", VIEWS)
def test_an_observation_is_known_by_its_space(observation):
    assert observation_name(zfc_observation_space(observation, (64, 80))) == observation
