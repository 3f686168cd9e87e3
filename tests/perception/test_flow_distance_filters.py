"""The flow filters: derivatives against differences, exact data, noise, the fixation constraint, and faults."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pinhole_scene import fixating_pose

from fixation_gym.geometry.interaction import image_flow
from fixation_gym.geometry.rigid import inverse, transform
from fixation_gym.geometry.twist import mean_twist
from fixation_gym.perception.distance import flow_filters as filters
from fixation_gym.perception.distance.flow_filters import (
    FlowFilterSettings,
    FlowSamples,
    distance_of,
    initialise,
    predict,
    update,
)

DT = 0.04
AMPLITUDE = 0.05
POINTS = np.random.default_rng(0).uniform(-0.1, 0.1, (12, 2))
TWIST_COV = np.diag([1e-3] * 3 + [2e-3] * 3) ** 2
SETTINGS = FlowFilterSettings(initial_distance_m=0.6, onset_s=0.0)


def pose_at(t, distance, fixating):
    place = np.array([0.0, AMPLITUDE * np.sin(t), AMPLITUDE * np.cos(t)])
    return fixating_pose(place, [distance if fixating else 1e6, 0.0, 0.0])


@cache
def truth(t, distance, fixating):
    """Centre of a print at (distance, 0, 0) that faces the robot, true twist, points and flow on it."""
    pose = pose_at(t, distance, fixating)
    twist = mean_twist(pose_at(t - 1e-3, distance, fixating), pose_at(t + 1e-3, distance, fixating), 2e-3)
    normal = pose[:3, :3].T @ [1.0, 0.0, 0.0]
    centre = transform(inverse(pose), np.array([distance, 0.0, 0.0]))
    points = POINTS + centre[:2] / centre[2]
    inverse_depth = np.column_stack([points, np.ones(len(points))]) @ normal / (normal @ centre)
    flow = np.column_stack(image_flow(points[:, 0], points[:, 1], inverse_depth, twist))
    return tuple(frozen(array) for array in (centre, twist, points, flow))


def frozen(array):
    array.flags.writeable = False
    return array


def measured(t, distance, fixating, rng, gain=1.0):
    """Centre of the print, measured twist and flow."""
    centre, twist, points, flow = truth(t, distance, fixating)
    flow = gain * flow
    flow_std = 5e-3
    if rng is not None:
        twist = twist + np.sqrt(np.diag(TWIST_COV)) * rng.standard_normal(6)
        flow = flow + flow_std * rng.standard_normal(flow.shape)
    cov = np.tile(flow_std**2 * np.eye(2), (len(points), 1, 1))
    return centre, twist, FlowSamples(points, flow, cov)


@cache
def follow(kind, distance=0.4, fixating=True, steps=125, seed=None, settings=SETTINGS, **options):
    """State, relative error and relative std after some steps. Shared, so nobody may write."""
    rng = None if seed is None else np.random.default_rng(seed)
    state = initialise(kind, settings)
    for k in range(steps):
        centre, twist, samples = measured(k * DT, distance, fixating, rng, **options)
        state = update(state, twist, TWIST_COV, samples, settings)
        estimate, std = distance_of(state, centre[:2] / centre[2])
        state = predict(state, DT, settings)
    state = replace(state, mean=frozen(state.mean), cov=frozen(state.cov))
    return state, (estimate - centre[2]) / centre[2], std / centre[2]


def random_state(kind, seed):
    rng = np.random.default_rng(seed)
    state = initialise(kind, SETTINGS)
    mean = state.mean + 0.3 * rng.standard_normal(state.mean.size)
    mean[-1] = 2.5
    return replace(state, mean=mean)


@pytest.mark.parametrize("kind", ["hard", "free"])
@pytest.mark.parametrize("model", ["twist", "flow"])
def test_derivatives_agree_with_differences(kind, model):
    state = random_state(kind, 1)

    def value(mean):
        changed = replace(state, mean=mean)
        if model == "twist":
            return changed.model.twist(mean)[0]
        return filters._flow_model(changed, POINTS)[0].ravel()

    exact = state.model.twist(state.mean)[1] if model == "twist" else filters._flow_model(state, POINTS)[1]
    steps = 1e-6 * np.eye(state.mean.size)
    numeric = np.array([(value(state.mean + step) - value(state.mean - step)) / 2e-6 for step in steps]).T
    np.testing.assert_allclose(exact.reshape(numeric.shape), numeric, atol=1e-7)


def test_the_constraint_holds_the_fixation_point_still():
    state = random_state("hard", 2)
    flow, _ = filters._flow_model(state, np.zeros((1, 2)))
    np.testing.assert_allclose(flow, 0.0, atol=1e-12)


def test_the_plane_moves_as_a_rigid_body_does():
    state = random_state("free", 3)
    dt, twist, n = 1e-5, state.mean[:6], state.mean[12:]
    point = np.array([0.1, -0.2, (1.0 - n[0] * 0.1 + n[1] * 0.2) / n[2]])
    moved = point - dt * (twist[:3] + np.cross(twist[3:], point))
    assert predict(state, dt, SETTINGS).mean[12:] @ moved == pytest.approx(1.0, abs=1e-8)


@pytest.mark.parametrize(("kind", "fixating"), [("hard", True), ("free", True), ("free", False)])
def test_exact_data_gives_the_distance(kind, fixating):
    _, error, std = follow(kind, fixating=fixating)
    assert abs(error) < 4e-3
    assert std < 0.02


@pytest.mark.parametrize(("kind", "fixating"), [("hard", True), ("free", False)])
def test_noisy_data_gives_the_distance_to_a_few_per_cent(kind, fixating):
    errors = [follow(kind, fixating=fixating, seed=seed)[1] for seed in range(2)]
    assert np.abs(errors).mean() < 0.03


def test_a_flow_that_is_too_short_harms_translation_fully_and_fixation_hardly():
    fixating = follow("hard", fixating=True, gain=0.9)[1]
    translating = follow("free", fixating=False, gain=0.9)[1]
    assert abs(fixating) < 0.01
    assert 0.08 < translating < 0.13


def test_measured_drift_of_the_gaze_keeps_the_constraint_from_driving_the_distance():
    start = initialise("hard", SETTINGS)
    twist = np.array([0.05, 0.0, 0.0, 0.0, 0.0, 0.0])  # the gaze has not begun to follow
    trusting, wary = start, start
    for _ in range(10):
        trusting = predict(update(trusting, twist, TWIST_COV, None, SETTINGS), DT, SETTINGS)
        wary = predict(update(wary, twist, TWIST_COV, None, SETTINGS, np.array([0.12, 0.0])), DT, SETTINGS)
    assert distance_of(trusting)[0] > 3.0
    assert distance_of(wary)[0] == pytest.approx(0.6, rel=0.6)
    assert distance_of(wary)[1] > 0.2


def test_outliers_are_rejected():
    rng, state = np.random.default_rng(4), initialise("free", SETTINGS)
    for k in range(125):
        centre, twist, samples = measured(k * DT, 0.4, False, rng)
        flow = samples.flow.copy()
        flow[:2] += 0.5
        state = update(state, twist, TWIST_COV, replace(samples, flow=flow), SETTINGS)
        state = predict(state, DT, SETTINGS)
    assert distance_of(state, centre[:2] / centre[2])[0] == pytest.approx(0.4, rel=0.05)
    assert 0.1 < state.rejected_share < 0.3


@pytest.mark.parametrize("kind", ["hard", "free"])
@pytest.mark.parametrize("fault", ["lost", "nan flow", "nan twist", "dropped", "jitter"])
def test_faults_leave_a_finite_estimate_with_a_growing_std(kind, fault):
    state, _, _ = follow(kind, seed=0)
    before = distance_of(state)[1]
    rng, stds = np.random.default_rng(1), []
    for k in range(125, 150):
        _, twist, samples = measured(k * DT, 0.4, True, rng)
        dt = DT * rng.uniform(0.5, 1.5) if fault == "jitter" else DT
        if fault == "nan flow":
            samples = replace(samples, flow=np.full((len(POINTS), 2), np.nan))
        if fault not in ("dropped", "nan twist"):
            kept = None if fault == "lost" else samples
            state = update(state, twist, TWIST_COV, kept, SETTINGS)
        if fault == "nan twist":
            state = update(state, np.full(6, np.nan), TWIST_COV, samples, SETTINGS)
        state = predict(state, dt, SETTINGS)
        assert np.isfinite(distance_of(state)).all()
        stds.append(distance_of(state)[1])
    if fault in ("dropped", "nan twist"):
        assert np.all(np.diff(stds) > 0)
        assert stds[-1] > before
    for k in range(150, 175):
        _, twist, samples = measured(k * DT, 0.4, True, rng)
        state = predict(update(state, twist, TWIST_COV, samples, SETTINGS), DT, SETTINGS)
    assert distance_of(state)[0] == pytest.approx(np.hypot(0.4, AMPLITUDE), rel=0.06)


def test_a_moved_target_is_noticed_and_followed():
    state, _, _ = follow("free", seed=2)
    for k in range(125, 250):
        centre, twist, samples = measured(k * DT, 0.6, True, np.random.default_rng(k))
        state = predict(update(state, twist, TWIST_COV, samples, SETTINGS), DT, SETTINGS)
    assert distance_of(state)[0] == pytest.approx(centre[2], rel=0.1)


def test_the_estimate_is_finite_and_positive_whatever_the_state():
    for kind in ("hard", "free"):
        state = initialise(kind, SETTINGS)
        depth, std = distance_of(replace(state, mean=-state.mean))
        assert depth > 0.0
        assert np.isfinite([depth, std]).all()


@pytest.mark.parametrize("kind", ["hard", "free"])
def test_a_filter_that_runs_into_its_target_stays_finite_and_finds_the_distance_again(kind):
    state = initialise(kind, SETTINGS)
    for _ in range(400):  # 8 m straight on, without flow: the target must long have been passed
        state = update(
            predict(state, DT, SETTINGS), np.array([0.0, 0.0, 0.5, 0.0, 0.0, 0.0]), TWIST_COV, None, SETTINGS
        )
        assert np.isfinite([*distance_of(state), *state.cov.ravel()]).all()
    assert distance_of(state)[0] == pytest.approx(0.01)
    rng = np.random.default_rng(0)
    for k in range(150):
        centre, twist, samples = measured(k * DT, 0.4, True, rng)
        state = predict(update(state, twist, TWIST_COV, samples, SETTINGS), DT, SETTINGS)
    assert distance_of(state)[0] == pytest.approx(centre[2], rel=0.1)
