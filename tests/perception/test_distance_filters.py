from dataclasses import replace

import numpy as np
import pytest
from pinhole_scene import fixating_pose

from fixation_gym.geometry.rigid import inverse, transform
from fixation_gym.geometry.twist import skew
from fixation_gym.perception.distance.pose_filter import (
    DistanceSettings,
    distance_at,
    fixation_at,
    initialise,
    predict,
    update,
)

DT = 0.04
CENTROID_STD = 0.5 / 308.0
SETTINGS = replace(DistanceSettings(), centroid_std_size=0.0, walk_m=0.0)


def circle(time, distance, amplitude=0.05):
    return fixating_pose([0.0, amplitude * np.sin(time), amplitude * np.cos(time)], [distance, 0.0, 0.0])


def perturbed(pose, rng):
    motion = np.eye(4)
    motion[:3, :3] += skew(rng.normal(0, 2e-4, 3))
    motion[:3, 3] = rng.normal(0, 1e-4, 3)
    return pose @ motion


def seen_from(pose, point):
    local = transform(inverse(pose), point)
    return local[:2] / local[2]


def follow(pose_at, point_at, steps, settings=SETTINGS, seed=0, noise=1.0, state=None, start=0):
    """Run the filter; yields (state, true pose, measured pose, visible point)."""
    rng = np.random.default_rng(seed)
    for k in range(start, start + steps):
        pose, point = pose_at(k * DT), point_at(k * DT)
        measured = perturbed(pose, rng) if noise else pose
        centroid = seen_from(pose, point) + noise * rng.normal(0, CENTROID_STD, 2)
        if state is None:
            state = initialise(centroid, measured, settings)
        else:
            state = update(predict(state, DT, settings), centroid, measured, settings)
        yield state, pose, measured, point


def final_error(distance, seed, steps=100, **options):
    *_, (state, pose, measured, point) = follow(
        lambda t: circle(t, distance), lambda t: np.array([distance, 0.0, 0.0]), steps, seed=seed, **options
    )
    depth, std, _ = distance_at(state, measured, SETTINGS)
    return depth - transform(inverse(pose), point)[2], std


@pytest.mark.parametrize("distance", [0.15, 0.4, 2.0])
def test_circling_finds_the_distance_within_the_error_it_states(distance):
    errors = np.array([final_error(distance, seed) for seed in range(10)])
    nees = (errors[:, 0] / errors[:, 1]) ** 2
    assert np.abs(errors[:, 0]).mean() < 0.012 * distance
    assert 0.2 < nees.mean() < 2.2  # chi-square, 1 degree of freedom, mean of 10: 99 % bounds


def test_innovations_are_consistent_with_the_stated_noise():
    nis = [
        state.nis
        for seed in range(4)
        for state, *_ in follow(lambda t: circle(t, 0.4), lambda t: np.array([0.4, 0, 0]), 100, seed=seed)
    ]
    assert 1.7 < np.mean(nis) < 2.3  # 2 degrees of freedom


def test_without_noise_the_distance_is_exact():
    error, _ = final_error(0.4, 0, noise=0.0)
    assert abs(error) < 1e-4


@pytest.mark.parametrize("speed", [0.0, 0.05])
def test_no_motion_or_pure_approach_leaves_the_distance_uncertain(speed):
    def pose(t):
        return fixating_pose([speed * t, 0.0, 0.0], [0.7, 0.0, 0.0])

    for state, _, measured, _ in follow(pose, lambda t: np.array([0.7, 0.0, 0.0]), 75):
        depth, std, _ = distance_at(state, measured, SETTINGS)
        assert np.isfinite([depth, std]).all()
    assert std > 0.1


