"""OpenCV's mean shift on made-up images: which of two things of one colour is the target."""

import math

import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.detection.mean_shift import Window, expected_in, shifted
from fixation_gym.perception.detection.tracking import FIRST_LOOK, NOWHERE, TrackingSettings

CAMERA = Intrinsics.from_fovy(120, 160, math.radians(60.0))
SETTINGS = TrackingSettings()


def squares(*corners):
    """Squares of 20 px with these left upper corners."""
    image = np.zeros((120, 160), np.uint8)
    for left, top in corners:
        image[top : top + 20, left : left + 20] = 1
    return image


def test_the_window_stays_on_its_thing_while_another_passes_below():
    window = Window((20, 20, 20, 20), 0.0)
    for step in range(20):
        window = shifted(window, squares((20 + 5 * step, 20), (115 - 5 * step, 50)))
    assert np.abs(np.subtract(window.box, (115, 20, 20, 20))).max() <= 2  # mean shift stops near the peak


def test_the_target_is_expected_at_the_centre_of_its_window():
    expected = expected_in(Window((100, 50, 20, 20), 0.0), squares((100, 50)), CAMERA, 0.04, SETTINGS)
    centre = ((109.5 - CAMERA.cx) / CAMERA.fx, (59.5 - CAMERA.cy) / CAMERA.fy)
    np.testing.assert_allclose(expected.centroid, centre)
    assert SETTINGS.slack < expected.reach < SETTINGS.slack + math.hypot(20, 20) / CAMERA.fx


def test_a_hidden_target_is_not_taken_for_the_other_thing_until_it_is_forgotten():
    window, only_the_other = Window((20, 20, 20, 20), 1.0), squares((120, 90))
    window = shifted(window, only_the_other)
    assert window.box == (20, 20, 20, 20)
    assert expected_in(window, only_the_other, CAMERA, 2.0, SETTINGS) is NOWHERE
    assert expected_in(window, only_the_other, CAMERA, 1.1 + SETTINGS.forget_s, SETTINGS) is FIRST_LOOK
    assert expected_in(None, only_the_other, CAMERA, 2.0, SETTINGS) is FIRST_LOOK
