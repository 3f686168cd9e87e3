"""Every distance estimator behind the same door, on rendered images of a known scene."""

from functools import partial

import numpy as np
import pytest
from test_fixation_constraint import CAMERA, DT, circling, follow

from fixation_gym.perception import Perception
from fixation_gym.perception.distance.calibrating_estimator import CalibratingEstimator
from fixation_gym.perception.distance.estimator import (
    FlowEstimator,
    PoseEstimator,
    TwistEstimator,
    inverse_distance,
)

ESTIMATORS = {
    "pose": (PoseEstimator, 0.02),
    "twist": (TwistEstimator, 0.06),
    "hard": (partial(FlowEstimator, "hard"), 0.06),
    "free": (partial(FlowEstimator, "free"), 0.6),  # flow at outlines is half the background's, and nothing else counts
    "calibrating": (CalibratingEstimator, 0.03),
}


@pytest.mark.parametrize("name", ESTIMATORS)
def test_every_estimator_finds_the_distance_from_images(name):
    make, error = ESTIMATORS[name]
    fixation, depth = follow(Perception(CAMERA, estimator=make()), range(75))
    assert fixation.visible
    assert fixation.distance_m == pytest.approx(depth, rel=error)
    assert 0.0 < fixation.distance_std_m < 0.5 * depth


def test_a_stranger_s_estimator_that_fails_is_named():
    class Broken(PoseEstimator):
        def add_frame(self, frame):
            raise ZeroDivisionError("my own fault")

    with pytest.raises(RuntimeError, match=r"the distance estimator .*Broken failed: ZeroDivisionError: my own fault"):
        follow(Perception(CAMERA, estimator=Broken()), range(2))


@pytest.mark.parametrize("name", ESTIMATORS)
def test_before_the_first_sight_and_after_a_reset_every_estimator_has_the_first_guess(name):
    estimator = ESTIMATORS[name][0]()
    before = estimator.fixation(np.eye(4), None)
    assert not before.initialised
    assert inverse_distance(estimator, np.eye(4)) == (0.0, 0.0)
    perception = Perception(CAMERA, estimator=estimator)
    follow(perception, range(20))
    assert estimator.fixation(np.eye(4), None).initialised
    perception.reset()
    assert estimator.fixation(np.eye(4), None).distance_m == before.distance_m


@pytest.mark.parametrize("name", ESTIMATORS)
def test_every_estimator_answers_the_same_again(name):
    perception = Perception(CAMERA, estimator=ESTIMATORS[name][0]())
    first, _ = follow(perception, range(30))
    perception.reset()
    again, _ = follow(perception, range(30))
    assert first.distance_m == again.distance_m
    assert first.distance_std_m == again.distance_std_m


@pytest.mark.parametrize("name", ESTIMATORS)
def test_every_estimator_answers_for_another_camera(name):
    estimator = ESTIMATORS[name][0]()
    fixation, _ = follow(Perception(CAMERA, estimator=estimator), range(30))
    farther = circling(29 * DT)
    farther[:3, 3] -= 0.1 * farther[:3, 2]
    moved = estimator.fixation(farther, None)
    assert not moved.visible
    assert moved.distance_m == pytest.approx(fixation.distance_m + 0.1, abs=1e-3)
    np.testing.assert_allclose(moved.point_base, fixation.point_base, atol=1e-3)