def test_a_pushed_target_is_found_again():
    settings = replace(SETTINGS, walk_m=5e-4)
    places = [np.array([0.4, 0.0, 0.0]), np.array([0.46, 0.05, 0.0])]

    def point(t):
        return places[int(t > 4.0)]

    def pose(t):
        return circle(t, 0.4)

    errors = []
    for state, true_pose, measured, place in follow(pose, point, 250, settings):
        depth, std, _ = distance_at(state, measured, settings)
        errors.append((abs(depth - transform(inverse(true_pose), place)[2]), std))
    assert errors[99][0] < 0.01
    assert errors[106][1] > 0.03  # it knows that it does not know yet
    assert errors[-1][0] < 0.015


def test_a_slowly_moving_target_is_followed():
    settings = replace(SETTINGS, walk_m=0.01)

    def point(t):
        return np.array([0.4 + 0.01 * t, 0.0, 0.0])

    *_, (state, pose, measured, place) = follow(lambda t: circle(2 * t, 0.4), point, 200, settings)
    depth, std, _ = distance_at(state, measured, settings)
    assert abs(depth - transform(inverse(pose), place)[2]) < 3 * std


def test_a_single_outlier_changes_nothing_but_the_nis():
    *_, (state, _, measured, _) = follow(lambda t: circle(t, 0.4), lambda t: np.array([0.4, 0, 0]), 100)
    after = update(state, np.array([0.2, -0.1]), measured, SETTINGS)
    np.testing.assert_array_equal(after.mean, state.mean)
    assert after.nis > SETTINGS.gate
    assert after.rejected == 1


def test_the_uncertainty_of_a_lost_target_grows_and_shrinks_when_it_is_seen_again():
    settings = DistanceSettings()
    *_, (state, _, measured, _) = follow(lambda t: circle(t, 0.4), lambda t: np.array([0.4, 0, 0]), 100, settings)
    stds = [distance_at(state, measured, settings)[1]]
    for k in range(75):
        state = predict(state, DT, settings, visible=False)
        if k % 25 == 24:
            stds.append(fixation_at(state, measured, settings).distance_std_m)
    assert (np.diff(stds) > 0).all()
    assert stds[-1] > 0.015
    assert np.isfinite(stds).all()
    *_, (state, _, measured, _) = follow(
        lambda t: circle(t, 0.4), lambda t: np.array([0.4, 0, 0]), 100, settings, state=state, start=175
    )
    assert distance_at(state, measured, settings)[1] < 0.5 * stds[-1]


def test_before_the_first_sight_the_fixation_is_the_prior_guess():
    fixation = fixation_at(None, np.eye(4), SETTINGS)
    assert not fixation.initialised
    assert not fixation.visible
    np.testing.assert_allclose(fixation.point_base, [0, 0, SETTINGS.initial_distance_m])
    assert fixation.distance_std_m > 0.2


def test_a_target_passed_by_the_camera_has_a_finite_positive_distance():
    state = initialise(np.zeros(2), np.eye(4), SETTINGS)
    beyond = np.eye(4)
    beyond[2, 3] = 5.0
    fixation = fixation_at(state, beyond, SETTINGS)
    values = [*fixation.centroid, *fixation.point_base, fixation.distance_m, fixation.distance_std_m]
    assert np.isfinite(values).all()
    assert fixation.distance_m > 0


def test_an_estimate_that_runs_far_off_begins_again_and_hears_what_comes_near():
    far, near = np.array([1e5, 0.0, 0.0]), np.array([0.6, 0.0, 0.0])
    state = None
    for state, pose, _, _ in follow(lambda t: circle(t, 1e5), lambda t: far, 200):
        depth, std, _ = distance_at(state, pose, SETTINGS)
        assert depth <= 1.2 * SETTINGS.farthest_m
    assert std > 0.3 * depth
    *_, (state, pose, measured, _) = follow(lambda t: circle(t, 0.6), lambda t: near, 100, state=state, start=200)
    depth, std, _ = distance_at(state, measured, SETTINGS)
    assert depth == pytest.approx(transform(inverse(pose), near)[2], abs=3 * std + 0.01)
