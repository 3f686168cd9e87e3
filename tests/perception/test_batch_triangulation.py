"""One triangulation of all centroids: exact where the model holds, not upset by a few that are wrong."""

from dataclasses import replace

import numpy as np
import pytest
from pinhole_scene import fixating_pose

from fixation_gym.geometry.rigid import inverse, transform
from fixation_gym.geometry.twist import mean_twist
from fixation_gym.perception.distance.batch_triangulation import triangulate
from fixation_gym.perception.distance.calibrating_filter import CalibratingSettings, advance, distance_at
from fixation_gym.perception.distance.calibration_model import AGE, FOCAL, Sighting

DT = 0.04
TARGET = np.array([0.6, 0.0, 0.0])
SETTINGS = CalibratingSettings(centroid_std=5e-4, image_age_s=0.05, focal=0.02, hand_eye_m=1e-3, hand_eye_rad=2e-3)


def hand_pose(t):
    """A camera that goes to and fro and whose gaze wanders."""
    place = np.array([0.05 * np.sin(3.1 * t), 0.09 * np.sin(2.3 * t), 0.06 * np.sin(3.7 * t + 1.0)])
    return fixating_pose(place, [0.6, 0.08 * np.sin(4.3 * t + 0.5), 0.06 * np.sin(5.1 * t)])


def sightings(count=100, late=0.0, magnified=1.0, noise=5e-4, seed=0):
    """What is seen, with poses that come late, and the true depth in each."""
    rng, seen, depths = np.random.default_rng(seed), [], []
    for k in range(count):
        q = transform(inverse(hand_pose(k * DT)), TARGET)
        before, pose, after = (hand_pose(k * DT - late + step) for step in (-1e-3, 0.0, 1e-3))
        centroid = magnified * q[:2] / q[2] + rng.normal(0.0, noise, 2)
        seen.append(Sighting(pose, 1e-9 * np.eye(6), mean_twist(before, after, 2e-3), centroid))
        depths.append(q[2])
    return seen, np.array(depths)


def errors(state, seen, depths):
    found = [distance_at(state, sighting) for sighting in seen]
    return np.array([d.lens for d in found]) - depths, np.array([d.lens_std for d in found])


@pytest.mark.parametrize(("late", "magnified"), [(0.0, 1.0), (0.03, 1.0), (0.0, 1.02), (-0.03, 0.98)])
def test_distance_and_calibration_come_out_together(late, magnified):
    seen, depths = sightings(late=late, magnified=magnified)
    state = triangulate(seen, SETTINGS)
    error, std = errors(state, seen, depths)
    assert np.median(np.abs(error) / std) < 3.0
    assert np.median(np.abs(error)) < 0.004
    assert state.mean[AGE] == pytest.approx(-late, abs=2e-3)
    # The model is linear in the age; what that leaves of 30 ms of such motion looks like a focal length.
    assert state.mean[FOCAL] == pytest.approx(magnified - 1.0, abs=0.012 if late else 4e-3)


def test_it_agrees_with_the_filter_at_the_end_where_nothing_is_wrong():
    seen, depths = sightings()
    state = None
    for sighting in seen:
        state = advance(state, sighting, DT, SETTINGS)
    error, std = errors(triangulate(seen, SETTINGS), seen[-1:], depths[-1:])
    now = distance_at(state, seen[-1])
    assert abs(error[0] - (now.lens - depths[-1])) < 0.5 * std[0]
    assert std[0] == pytest.approx(now.lens_std, rel=0.1)


def test_a_tenth_of_wrong_centroids_hardly_moves_it():
    seen, depths = sightings()
    rng = np.random.default_rng(1)
    spoiled = [
        replace(sighting, centroid=rng.uniform(-0.3, 0.3, 2)) if k % 10 == 5 else sighting
        for k, sighting in enumerate(seen)
    ]
    error, _ = errors(triangulate(spoiled, SETTINGS), seen, depths)
    assert np.median(np.abs(error)) < 0.02


def test_it_leaves_out_pictures_without_the_target_and_one_sight_gives_the_first_guess():
    seen, _ = sightings(10)
    blind = [replace(sighting, centroid=None) for sighting in seen]
    assert triangulate(blind, SETTINGS) is None
    guess = distance_at(triangulate([*blind, seen[0]], SETTINGS), seen[0])
    assert guess.lens == pytest.approx(SETTINGS.initial_distance_m, rel=0.05)
    assert guess.lens_std > 0.25
    with_gaps = triangulate([*seen, *blind], SETTINGS)
    np.testing.assert_allclose(with_gaps.mean, triangulate(seen, SETTINGS).mean)
