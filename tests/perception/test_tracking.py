"""Which of two red things is the target, with the truth known."""

import cv2
import numpy as np
import pytest

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import inverse, look_at, matrix_to_pose, transform
from fixation_gym.perception import Perception
from fixation_gym.perception.detection.colour import segment
from fixation_gym.perception.detection.tracking import FIRST_LOOK, TrackingSettings, expected_at, followed
from fixation_gym.types import Observation

CAMERA = Intrinsics.from_fovy(120, 160, np.deg2rad(42.5))
SETTINGS = TrackingSettings()
RED, GREY = (190, 25, 20), (120, 120, 120)
TARGET, OTHER = np.array([0.5, 0.0, 0.0]), np.array([0.55, -0.13, 0.0])
UP = np.array([0.0, 0.0, 1.0])


def image_point(point, T_base_cam):
    x, y, z = transform(inverse(T_base_cam), point)
    return np.array([x / z, y / z])


def pose_at(time):
    """A camera that goes round the target while its gaze wanders."""
    angle = 0.5 + 0.3 * time
    position = TARGET + 0.4 * np.array([-np.cos(angle), -np.sin(angle), 1.0])
    return look_at(position, TARGET + 0.02 * np.array([np.sin(3.0 * time), np.cos(3.0 * time), 0.0]), UP)


def picture(time, hidden=False, moved=(0.0, 0.0, 0.0)):
    """Two red balls, the target being the smaller one."""
    image = np.full((120, 160, 3), GREY, np.uint8)
    balls = [(OTHER, 0.04)] if hidden else [(OTHER, 0.04), (TARGET + moved, 0.02)]
    for centre, radius in balls:
        pose = pose_at(time)
        depth = pose[:3, 2] @ (centre - pose[:3, 3])
        place = np.append(image_point(centre, pose), 1.0)
        cv2.circle(
            image, np.rint(CAMERA.project(place)).astype(int).tolist(), round(CAMERA.fx * radius / depth), RED, -1
        )
    return image


def look(perception, time, image):
    observation = Observation(
        time, image, np.zeros(7), np.zeros(7), matrix_to_pose(pose_at(time)), np.zeros(6), gripper_width=0.08
    )
    return perception.update(observation).segmentation


def watch(hidden, seconds, moved_at=np.inf):
    """What a perception that follows the two balls sees at last."""
    perception, last = Perception(CAMERA), round(seconds / 0.04)

    def show(time):
        moved = np.array([0.15, 0.0, 0.0]) * np.clip(time - moved_at, 0.0, 0.5)
        return look(perception, time, picture(time, hidden(time), moved)), TARGET + moved

    return [show(0.04 * k) for k in range(last + 1)][-1]


def test_at_first_sight_the_smaller_thing_near_the_image_centre_is_the_target():
    assert segment(picture(0.0), CAMERA).centroid == pytest.approx(image_point(OTHER, pose_at(0.0)), abs=0.01)
    seen = look(Perception(CAMERA), 0.0, picture(0.0))
    assert seen.centroid == pytest.approx(image_point(TARGET, pose_at(0.0)), abs=0.01)


def test_while_the_target_is_hidden_the_other_thing_is_not_taken_for_it():
    seen, _ = watch(lambda time: time > 1.0, 2.4)
    assert not seen.visible


def test_after_an_occlusion_the_target_is_seen_again():
    seen, target = watch(lambda time: 0.6 < time < 1.8, 2.4)
    assert seen.centroid == pytest.approx(image_point(target, pose_at(2.4)), abs=0.01)


@pytest.mark.parametrize("hides", [False, True])
def test_a_pushed_target_is_followed_also_if_it_is_hidden_meanwhile(hides):
    seen, target = watch(lambda time: hides and 1.0 < time < 1.7, 2.0, moved_at=1.0)
    assert seen.centroid == pytest.approx(image_point(target, pose_at(2.0)), abs=0.01)


def test_the_expected_place_of_a_thing_at_rest_is_exact_for_any_motion():
    first, later = pose_at(0.0), pose_at(1.3)
    seen = segment(picture(0.0), CAMERA, expected=FIRST_LOOK)
    depth = float(first[:3, 2] @ (TARGET - first[:3, 3]))
    expected = expected_at(followed(seen, depth, first, 0.0), later, 1.3, SETTINGS)
    truth = image_point(transform(first, depth * np.append(seen.centroid, 1.0)), later)
    assert expected.centroid == pytest.approx(truth, abs=1e-9)
    assert expected.centroid == pytest.approx(image_point(TARGET, later), abs=0.01)


def test_the_longer_it_is_hidden_the_farther_off_it_may_be_until_it_may_be_anywhere():
    pose = pose_at(0.0)
    track = followed(segment(picture(0.0), CAMERA), 0.57, pose, 0.0)
    reaches = [expected_at(track, pose, time, SETTINGS).reach for time in (0.0, 0.2, 0.4, 3.0)]
    assert np.all(np.diff(reaches) > 0.0)
    assert reaches[-1] - reaches[0] == pytest.approx(SETTINGS.largest_move_m / 0.57)
    assert expected_at(track, pose, SETTINGS.forget_s + 0.1, SETTINGS).reach == np.inf
