"""Distance from the ratio of rotation and translation: right and wrong twists, a hidden target, a drifting gaze."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pinhole_scene import Scene, fixating_pose, noise_texture, observe, upright

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.twist import mean_twist
from fixation_gym.perception import Perception, PerceptionSettings
from fixation_gym.perception.distance.estimator import TwistEstimator
from fixation_gym.perception.distance.fixation_constraint import ConstraintSettings, advance, gaze_drift

CAMERA = Intrinsics.from_fovy(96, 128, np.deg2rad(42.5))
TARGET = np.array([0.35, 0.0, 0.0])
DT = 0.04
CONSTRAINED = PerceptionSettings()
SETTINGS = ConstraintSettings()
STD = np.array([SETTINGS.velocity_std] * 3 + [SETTINGS.rate_std] * 3)
BALL = upright(TARGET, 0.025, 0.025, noise_texture(2, (0.85, 0.08, 0.08), 0.2), round=True)
WALL = upright([0.8, 0, 0], 2, 2, noise_texture(1))


def circling(t):
    return fixating_pose([0.02 * t, 0.03 * np.cos(2 * t), 0.03 * np.sin(2 * t)], TARGET)


@cache
def frame(k, visible=True):
    """Observation with the exact twist, and the true depth of the target."""
    pose = circling(k * DT)
    scene = Scene([WALL, BALL] if visible else [WALL])
    observation, _, _ = observe(scene, pose, k * DT, CAMERA)
    twist = mean_twist(circling(k * DT - 1e-3), circling(k * DT + 1e-3), 2e-3)
    return replace(observation, camera_twist=twist), float(pose[:3, 2] @ (TARGET - pose[:3, 3]))


def follow(perception, ks, visible=True, rotation=1.0, rng=None):
    for k in ks:
        observation, depth = frame(k, visible)
        twist = observation.camera_twist * np.array([1.0] * 3 + [rotation] * 3)
        if rng is not None:
            twist = twist + STD * rng.standard_normal(6)
        percept = perception.update(replace(observation, camera_twist=twist))
    return percept.fixation, depth


@pytest.mark.parametrize("rotation", [1.0, 1.1, 0.9])
def test_the_distance_is_the_ratio_of_translation_and_rotation_whatever_the_poses_say(rotation):
    fixation, depth = follow(Perception(CAMERA, CONSTRAINED, estimator=TwistEstimator()), range(75), rotation=rotation)
    assert fixation.distance_m == pytest.approx(depth / rotation, rel=0.02)
    np.testing.assert_allclose(fixation.point_base[1:], TARGET[1:], atol=0.01)


def test_noisy_twists_give_the_distance_within_the_stated_error():
    errors = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        fixation, depth = follow(Perception(CAMERA, CONSTRAINED, estimator=TwistEstimator()), range(75), rng=rng)
        assert fixation.distance_std_m < 0.03 * depth
        errors.append((fixation.distance_m - depth) / fixation.distance_std_m)
    assert np.mean(np.square(errors)) < 4.0


def test_a_hidden_target_stays_where_it_was_and_the_filter_goes_on_from_there():
    perception = Perception(CAMERA, CONSTRAINED, estimator=TwistEstimator())
    before, _ = follow(perception, range(60))
    hidden, depth = follow(perception, range(60, 75), visible=False)
    assert not hidden.visible
    assert hidden.distance_m == pytest.approx(depth, rel=0.03)
    assert hidden.distance_std_m > before.distance_std_m
    back, depth = follow(perception, range(75, 78))
    assert back.visible
    assert back.distance_m == pytest.approx(depth, rel=0.05)
    assert back.distance_std_m < 2.0 * hidden.distance_std_m


def test_an_estimate_beyond_reach_begins_again_and_comes_back():
    perception = Perception(CAMERA, CONSTRAINED, estimator=TwistEstimator())
    follow(perception, range(25))
    lost, _ = follow(perception, range(25, 50), rotation=0.0)  # translation without rotation: infinitely far
    assert lost.distance_m == pytest.approx(CONSTRAINED.distance.initial_distance_m, rel=0.2)
    assert lost.distance_std_m > 0.2
    fixation, depth = follow(perception, range(50, 85))
    assert fixation.distance_m == pytest.approx(depth, rel=0.05)


def test_a_gaze_that_swings_to_the_target_says_nothing_about_its_distance():
    swing = np.array([0.0, 0.0, 0.0, 0.0, 0.5, 0.0])  # turning right at rest: the constraint would have d = infinity
    gaze = None
    for k in range(8):
        gaze = advance(gaze, np.array([0.3 - 0.5 * k * DT, 0.0]), swing, DT, (0.5, 0.3), SETTINGS)
    assert gaze.filter.mean[-1] == pytest.approx(2.0, rel=0.3)
    assert np.sqrt(gaze.filter.cov[-1, -1]) > 0.8
    np.testing.assert_allclose(gaze.drift, [0.5, 0.0], atol=0.01)


def test_drift_is_what_exceeds_noise_and_fades():
    here, std = np.zeros(2), 1e-3
    assert not gaze_drift(np.zeros(2), here, here + 2 * std, DT, std).any()
    drift = gaze_drift(np.zeros(2), here, np.array([0.02, 0.0]), DT, std)
    np.testing.assert_allclose(drift, [0.5, 0.0], atol=0.01)
    np.testing.assert_allclose(gaze_drift(drift, here, here, DT, std), 0.8 * drift)
    np.testing.assert_array_equal(gaze_drift(drift, None, here, DT, std), drift)
