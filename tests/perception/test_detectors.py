"""The door for detectors: what they are told, what they may return, and how their faults are reported."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception import ColourDetector, GivenMasks, Perception
from fixation_gym.perception.detection.box_tracker import BoxTracker
from fixation_gym.perception.detection.detector import Sighting
from fixation_gym.perception.detection.first_look import checked_box
from fixation_gym.perception.detection.mean_shift import MeanShiftDetector
from fixation_gym.perception.detection.tracking import FIRST_LOOK, Expectation
from fixation_gym.types import Observation

CAMERA = Intrinsics.from_fovy(120, 160, 0.7)
POSE = np.array([0.4, 0.0, 0.5, 0.0, 1.0, 0.0, 0.0])


def observation(rgb, time=0.0, **more):
    return Observation(time, rgb, np.zeros(7), np.zeros(7), POSE, np.zeros(6), 0.08, **more)


def grass(seed=0):
    """A background of greens and greys."""
    rng = np.random.default_rng(seed)
    coarse = rng.integers(60, 140, (12, 16, 1)) + np.array([-20, 15, -30]) * rng.integers(0, 2, (12, 16, 1))
    fine = cv2.resize(coarse.astype(np.float32), (160, 120), interpolation=cv2.INTER_CUBIC)
    return np.clip(fine + rng.normal(0, 4, fine.shape), 0, 255).astype(np.uint8)


def with_disc(image, centre, radius=12, colour=(40, 70, 180)):
    drawn = image.copy()
    cv2.circle(drawn, centre, radius, colour, -1)
    cv2.circle(drawn, (centre[0] - 3, centre[1] - 3), radius // 3, (200, 190, 60), -1)
    return drawn


def box_around(centre, radius=12):
    return np.array([centre[0] - radius - 1, centre[1] - radius - 1, 2 * radius + 3, 2 * radius + 3], float)


class Whole:
    """A stranger's detector: everything is the target."""

    def reset(self):
        self.expectations = []

    def detect(self, observation, expected):
        self.expectations.append(expected)
        return np.ones(observation.rgb.shape[:2], np.bool_)


def test_a_stranger_s_mask_is_what_perception_works_on_and_it_hears_where_the_target_should_be():
    mine = Whole()
    perception = Perception(CAMERA, detector=mine)
    for step in range(2):
        percept = perception.update(observation(grass(), 0.04 * step))
    assert percept.segmentation.area_fraction == 1.0
    assert percept.segmentation.touches_border
    np.testing.assert_allclose(percept.segmentation.centroid, 0.0, atol=1e-9)
    assert [math.isinf(expected.reach) for expected in mine.expectations] == [True, False]


@pytest.mark.parametrize(
    ("answer", "found"),
    [
        (np.ones((120, 160)), "float64 of shape (120, 160)"),
        (np.ones((160, 120), np.bool_), "bool of shape (160, 120)"),
        ([[True]], "list"),
        (None, "NoneType"),
    ],
)
def test_an_answer_that_is_no_mask_of_the_image_is_refused_in_one_sentence(answer, found):
    class Wrong(Whole):
        def detect(self, observation, expected):
            return answer

    with pytest.raises(ValueError, match=r"Wrong must return a bool array of shape \(120, 160\), got ") as error:
        Perception(CAMERA, detector=Wrong()).update(observation(grass()))
    assert str(error.value).endswith(found)


def test_a_detector_that_follows_a_point_says_where_it_is_and_how_surely():
    class Pointing(Whole):
        point, std = np.array([0.1, -0.05]), 1e-3

        def detect(self, observation, expected):
            return Sighting(super().detect(observation, expected), self.point, self.std)

    pointing = Pointing()
    seen = Perception(CAMERA, detector=pointing).update(observation(grass())).segmentation
    np.testing.assert_array_equal(seen.centroid, [0.1, -0.05])
    assert seen.centroid_std == 1e-3
    for pointing.point, pointing.std in ((np.zeros(3), 1e-3), (np.array([np.nan, 0.0]), 1e-3), (np.zeros(2), 0.0)):
        with pytest.raises(ValueError, match="Pointing must give a finite point"):
            Perception(CAMERA, detector=pointing).update(observation(grass()))


