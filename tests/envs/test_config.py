import json

import numpy as np
import pytest

from fixation_gym.envs.config import SCENARIOS, resolve_scenario, resolve_sensor_noise
from fixation_gym.envs.object_pool import obstacle_shape, target_shape
from fixation_gym.envs.sampling import sample_scene
from fixation_gym.envs.scene import TABLE_HEIGHT, reachable_directions


def test_a_mapping_changes_fields_of_a_named_scenario_and_survives_json():
    given = json.loads(json.dumps({"base": "opaque", "obstacle_count": [2, 2], "target_shapes": ["ball"]}))
    scenario = resolve_scenario(given)
    assert scenario.obstacle_kinds == ("opaque",)
    assert scenario.obstacle_count == (2, 2)
    assert scenario.name == "custom"


@pytest.mark.parametrize(
    ("scenario", "message"),
    [
        ("glass", "clear, opaque, translucent, mirror"),
        ({"obstacles": 3}, "obstacle_count"),
        ({"obstacle_count": [0, 9], "obstacle_kinds": ["opaque"]}, "within 0..4"),
        ({"obstacle_count": [1, 1]}, "obstacle_kinds"),
        ({"target_shapes": ["teapot"]}, "duck"),
        ({"target_shapes": 3}, "list of names"),
        ({"obstacle_kinds": "opaque"}, "list of names"),
        ({"obstacle_count": 2, "obstacle_kinds": ["opaque"]}, "two numbers"),
        ({"obstacle_count": [1.5, 2], "obstacle_kinds": ["opaque"]}, "whole numbers"),
        ({"obstacle_count": [2, 2], "obstacle_kinds": ["mirror"]}, "at most 1"),
        ({"alpha": 0.5}, "two numbers"),
        ({"alpha": ["a", "b"]}, "two numbers"),
        ({"grasp_width": [0.03]}, "two numbers"),
        ({"grasp_width": [0.01, 0.02]}, "0.025..0.07"),
        (7, "name or a mapping"),
    ],
)
def test_a_bad_scenario_is_refused_with_what_is_allowed(scenario, message):
    with pytest.raises(ValueError, match=message):
        resolve_scenario(scenario)


def test_an_unknown_noise_preset_lists_the_presets():
    with pytest.raises(ValueError, match="ideal, nominal, conservative"):
        resolve_sensor_noise("loud")


@pytest.mark.parametrize("name", SCENARIOS)
def test_scenes_stand_on_the_table_apart_from_each_other(name):
    rng = np.random.default_rng(1)
    for _ in range(20):
        scene = sample_scene(SCENARIOS[name], rng)
        target = scene.target
        low = target.position[2] - target_shape(target.shape).half_extent[2] * target.scale[2]
        assert low == pytest.approx(TABLE_HEIGHT)
        assert 0.025 <= 2 * target_shape(target.shape).half_extent[1] * target.scale[1] <= 0.07 + 1e-9
        assert max(target.scale) <= 1.0
        count_low, count_high = SCENARIOS[name].obstacle_count
        assert count_low <= len(scene.obstacles) <= count_high
        for obstacle in scene.obstacles:
            half = obstacle_shape(obstacle.kind, obstacle.shape).half_extent[2] * obstacle.scale
            assert obstacle.position[2] - half == pytest.approx(TABLE_HEIGHT)
            assert np.linalg.norm(np.subtract(obstacle.position, target.position)[:2]) > 0.07


def test_the_same_generator_state_gives_the_same_scene_and_another_another():
    first, again, other = (sample_scene(SCENARIOS["opaque"], np.random.default_rng(s)) for s in (3, 3, 4))
    assert first == again
    assert first != other


def test_reachable_directions_look_down_on_the_target():
    directions = reachable_directions(np.array([0.5, 0.1, -0.08]))
    assert np.all(directions[:, 2] > 0.5)
