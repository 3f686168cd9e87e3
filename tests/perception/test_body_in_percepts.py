"""The target's body in what perception says: where the centre is, and when it is left out."""

import numpy as np
import pytest
from test_upright_body import CAMERA, TABLE, approach, mask_of, surface

from fixation_gym.geometry.rigid import matrix_to_pose
from fixation_gym.perception.fixation_constraint import ConstraintSettings
from fixation_gym.perception.pipeline import Perception, PerceptionSettings
from fixation_gym.types import Observation

HALF_SIZES = (0.03, 0.03, 0.04)
CENTRE = np.array([0.5, -0.1, TABLE + HALF_SIZES[2]])
POSES = approach(CENTRE, 50)


def percept_after_an_approach(settings=None, support_height=TABLE):
    """Of a red cylinder on a table of no colour."""
    perception = Perception(CAMERA, settings, support_height_m=support_height)
    points = surface("cylinder", HALF_SIZES, 0.0, CENTRE)
    for index, pose in enumerate(POSES):
        rgb = np.where(mask_of(points, pose)[..., None], np.array([200, 10, 10]), 128).astype(np.uint8)
        time, still = 0.04 * index, np.zeros(7)
        percept = perception.update(Observation(time, rgb, still, still, matrix_to_pose(pose), np.zeros(6), 0.08))
    return percept


def test_the_grasped_point_is_the_centre_of_the_body_and_not_of_the_surface_in_view():
    percept = percept_after_an_approach()
    assert percept.body is not None
    assert np.linalg.norm(percept.centre_base - CENTRE) < 0.002
    assert np.linalg.norm(percept.fixation.point_base - CENTRE) > 0.005
    axis = POSES[-1][:3, 2]
    reach = HALF_SIZES[0] * np.hypot(axis[0], axis[1]) + HALF_SIZES[2] * abs(axis[2])
    assert percept.reach_towards(POSES[-1]) == pytest.approx(reach, abs=0.001)


@pytest.mark.parametrize(
    ("settings", "support_height"),
    [
        (None, None),
        (PerceptionSettings(centre=None), TABLE),
        (PerceptionSettings(constraint=ConstraintSettings()), TABLE),
    ],
)
def test_without_table_or_by_choice_the_fixated_point_stands_in(settings, support_height):
    percept = percept_after_an_approach(settings, support_height)
    assert percept.body is None
    np.testing.assert_array_equal(percept.centre_base, percept.fixation.point_base)
    assert percept.reach_towards(POSES[-1]) is None