def test_a_stranger_s_exception_keeps_its_traceback_and_says_whose_code_it_was():
    class Broken(Whole):
        def detect(self, observation, expected):
            raise ZeroDivisionError("my own fault")

    with pytest.raises(RuntimeError, match=r"the detector .*Broken failed: ZeroDivisionError: my own fault") as error:
        Perception(CAMERA, detector=Broken()).update(observation(grass()))
    assert isinstance(error.value.__cause__, ZeroDivisionError)
    assert error.value.__cause__.__traceback__ is not None


def test_masks_from_outside_come_with_the_observation_and_stay_writable():
    mask = np.zeros((120, 160), np.bool_)
    mask[30:50, 100:120] = True
    perception = Perception(CAMERA, detector=GivenMasks())
    percept = perception.update(observation(grass(), mask=mask))
    np.testing.assert_allclose(percept.segmentation.centroid, CAMERA.normalise(np.array([109.5, 39.5])))
    mask[:] = False
    assert percept.segmentation.mask.sum() == 400
    assert not perception.update(observation(grass(), 0.04, mask=mask)).segmentation.visible
    with pytest.raises(ValueError, match="has no mask"):
        perception.update(observation(grass(), 0.08))


def test_what_a_box_shows_is_followed_through_the_image_whatever_its_colour():
    tracker, place = BoxTracker(CAMERA), (60, 60)
    tracker.detect(observation(with_disc(grass(), place), target_box=box_around(place)), FIRST_LOOK)
    for step in range(1, 30):
        place = (60 + 2 * step, 60 + step)
        image = with_disc(with_disc(grass(), place), (30, 20), colour=(180, 60, 40))
        expected = Expectation(CAMERA.normalise(np.array(place) - 2.0), 0.1, 6.0 / CAMERA.fx)
        mask = tracker.detect(observation(image, 0.04 * step), expected)
        truth = np.zeros_like(mask, np.uint8)
        cv2.circle(truth, place, 12, 1, -1)
        overlap = np.count_nonzero(mask & (truth > 0)) / np.count_nonzero(mask | (truth > 0))
        assert overlap > 0.8, step


def test_a_hidden_target_is_not_seen_elsewhere():
    tracker, place = BoxTracker(CAMERA), (80, 60)
    tracker.detect(observation(with_disc(grass(), place), target_box=box_around(place)), FIRST_LOOK)
    expected = Expectation(CAMERA.normalise(np.array(place, float)), 0.1, 6.0 / CAMERA.fx)
    assert tracker.detect(observation(grass(), 0.04), expected).sum() < 20
    away = Expectation(np.array([3.0, 0.0]), 0.1, 6.0 / CAMERA.fx)
    assert not tracker.detect(observation(with_disc(grass(), place), 0.08), away).any()


@pytest.mark.parametrize(
    ("box", "problem"),
    [
        (None, "must be x, y, width, height"),
        (np.array([1.0, 2.0, 3.0]), "must be x, y, width, height"),
        (np.array([1.0, np.nan, 3.0, 3.0]), "must be x, y, width, height"),
        (np.array([200.0, 10.0, 20.0, 20.0]), "at least 3 x 3 px"),
        (np.array([10.0, 10.0, 0.0, 0.0]), "at least 3 x 3 px"),
    ],
)
def test_a_box_outside_the_image_or_around_nothing_is_refused(box, problem):
    with pytest.raises(ValueError, match=rf"target_box .*{problem}.*160 x 120"):
        checked_box(box, CAMERA)


def test_a_box_that_reaches_beyond_the_image_is_cut():
    assert checked_box(np.array([-5.0, 100.4, 20.0, 40.0]), CAMERA) == (0, 100, 15, 20)


@pytest.mark.parametrize("detector", [ColourDetector(CAMERA), MeanShiftDetector(CAMERA), BoxTracker(CAMERA)])
def test_detectors_leave_the_image_as_it_is_and_answer_the_same_after_a_reset(detector):
    image = with_disc(grass(), (70, 50), colour=(200, 20, 20))
    image.setflags(write=False)
    answers = []
    for _ in range(2):
        detector.reset()
        first = observation(image, target_box=box_around((70, 50)))
        detector.detect(first, FIRST_LOOK)
        answers.append(detector.detect(replace(first, time=0.04), FIRST_LOOK))
    np.testing.assert_array_equal(*answers)
    assert answers[0].dtype == np.bool_
    assert answers[0].shape == image.shape[:2]
    assert answers[0].any()
