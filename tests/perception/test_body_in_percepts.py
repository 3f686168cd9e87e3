"""The target's body in what perception says: where the centre is, and when it is left out."""

import numpy as np
import pytest
from test_upright_body import CAMERA, TABLE, approach, mask_of, surface

from fixation_gym.geometry.rigid import matrix_to_pose
from fixation_gym.perception.pipeline import Perception
from fixation_gym.perception.settings import PerceptionSettings
from fixation_gym.types import Observation

HALF_SIZES = (0.03, 0.03, 0.04)
CENTRE = np.array([0.5, -0.1, TABLE + HALF_SIZES[2]])
POSES = approach(CENTRE, 50)


RED = np.array([200, 10, 10], np.uint8)
GREY = np.full((240, 320, 3), 128, np.uint8)


def observation(time, rgb, pose):
    return Observation(time, rgb, np.zeros(7), np.zeros(7), matrix_to_pose(pose), np.zeros(6), 0.08)


def approached(settings=None, support_height=TABLE):
    """Perception that saw a red cylinder on a grey table until 1.96 s."""
    perception = Perception(CAMERA, settings, support_height_m=support_height)
    points = surface("cylinder", HALF_SIZES, 0.0, CENTRE)
    for index, pose in enumerate(POSES[:-1]):
        rgb = np.where(mask_of(points, pose)[..., None], RED, GREY)
        perception.update(observation(0.04 * index, rgb, pose))
    return perception


def percept_after_an_approach(settings=None, support_height=TABLE):
    rgb = np.where(mask_of(surface("cylinder", HALF_SIZES, 0.0, CENTRE), POSES[-1])[..., None], RED, GREY)
    return approached(settings, support_height).update(observation(2.0, rgb, POSES[-1]))


def test_the_grasped_point_is_the_centre_of_the_body_and_not_of_the_surface_in_view():
    percept = percept_after_an_approach()
    assert percept.body is not None
    assert np.linalg.norm(percept.centre_base - CENTRE) < 0.002
    assert np.linalg.norm(percept.fixation.point_base - CENTRE) > 0.005
    axis = POSES[-1][:3, 2]
    reach = HALF_SIZES[0] * np.hypot(axis[0], axis[1]) + HALF_SIZES[2] * abs(axis[2])
    assert percept.reach_towards(POSES[-1]) == pytest.approx(reach, abs=0.001)


def test_the_body_of_a_hidden_target_is_not_believed_for_long():
    perception = approached()
    for wait, believed in ((0.04, True), (0.9, True), (1.2, False)):
        assert (perception.update(observation(2.0 + wait, GREY, POSES[-1])).body is not None) == believed


@pytest.mark.parametrize(
    ("settings", "support_height"),
    [
        (None, None),
        (PerceptionSettings(centre=None), TABLE),
    ],
)
def test_without_table_or_by_choice_the_fixated_point_stands_in(settings, support_height):
    percept = percept_after_an_approach(settings, support_height)
    assert percept.body is None
    np.testing.assert_array_equal(percept.centre_base, percept.fixation.point_base)
    assert percept.reach_towards(POSES[-1]) is None
