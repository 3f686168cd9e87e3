"""Distance of a target that something in front covers and uncovers."""

import numpy as np
import pytest
from pinhole_scene import Scene, noise_texture, upright
from test_pipeline_and_zero_flow import CAMERA, RED, TARGET, circling, frames

from fixation_gym.perception import Perception, segment
from fixation_gym.perception.distance import following, own_motion
from fixation_gym.perception.distance.calibrating_estimator import CalibratingEstimator
from fixation_gym.perception.distance.covering import slide


def red_box(left, right, top=60, bottom=100):
    image = np.full((CAMERA.height, CAMERA.width, 3), 90, np.uint8)
    image[top:bottom, left:right] = 200, 20, 20
    return segment(image, CAMERA)


def test_a_strip_taken_off_one_side_slides_the_centroid_by_its_share():
    whole, covered = red_box(80, 120), red_box(84, 120)
    moved = np.linalg.norm(covered.centroid - whole.centroid)
    assert slide(whole, covered, 1.0, 0.0, 1e-6) == pytest.approx(3.0 * moved, rel=0.15)


def test_coming_nearer_and_turning_do_not_count_as_covering():
    far, near = red_box(90, 110, 70, 90), red_box(80, 120)
    assert slide(far, near, 2.0, 0.0, 0.04) < 0.02 * slide(far, near, 1.0, 0.0, 0.04)
    assert slide(red_box(80, 120), red_box(80, 119), 1.0, 0.03, 0.04) == 0.0


def test_a_target_cut_by_the_image_border_says_nothing():
    assert slide(red_box(0, 40), red_box(0, 20), 1.0, 0.0, 0.04) == 0.0


def largest_distance_error(distance_estimator=None):
    """Over a circle of the camera on which a board hides between a fifth and four fifths of the target."""
    scene = Scene(
        [
            upright([0.8, 0, 0], 2, 2, noise_texture(1)),
            upright(TARGET, 0.025, 0.025, noise_texture(2, RED, 0.2), round=True),
            upright([0.3, -0.112, 0.0], 0.1, 0.1, noise_texture(3, (0.4, 0.6, 0.4))),
        ]
    )
    frame, errors = frames(scene, lambda t: circling(2.0 * t)), []
    perception = Perception(CAMERA, estimator=distance_estimator)
    for k in range(80):
        observation, _, _, pose = frame(k)
        percept = perception.update(observation)
        true = pose[:3, 2] @ (TARGET - pose[:3, 3])
        errors.append(abs(percept.fixation.distance_m / true - 1.0))
    return max(errors[15:])


def test_the_distance_holds_while_a_board_covers_most_of_the_target(monkeypatch):
    assert largest_distance_error() < 0.06
    assert largest_distance_error(CalibratingEstimator()) < 0.06
    monkeypatch.setattr(following, "slide", lambda *_: 0.0)
    monkeypatch.setattr(own_motion, "contradiction", lambda *_: None)
    assert largest_distance_error() > 0.1  # what the centroid alone makes of it
