"""The hand-eye error from the flow of a table that is exactly known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pinhole_scene import fixating_pose
from scipy.spatial.transform import Rotation

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.interaction import image_flow
from fixation_gym.geometry.twist import mean_twist
from fixation_gym.perception.flow.optic_flow import Flow
from fixation_gym.perception.hand_eye.hand_eye_filter import (
    HandEyeSettings,
    HandEyeState,
    SurfaceView,
    evidence,
    first_state,
    learned,
)

CAMERA = Intrinsics(80, 60, 75.0, 76.0, 40.0, 29.0)
PERIOD, TABLE, RISE, GAIN = 0.04, 0.1, 0.003, -0.05
SETTINGS = HandEyeSettings()
BLIND = replace(SETTINGS, shared=1e9)
"""One picture changes nothing that is known."""
TRANSLATION, ROTATION = np.array([4e-3, -2e-3, 3e-3]), np.array([-0.012, 0.015, 0.01])
TARGET = np.array([0.6, 0.0, TABLE + 0.03])


def hand_eye(translation, rotation) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_rotvec(rotation).as_matrix(), translation
    return T


def pose_at(time: float) -> np.ndarray:
    """The believed camera: it sways about a target on the table, and comes nearer."""
    away = 0.45 - 0.01 * time
    azimuth, elevation = 0.5 * np.sin(0.9 * time), 0.8 + 0.25 * np.sin(1.3 * time + 1)
    out = np.array([-np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    return fixating_pose(TARGET + away * out, TARGET)


def surface_view(time: float, error: np.ndarray, rise: float = RISE, gain: float = GAIN) -> SurfaceView:
    """What is seen of a table ``rise`` higher than believed by a camera that is off by ``error``; flow is exact."""
    believed = [pose_at(time + step * PERIOD) for step in (-1, 0, 1)]
    true = [T @ error for T in believed]
    x, y = CAMERA.grid
    ray = np.stack([x, y, np.ones_like(x)], -1)
    inverse_depth = ray @ true[1][2, :3] / (TABLE + rise - true[1][2, 3])
    twists = [mean_twist(poses[0], poses[2], 2 * PERIOD) for poses in (true, believed)]
    seen = image_flow(x, y, inverse_depth, twists[0])
    warped = image_flow(x, y, 2.5, twists[1])
    focal = np.array([CAMERA.fx, CAMERA.fy])[:, None, None]
    residual = (1.0 + gain) * PERIOD * focal * (np.stack(seen) - np.stack(warped))
    information = np.zeros((3, CAMERA.height, CAMERA.width), np.float32)
    information[0] = information[2] = 900.0
    flow = Flow(
        time=time,
        valid=True,
        intrinsics=CAMERA,
        period=PERIOD,
        residual=residual.astype(np.float32),
        residual_cov=np.zeros_like(information),
        information=information,
        gradient=(-900.0 * residual).astype(np.float32),
        warp_inverse_depth=2.5,
        overlap=np.ones((CAMERA.height, CAMERA.width), np.bool_),
        warp=(np.eye(3), np.eye(3)),
        frame_intrinsics=CAMERA,
    )
    return SurfaceView(flow, flow.overlap, believed[1], twists[1], twists[1], TABLE, PERIOD, np.zeros(2), 0.45)


def learned_from(error: np.ndarray, count: int = 100, **table) -> HandEyeState:
    state = first_state(SETTINGS)
    for k in range(count):
        state = learned(state, surface_view(k * PERIOD, error, **table), SETTINGS)
    return state


def test_the_table_tells_the_hand_eye_error_and_what_shortens_the_flow():
    state = learned_from(hand_eye(TRANSLATION, ROTATION))
    assert state.pictures > 80
    assert state.proven
    true = [*TRANSLATION, *ROTATION, RISE, GAIN]
    assert np.all(np.abs(state.mean - true) < 1.5 * state.stds)
    assert state.stds[3:6].max() < 4.5e-3  # from 9e-3
    assert state.mean[3:6] == pytest.approx(ROTATION, abs=2.5e-3)


def test_it_is_as_sure_as_it_says():
    """Errors against the stated standard deviations, for errors drawn from the prior."""
    rng = np.random.default_rng(0)
    normalised = []
    for _ in range(6):
        translation, rotation = 3e-3 * rng.standard_normal(3), 9e-3 * rng.standard_normal(3)
        state = learned_from(hand_eye(translation, rotation), count=50)
        normalised.append((state.mean[:6] - [*translation, *rotation]) / state.stds[:6])
    assert np.sqrt(np.mean(np.square(normalised))) < 1.0


def test_a_good_calibration_is_left_as_it_is():
    state = learned_from(hand_eye([2e-4, -2e-4, 1e-4], [5e-4, -3e-4, 5e-4]))
    assert state.pictures > 80
    assert not state.proven
    assert evidence(state, SETTINGS) < 2.0
    assert np.array_equal(state.T_believed_true, np.eye(4))


def test_things_on_the_table_do_not_count_as_table():
    """A third of the picture shows something 6 cm high; what is left tells the same."""
    error, state = hand_eye(TRANSLATION, ROTATION), first_state(SETTINGS)
    for k in range(100):
        table, box = (surface_view(k * PERIOD, error, rise=rise) for rise in (RISE, 0.06))
        gradient = table.flow.gradient.copy()
        gradient[:, :, :27] = box.flow.gradient[:, :, :27]
        state = learned(state, replace(table, flow=replace(table.flow, gradient=gradient)), SETTINGS)
    assert state.proven
    assert state.mean[3:6] == pytest.approx(ROTATION, abs=3e-3)


@pytest.mark.parametrize(
    "change",
    [
        {"distance_m": 0.1},
        {"target": np.array([0.0, 0.3])},
        {"twist": np.full(6, 1e-3)},
        {"usable": np.zeros((CAMERA.height, CAMERA.width), np.bool_)},
        {"height_m": 2.0},
    ],
    ids=["near", "not fixated", "at rest", "no table in view", "below the table"],
)
def test_what_tells_nothing_changes_nothing(change):
    state = learned_from(hand_eye(TRANSLATION, ROTATION), count=5)
    view = replace(surface_view(0.2, hand_eye(TRANSLATION, ROTATION)), **change)
    assert learned(state, view, SETTINGS) is state


def test_many_pictures_prove_an_error_that_few_do_not():
    """Between the two gates: the same evidence is enough only after many pictures."""
    between = math.sqrt(0.5 * (SETTINGS.proven + SETTINGS.proven_by_many))
    turn = np.array([0.0, between * math.hypot(SETTINGS.rotation_floor_rad, 1e-4), 0.0])
    view = replace(surface_view(0.0, hand_eye(np.zeros(3), turn)), since_s=0.0)
    mean = np.array([0.0, 0.0, 0.0, *turn, RISE, GAIN])
    for before, proven in ((SETTINGS.least_pictures, False), (SETTINGS.many_pictures, True)):
        known = HandEyeState(mean, np.diag(np.full(8, 1e-8)), pictures=before, in_a_row=SETTINGS.in_a_row)
        state = learned(known, view, BLIND)
        assert state.pictures == before + 1
        assert state.proven == proven


def test_evidence_must_last():
    """Large evidence proves an error in 25 pictures, and a picture without takes them all back."""
    large, none = np.array([0.0, 0.0, 0.0, 0.0, 0.02, 0.0, 0.0, -0.05]), np.array([0.0] * 7 + [-0.05])
    cov = np.diag(np.full(8, 1e-8))
    in_a_row = []
    for mean in (large, none):
        view = replace(surface_view(0.0, hand_eye(np.zeros(3), mean[3:6]), rise=0.0), since_s=0.0)
        known = HandEyeState(mean, cov, pictures=100, in_a_row=SETTINGS.in_a_row - 2)
        in_a_row.append(learned(known, view, BLIND))
    assert [state.in_a_row for state in in_a_row] == [SETTINGS.in_a_row - 1, 0]
    assert not any(state.proven for state in in_a_row)
