import json

import pytest

from fixation_gym.envs.config import resolve_scenario
from fixation_gym.envs.sensor_noise import resolve_sensor_noise


def test_a_mapping_changes_fields_of_a_named_scenario_and_survives_json():
    given = json.loads(json.dumps({"base": "opaque", "obstacle_count": [2, 2], "target_shapes": ["ball"]}))
    scenario = resolve_scenario(given)
    assert scenario.obstacle_materials == ("opaque",)
    assert scenario.obstacle_count == (2, 2)
    assert scenario.name == "custom"


@pytest.mark.parametrize(
    ("scenario", "message"),
    [
        ("granite", "clear, opaque, translucent, mirror"),
        ({"obstacles": 3}, "obstacle_count"),
        ({"obstacle_count": [0, 10], "obstacle_materials": ["opaque"]}, "within 0..9"),
        ({"obstacle_count": [1, 1]}, "obstacle_materials"),
        ({"discovery": 0.5}, "true or false"),
        ({"discovery": True}, "obstacle_count of 1 or more"),
        ({"free_elevation_deg": [20, 30]}, "40.0..85.0"),
        ({"free_azimuth_shape": [0.0, 1.0]}, "two numbers within 0.2..5"),
        ({"free_azimuth_shape": 1.0}, "two numbers within 0.2..5"),
        ({"most_open": 0.1}, "most_open"),
        ({"first_kinds": ["sofa"]}, "cabinet"),
        ({"base": "opaque", "moving_count": [4, 4]}, "add up to 9"),
        ({"coloured_frames": "red"}, "true or false"),
        ({"target_shapes": ["teapot"]}, "duck"),
        ({"target_shapes": 3}, "list of names"),
        ({"obstacle_materials": "opaque"}, "list of names"),
        ({"obstacle_count": 2, "obstacle_materials": ["opaque"]}, "two numbers"),
        ({"obstacle_count": [1.5, 2], "obstacle_materials": ["opaque"]}, "whole numbers"),
        ({"obstacle_count": [2, 2], "obstacle_materials": ["mirror"]}, "mirrors alone"),
        ({"alpha": 0.5}, "two numbers"),
        ({"alpha": ["a", "b"]}, "two numbers"),
        ({"grasp_width": [0.03]}, "two numbers"),
        ({"grasp_width": [0.01, 0.02]}, "0.025..0.07"),
        ({"obstacle_motions": ["rolling"]}, "'driven', 'pushed'"),
        ({"drive_speed": [0.05, 0.2]}, "0.01..0.1"),
        ({"obstacle_push": [0.05, 0.2]}, "0.0..0.1"),
        ({"target_push": [0.05, 0.2]}, "0.0..0.08"),
        ({"distractor": 2}, "0..1"),
        ({"obstacle_looks": "fancy"}, "'usual', 'tinted', 'coloured', 'plain'"),
        ({"room_looks": "fancy"}, "'usual', 'tinted', 'coloured', 'plain'"),
        ({"target_hue_deg": 200}, "0..180"),
        ({"light_slant": -1}, "0..20"),
        (7, "name or a mapping"),
    ],
)
def test_a_bad_scenario_is_refused_with_what_is_allowed(scenario, message):
    with pytest.raises(ValueError, match=message):
        resolve_scenario(scenario)


def test_an_unknown_noise_preset_lists_the_presets():
    with pytest.raises(ValueError, match="ideal, nominal, conservative"):
        resolve_sensor_noise("loud")
