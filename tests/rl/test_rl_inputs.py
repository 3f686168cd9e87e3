"""What the networks see: memory of views, ranges, and the same for training and agents."""

import numpy as np
import pytest

from fixation_gym.envs.zfc_observation import zfc_observation_space
from fixation_policies.rl.config import CONFIGS
from fixation_policies.rl.inputs import (
    PERIODS,
    VIEWS,
    busy,
    input_space,
    learner_for,
    nearness_cells,
    network_inputs,
    remember,
)


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
        memory = remember(memory, zfc_obs(cells), CONFIGS["zfc"])
    view = network_inputs(zfc_obs(maps[-1]), memory, CONFIGS["zfc"])["view"]
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
    learner, (black, white) = CONFIGS["rgb"], images(0, 200)
    memory = remember(remember(None, black, learner), white, learner)
    view = network_inputs(white, memory, learner)["view"]
    assert view.shape == (6, 48, 48)
    assert set(view[:3].ravel()) == {200}
    assert set(view[3:].ravel()) == {20}


def test_stacked_images_are_a_decision_apart_and_the_first_stands_for_those_before():
    learner, memory, views = CONFIGS["rgb_augmented"], None, []
    for obs in images(*range(12)):
        memory = remember(memory, obs, learner)
        views.append(network_inputs(obs, memory, learner)["view"])
    assert views[0].shape == (9, 64, 64)
    levels = [[int(value) for value in view[::3, 5, 7]] for view in views]
    assert levels[0] == [0, 0, 0]
    assert levels[7] == [7, 7 - PERIODS, 0]
    assert levels[11] == [11, 11 - PERIODS, 11 - 2 * PERIODS]


def images(*greys):
    """Observations whose images are of one grey level each."""
    base = {key: value for key, value in zfc_obs(128).items() if key != "zfc_map"}
    return [base | {"rgb": np.full((96, 128, 3), grey, np.uint8)} for grey in greys]


@pytest.mark.parametrize("learner", CONFIGS.values(), ids=CONFIGS)
def test_inputs_are_in_their_space_for_every_configuration(learner):
    space = zfc_observation_space(learner.observation, (64, 80))
    space.seed(0)
    memory = None
    for _ in range(20):
        obs = space.sample()
        memory = remember(memory, obs, learner)
        assert input_space(learner).contains(network_inputs(obs, memory, learner))


def test_cells_of_depth_show_the_nearest_thing_against_the_target():
    depth = np.full((96, 128), 0.8, np.float32)  # twice as far as the target
    depth[:, :64] = 0.0  # unknown
    depth[0, 0] = 0.2  # one pixel of something near is the nearest of its cell
    depth[48:, 64:] = 0.32
    cells = nearness_cells(depth, 0.4)[0]
    assert cells[0, 0] == 1.0
    assert not cells[1:, :16].any()
    np.testing.assert_allclose(cells[:16, 16:], -1.0)
    np.testing.assert_allclose(cells[16:, 16:], 2.0 * (0.4 / 0.32 - 1.0), rtol=1e-6)


def test_inputs_differ_between_configurations_only_in_the_view():
    obs = zfc_obs(200)
    blind = {key: obs[key] for key in ("fixation", "proprio")}
    with_map, without = (
        network_inputs(seen, remember(None, seen, CONFIGS[name]), CONFIGS[name])
        for name, seen in (("zfc", obs), ("blind", blind))
    )
    assert set(with_map) - set(without) == {"view"}
    np.testing.assert_array_equal(with_map["vector"], without["vector"])


def test_busy_in_every_stage_and_only_there():
    assert not busy(zfc_obs(128))
    assert all(busy(zfc_obs(128, stage)) for stage in range(4))


@pytest.mark.parametrize("observation", VIEWS)
def test_an_observation_is_known_by_its_space(observation):
    assert learner_for(zfc_observation_space(observation, (64, 80))) == CONFIGS[observation]
