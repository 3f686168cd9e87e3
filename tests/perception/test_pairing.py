"""A picture that comes late goes with the pose of its time, and what it shows is carried to now."""

from dataclasses import replace

import numpy as np
import pytest
from pinhole_scene import Scene, fixating_pose, noise_texture, observe, upright

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import inverse, matrix_to_pose, rotation_vector, transform
from fixation_gym.geometry.twist import exp_twist
from fixation_gym.perception.pairing import PoseHistory, between
from fixation_gym.perception.pipeline import Perception

CAMERA = Intrinsics.from_fovy(120, 160, 0.74)
TARGET = np.array([0.6, 0.0, 0.2])
SCENE = Scene(
    [
        upright([1.0, 0.0, 0.2], 1.0, 0.8, noise_texture(1)),
        upright(TARGET, 0.05, 0.05, noise_texture(2, (1.0, 0.1, 0.1), 0.2)),
        upright([0.35, 0.08, 0.2], 0.02, 0.05, noise_texture(3)),
    ]
)
TWIST = np.array([0.1, 0.02, 0.0, 0.03, -0.1, 0.0])
PERIOD, AGE, START = 0.04, 0.07, 1.0


def pose_at(time):
    """A camera of constant twist, at rest before ``START``."""
    return fixating_pose([0.0, 0.03, 0.2], TARGET) @ exp_twist(TWIST, max(time - START, 0.0))


def taken(time):
    observation, _, _ = observe(SCENE, pose_at(time), round(time, 3), CAMERA)
    return replace(observation, camera_twist=TWIST)


def late(time, age=AGE):
    """What the robot gets: pose and twist of now, the picture of ``age`` before."""
    picture, now = taken(time - age), matrix_to_pose(pose_at(time))
    return replace(picture, time=time, camera_pose=now, image_time=time - age)


def test_late_pictures_give_the_map_and_the_place_that_pictures_in_time_give():
    in_time, behind = Perception(CAMERA), Perception(CAMERA)
    for step in range(24):
        now = START + PERIOD * step
        first, second = in_time.update(taken(now - AGE)), behind.update(late(now))
    assert second.time == pytest.approx(now)
    assert second.flow.time == pytest.approx(first.flow.time)
    assert np.mean(first.zfc.cells != second.zfc.cells) < 0.01
    np.testing.assert_allclose(second.fixation.point_base, first.fixation.point_base, atol=1e-3)
    # The fixation is that of now, though nothing was seen since.
    seen = transform(inverse(pose_at(now)), TARGET)
    np.testing.assert_allclose(second.fixation.centroid, seen[:2] / seen[2], atol=3e-3)
    believed = transform(inverse(pose_at(now)), second.fixation.point_base)
    assert second.fixation.distance_m == pytest.approx(believed[2], rel=2e-3)
    assert np.linalg.norm(second.fixation.centroid - first.fixation.centroid) > 3e-3


def test_a_picture_that_was_there_before_tells_nothing_twice_and_gets_too_old():
    perception = Perception(CAMERA)
    for step in range(8):
        newest = perception.update(late(START + PERIOD * step))
    image_time = START + PERIOD * 7 - AGE
    for step in range(8, 20):
        now = START + PERIOD * step
        again = replace(late(START + PERIOD * 7), time=now, camera_pose=matrix_to_pose(pose_at(now)))
        percept = perception.update(again)
        assert percept.flow is newest.flow
        assert percept.fixation.visible == (now - image_time < 0.3)
        seen = transform(inverse(pose_at(now)), percept.fixation.point_base)
        assert percept.fixation.distance_m == pytest.approx(seen[2], rel=0.01)


def test_poses_between_readings_follow_the_motion():
    history = PoseHistory()
    for time in (START, START + 0.04, START + 0.1):
        observation = replace(taken(0.0), time=time, camera_pose=matrix_to_pose(pose_at(time)))
        history = history.with_reading(observation)
    for time in (START + 0.01, START + 0.04, START + 0.075):
        np.testing.assert_allclose(history.at(time)[0], pose_at(time), atol=1e-9)
    np.testing.assert_allclose(history.at(0.0)[0], pose_at(START), atol=1e-9)
    np.testing.assert_allclose(history.at(9.0)[0], pose_at(START + 0.1), atol=1e-9)
    with pytest.raises(ValueError, match="time must increase"):
        history.with_reading(observation)
    assert len(history.with_reading(replace(observation, time=5.0)).times) == 1


def test_a_picture_of_now_is_taken_as_without_a_stamp():
    plain, stamped = Perception(CAMERA), Perception(CAMERA)
    for step in range(6):
        observation = taken(PERIOD * step)
        first = plain.update(observation)
        second = stamped.update(replace(observation, image_time=observation.time))
    np.testing.assert_array_equal(first.zfc.cells, second.zfc.cells)
    np.testing.assert_array_equal(first.fixation.point_base, second.fixation.point_base)


def test_a_bad_reading_is_refused_and_leaves_no_trace():
    perception, other = Perception(CAMERA), Perception(CAMERA)
    for step in range(4):
        good = late(START + PERIOD * step)
        perception.update(good)
        other.update(good)
    good = late(START + PERIOD * 4)
    for bad, message in (
        (replace(good, camera_pose=np.full(7, np.nan)), "camera_pose must be a finite"),
        (replace(good, rgb=np.zeros((5, 5, 3), np.uint8)), "rgb is uint8 of shape"),
        (replace(good, image_time=good.time + 5.0), "image_time must not be later than time"),
    ):
        with pytest.raises(ValueError, match=message):
            perception.update(bad)
    again, expected = perception.update(good), other.update(good)
    np.testing.assert_array_equal(again.fixation.point_base, expected.fixation.point_base)
    np.testing.assert_array_equal(again.zfc.cells, expected.zfc.cells)


def test_a_pose_between_readings_keeps_up_with_an_arm_that_speeds_up():
    """Truth by small steps of a twist that changes at a constant rate, as from one command of the servo to the next."""
    rate, duration, steps = np.array([1.0, -0.6, 0.8, 0.5, 2.0, -0.8]), 0.04, 400

    def path(share):
        pose = pose_at(START)
        for step in range(round(share * steps)):
            pose = pose @ exp_twist(TWIST + rate * duration * (step + 0.5) / steps, duration / steps)
        return pose

    ends, twists = (path(0.0), path(1.0)), (TWIST, TWIST + rate * duration)
    for share in (0.25, 0.5, 0.625, 0.75):
        error = inverse(path(share)) @ between(ends, twists, duration, share)
        assert np.linalg.norm(error[:3, 3]) < 2e-6
        assert np.linalg.norm(rotation_vector(error[:3, :3])) < 1e-5
    unmeasured = between(ends, (twists[0], np.full(6, np.nan)), duration, 0.5)
    missed = inverse(path(0.5)) @ unmeasured
    assert 1e-4 < np.linalg.norm(missed[:3, 3]) < 4e-4
    np.testing.assert_allclose(between(ends, twists, duration, 1.0), ends[1], atol=1e-12)
