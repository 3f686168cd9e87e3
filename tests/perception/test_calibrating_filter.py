"""The pose filter with calibration states: exact without noise, sure only of what it can know, and hard to upset."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pinhole_scene import fixating_pose
from scipy.spatial.transform import Rotation

from fixation_gym.geometry.rigid import inverse, transform
from fixation_gym.geometry.twist import exp_twist, mean_twist
from fixation_gym.perception.distance.calibrating_filter import (
    CalibratingSettings,
    advance,
    distance_at,
    noise_scale,
    with_last_twist,
)
from fixation_gym.perception.distance.calibration_model import AGE, FOCAL, TWIST, Sighting

DT = 0.04
POSE_COV = np.diag([1e-4] * 3 + [2e-4] * 3) ** 2
SETTINGS = CalibratingSettings(hand_eye_m=1e-3, hand_eye_rad=2e-3, image_age_s=0.008)
EXACT = CalibratingSettings()


def true_pose(t, distance, amplitude, fixating=True):
    place = np.array([0.0, amplitude * np.sin(t), amplitude * np.cos(t)])
    return fixating_pose(place, [distance if fixating else 1e6, 0.0, 0.0])


def sight(t, distance, amplitude, rng, errors=None, age=0.0, fixating=True, target=None):
    """True pose and what the robot makes of it at time t."""
    pose = true_pose(t, distance, amplitude, fixating)
    target = np.array([distance, 0.0, 0.0]) if target is None else target
    q = transform(inverse(true_pose(t - age, distance, amplitude, fixating)), target)
    noise = np.zeros(6) if rng is None else np.sqrt(np.diag(POSE_COV)) * rng.standard_normal(6)
    noise = noise if errors is None else noise + errors
    believed = pose.copy()
    believed[:3, 3] += pose[:3, :3] @ noise[:3]
    believed[:3, :3] = pose[:3, :3] @ Rotation.from_rotvec(noise[3:]).as_matrix()
    after = true_pose(t + 1e-3, distance, amplitude, fixating)
    before = true_pose(t - 1e-3, distance, amplitude, fixating)
    centroid = q[:2] / q[2] + (0.0 if rng is None else rng.normal(0.0, 1e-4, 2))
    return pose, Sighting(believed, POSE_COV, mean_twist(before, after, 2e-3), centroid)


@cache
def follow(distance, amplitude, seconds=4.0, settings=SETTINGS, seed=0, **options):
    """State, true pose and sighting after some seconds, errors and settings. Shared, so nobody may write."""
    rng = np.random.default_rng(seed)
    errors = np.repeat([settings.hand_eye_m, settings.hand_eye_rad], 3) * rng.standard_normal(6)
    settings = replace(settings, initial_distance_m=distance * 2.0 ** rng.uniform(-1, 1), centroid_std_size=0.0)
    state = None
    for t in np.arange(0.0, seconds, 0.1):
        pose, sighting = sight(t, distance, amplitude, rng, errors, settings.image_age_s, **options)
        state = advance(state, sighting, 0.1, settings)
    for array in (state.mean, state.cov, state.window, pose, sighting.T_base_cam):
        array.flags.writeable = False
    return state, pose, sighting, errors, settings


def test_without_errors_the_distance_is_exact():
    state = None
    for k in range(60):
        pose, sighting = sight(k * DT, 0.4, 0.05, None)
        state = advance(state, sighting, DT, EXACT)
    assert distance_at(state, sighting).robot == pytest.approx(transform(inverse(pose), [0.4, 0, 0])[2], abs=1e-6)
    assert distance_at(state, sighting).lens == pytest.approx(distance_at(state, sighting).robot, abs=1e-9)


@pytest.mark.parametrize(("distance", "amplitude"), [(0.07, 0.02), (2.0, 0.05)])
@pytest.mark.parametrize("fixating", [True, False])
def test_both_distances_have_the_error_they_state(distance, amplitude, fixating):
    nees, errors = [], []
    target = np.array([distance, 0.0, 0.0])
    for seed in range(5):
        state, pose, sighting, hand_eye, _ = follow(distance, amplitude, 3.0, seed=seed, fixating=fixating)
        now = distance_at(state, sighting)
        lens = transform(inverse(pose), target)[2]
        exact = pose @ np.block([[Rotation.from_rotvec(hand_eye[3:]).as_matrix(), hand_eye[:3, None]], [0, 0, 0, 1]])
        robot = transform(inverse(exact), target)[2]
        errors.append(now.robot - robot if fixating else now.lens - lens)
        nees.append([((now.robot - robot) / now.robot_std) ** 2, ((now.lens - lens) / now.lens_std) ** 2])
    low, high = 0.04, 4.1  # chi-square with 5 degrees of freedom, mean, 99.9 % and more
    assert np.all((np.mean(nees, axis=0) > low) & (np.mean(nees, axis=0) < high)), np.mean(nees, axis=0)
    assert np.mean(np.abs(errors)) < 0.02 * distance


def test_fixation_sees_the_distance_from_the_believed_camera_and_translation_the_one_from_the_lens():
    fixating = distance_at(*follow(0.07, 0.02, fixating=True)[0:3:2])
    translating = distance_at(*follow(0.07, 0.02, fixating=False)[0:3:2])
    assert fixating.robot_std < 4e-4 < 8e-4 < fixating.lens_std  # the hand-eye error along the axis stays unknown
    assert translating.lens_std < 4e-4 < 8e-4 < translating.robot_std


def test_innovations_are_consistent_with_the_stated_noise():
    rng, state, nis = np.random.default_rng(3), None, []
    settings = replace(SETTINGS, initial_distance_m=0.3, centroid_std_size=0.0)
    for k in range(150):
        _, sighting = sight(k * DT, 0.4, 0.05, rng)
        state = advance(state, sighting, DT, settings)
        nis.append(state.nis)
    assert 1.6 < np.mean(nis[1:]) < 2.4


@pytest.mark.parametrize("fault", ["lost", "nan centroid", "nan pose", "nan twist"])
def test_faults_for_a_second_make_it_less_sure_and_never_nan(fault):
    state, _, _, _, settings = follow(0.4, 0.05)
    rng, stds = np.random.default_rng(1), []
    for k in range(100, 150):
        _, sighting = sight(k * DT, 0.4, 0.05, rng)
        if 110 <= k < 135:
            nan = np.nan
            changes = {
                "lost": {"centroid": None},
                "nan centroid": {"centroid": np.array([nan, 0.0])},
                "nan pose": {"T_base_cam": np.full((4, 4), nan)},
                "nan twist": {"twist": np.full(6, nan)},
            }
            sighting = replace(sighting, **changes[fault])
        state = advance(state, sighting, DT, settings)
        now = distance_at(state, sighting)
        assert np.isfinite([now.robot, now.robot_std, now.lens, now.lens_std]).all()
        stds.append(now.robot_std)
    assert np.all(np.diff(stds[10:35]) > 0)
    assert stds[34] > 5e-3
    assert stds[-1] < 2e-3
    assert abs(now.robot - 0.4) < 0.02


def test_nothing_is_claimed_before_the_first_sight():
    _, sighting = sight(0.0, 0.4, 0.05, None)
    assert advance(None, replace(sighting, centroid=None), DT, SETTINGS) is None
    assert advance(None, replace(sighting, twist=np.full(6, np.nan)), DT, SETTINGS) is None


def test_dropped_frames_and_jittered_stamps_do_no_harm():
    rng, state = np.random.default_rng(2), None
    settings = replace(SETTINGS, initial_distance_m=0.3, centroid_std_size=0.0)
    for k in range(150):
        if rng.random() < 0.3:
            continue
        _, sighting = sight(k * DT + rng.normal(0.0, 2e-3), 0.4, 0.05, rng)
        state = advance(state, sighting, DT * rng.uniform(-0.2, 2.0), settings)
    now = distance_at(state, sighting)
    assert abs(now.robot - np.hypot(0.4, 0.05)) < 4 * now.robot_std < 0.01


def test_a_single_outlier_changes_nothing_but_the_nis():
    state, _, sighting, _, settings = follow(0.4, 0.05)
    after = advance(state, replace(sighting, centroid=np.array([0.2, -0.1])), DT, settings)
    np.testing.assert_array_equal(after.mean, state.mean)
    assert after.nis > settings.gate
    assert after.rejected == 1


def test_after_a_jump_the_target_is_found_again_within_a_second():
    state, _, _, _, settings = follow(0.4, 0.05)
    target, rng = np.array([0.43, 0.03, 0.02]), np.random.default_rng(5)
    stds = []
    for k in range(100, 126):
        pose, sighting = sight(k * DT, 0.4, 0.05, rng, target=target)
        state = advance(state, sighting, DT, settings)
        now = distance_at(state, sighting)
        stds.append(now.robot_std)
    assert max(stds) > 0.03  # it knows that it does not know yet
    assert abs(now.robot - transform(inverse(pose), target)[2]) < 0.05 * 0.4


def test_a_full_window_becomes_the_prior_of_the_next():
    rng, state = np.random.default_rng(6), None
    settings = replace(SETTINGS, initial_distance_m=0.3, window=40, centroid_std_size=0.0)
    for k in range(130):
        _, sighting = sight(k * DT, 0.4, 0.05, rng)
        state = advance(state, sighting, DT, settings)
        assert len(state.window) <= 40
    now = distance_at(state, sighting)
    assert abs(now.robot - np.hypot(0.4, 0.05)) < 4 * now.robot_std < 2e-3


def test_a_target_behind_the_camera_has_a_finite_positive_distance():
    state, _, sighting, _, _ = follow(0.4, 0.05, 0.4)
    beyond = replace(sighting, T_base_cam=sighting.T_base_cam @ exp_twist(np.array([0, 0, 5.0, 0, 0, 0]), 1.0))
    now = distance_at(state, beyond)
    assert now.robot > 0.0
    assert np.isfinite([now.robot, now.robot_std, now.lens, now.lens_std]).all()


def test_a_distance_that_was_never_known_does_not_bind_the_next_start():
    # Noise of frames almost at rest may say "far, give or take", many of those deviations from the truth.
    rng, settings = np.random.default_rng(0), replace(SETTINGS, initial_distance_m=0.09, centroid_std_size=0.0)
    _, sighting = sight(0.0, 0.066, 0.02, rng)
    state = advance(None, sighting, DT, settings)
    far = state.mean.copy()
    far[2] = 1.0
    cov = state.cov.copy()
    cov[2, 2] = 0.6**2
    state = replace(state, mean=far, cov=cov, prior_mean=far, prior_cov=cov)
    for k in range(1, 26):
        pose, sighting = sight(k * DT, 0.066, 0.02, rng, fixating=False)
        state = advance(state, sighting, DT, settings)
    assert distance_at(state, sighting).robot == pytest.approx(transform(inverse(pose), [0.066, 0, 0])[2], rel=0.05)


def hand_poses(count):
    """A camera that goes to and fro and whose gaze wanders."""
    for k in range(count):
        t = k * DT
        place = np.array([0.05 * np.sin(3.1 * t), 0.09 * np.sin(2.3 * t), 0.06 * np.sin(3.7 * t + 1.0)])
        yield fixating_pose(place, [0.6, 0.08 * np.sin(4.3 * t + 0.5), 0.06 * np.sin(5.1 * t)])


def looked(poses, settings, magnified=1.0, noise=0.0, cov=POSE_COV, target=(0.6, 0.0, 0.0)):
    """State and last sighting after poses of a camera that sees a point exactly, but magnified."""
    state, poses, rng = None, list(poses), np.random.default_rng(3)
    for k, pose in enumerate(poses):
        before, after = poses[max(0, k - 1)], poses[min(len(poses) - 1, k + 1)]
        q = transform(inverse(pose), np.array(target))
        centroid = magnified * q[:2] / q[2] + rng.normal(0.0, noise, 2)
        sighting = Sighting(pose, cov, mean_twist(before, after, DT), centroid)
        state = advance(state, sighting, DT, settings)
    return state, sighting, q


@pytest.mark.parametrize("magnified", [1.02, 0.98])
def test_a_wrong_focal_length_is_learnt_where_the_gaze_wanders(magnified):
    settings = CalibratingSettings(focal=0.02, centroid_std=2e-4)
    state, sighting, q = looked(hand_poses(150), settings, magnified, cov=1e-9 * np.eye(6))
    assert state.mean[FOCAL] == pytest.approx(magnified - 1.0, abs=3e-3)
    assert distance_at(state, sighting).lens == pytest.approx(q[2], rel=0.01)
    blind, _, _ = looked(hand_poses(150), replace(settings, focal=0.0), magnified, cov=1e-9 * np.eye(6))
    assert abs(blind.mean[FOCAL]) < 1e-6


def test_noise_that_is_larger_than_stated_is_found_where_that_is_allowed():
    settings = CalibratingSettings(centroid_std=2e-4)
    state, sighting, q = looked(hand_poses(100), settings, noise=5e-4, cov=1e-12 * np.eye(6))
    free = replace(settings, noise_dof=4.0)
    scaled, _, _ = looked(hand_poses(100), free, noise=5e-4, cov=1e-12 * np.eye(6))
    assert noise_scale(state, settings) == 1.0
    assert np.sqrt(noise_scale(scaled, free)) == pytest.approx(2.5, rel=0.2)
    sure, honest = distance_at(state, sighting), distance_at(scaled, sighting)
    assert abs(honest.lens - q[2]) < 3.0 * honest.lens_std
    assert honest.lens_std > 1.8 * sure.lens_std
    quiet, _, _ = looked(hand_poses(100), free, noise=1e-4, cov=1e-12 * np.eye(6))
    assert noise_scale(quiet, free) == 1.0  # a statement is never made finer than it is


def test_the_true_cameras_depth_accounts_for_the_age_of_the_image():
    state, _, sighting, _, _ = follow(0.4, 0.05)
    moving = replace(sighting, twist=np.array([0.0, 0.0, 0.5, 0.0, 0.0, 0.0]))
    aged = replace(state, mean=np.where(np.arange(len(state.mean)) == AGE, state.mean[AGE] + 0.02, state.mean))
    assert distance_at(aged, moving).lens - distance_at(state, moving).lens == pytest.approx(0.5 * 0.02)
    assert distance_at(aged, moving).robot == distance_at(state, moving).robot


def test_a_twist_that_is_known_better_replaces_the_one_of_the_last_frame_alone():
    state, _, _, _, _ = follow(0.4, 0.05)
    better = with_last_twist(state, np.full(6, 0.5))
    np.testing.assert_array_equal(better.window[-1, TWIST], np.full(6, 0.5))
    np.testing.assert_array_equal(better.window[:-1], state.window[:-1])
    rejected = replace(state, rejected=1)
    assert with_last_twist(rejected, np.full(6, 0.5)) is rejected
