"""The arm before the print: what is seen, how it moves, and that the numbers come out of real recordings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from fixation_gym.envs.sensor_noise import SENSOR_NOISE
from fixation_gym.experiments.distance.sequence import CENTROID_STD_PX, HOME, INTRINSICS, Condition
from fixation_gym.geometry.rigid import inverse, look_at, transform
from fixation_gym.perception.detection.colour import segment
from fixation_gym.perception.distance.calibrating_estimator import CalibratingEstimator
from fixation_gym.perception.distance.estimator import TwistEstimator
from fixation_gym.perception.distance.flat_target import coverage, flat_centroid
from fixation_gym.perception.distance.pose_filter import DistanceSettings

pytestmark = pytest.mark.sim
UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def rig() -> Iterator:
    from fixation_gym.gl import select_backend

    select_backend()
    from fixation_gym.experiments.distance.rig import PrintRig

    rig = PrintRig()
    yield rig
    rig.close()


@pytest.mark.parametrize(
    ("distance", "width", "offset"),
    [(0.066, 0.01, 0.02), (0.066, 0.0316, 0.02), (0.15, 0.01, 0.05), (0.66, 0.1, 0.05), (6.6, 1.0, 0.05)],
)
def test_the_print_is_seen_where_it_is(rig, distance: float, width: float, offset: float) -> None:
    condition = Condition(distance, offset, "fixation", width, 0)
    target = condition.print_position()
    place = HOME[:3, 3] + HOME[:3, :3] @ [offset, 0.0, 0.0]
    rig.reset(look_at(place, target, UP), width, target)
    pose = rig.arm.camera_pose
    q = transform(inverse(pose), target)
    assert q[2] == pytest.approx(distance, abs=1e-4)
    image = rig.image()
    found = segment(image, INTRINSICS)
    assert not found.touches_border
    columns = np.flatnonzero(found.mask.any(axis=0))
    foreshortened = width * np.sqrt(1.0 - (offset / distance) ** 2)  # and the tip of the beak is too thin to be seen
    assert np.ptp(columns) + 1 == pytest.approx(INTRINSICS.fx * foreshortened / distance, rel=0.06, abs=6)
    centroid = flat_centroid(coverage(image, found.mask), INTRINSICS, pose[:3, :3].T @ HOME[:3, 2])
    np.testing.assert_allclose(INTRINSICS.fx * (centroid - q[:2] / q[2]), 0.0, atol=0.04)


def test_the_background_fills_the_image_and_is_not_red(rig) -> None:
    rig.reset(HOME, 0.01, np.array([-3.0, 0.0, 0.0]))
    image = rig.image()
    assert not segment(image, INTRINSICS).visible
    assert image.std() > 15
    assert image.min() > 0


@pytest.mark.parametrize("motion", ["fixation", "translation"])
def test_a_short_recording_gives_the_distance(rig, motion, monkeypatch: pytest.MonkeyPatch) -> None:
    from fixation_gym.experiments.distance import estimates, recording, sequence

    for module in (recording, sequence):
        monkeypatch.setattr(module, "MEASURE_S", 1.0)
        monkeypatch.setattr(module, "AFTER_JUMP_S", 1.0)
    noise = SENSOR_NOISE["conservative"]
    condition = Condition(0.31, 0.05, motion, 0.0316, 0)
    made = recording.record(rig, condition, noise, np.random.default_rng(0))
    assert len(made.frames) == 76
    assert all(frame.seen.segmentation.visible for frame in made.frames)
    poses = [frame.seen.T_base_cam for frame in made.frames]
    turns = [np.linalg.norm(pose[:3, :3] - poses[0][:3, :3]) for pose in poses]
    assert (max(turns) > 0.05) == (motion == "fixation")
    assert max(abs(pose[2, 0]) for pose in poses) < 0.03  # the image stays level
    gaze = [frame.gaze_error_px for frame in made.frames[25:51]]
    assert (max(gaze) < 15) == (motion == "fixation")
    places = np.array([pose[:3, 3] for pose in poses[15:]])
    radius = np.linalg.norm((places - HOME[:3, 3]) @ HOME[:3, :2], axis=1)
    np.testing.assert_allclose(radius, 0.05, atol=0.006)
    methods = estimates.methods(made, noise)
    if motion == "fixation":  # any estimator of the door runs on a recording
        twist = TwistEstimator(DistanceSettings(initial_distance_m=made.first_guess_m))
        methods = (*methods, estimates.Method("twist", twist))
    for method in methods:
        track = estimates.run(made, method)
        result = estimates.assess(made, method, track)
        assert result["robot"]["samples"] == 25
        if method.name == "pose":
            assert result["relative_1s"] < 0.02
            assert result["jump_relative_1s"] < 0.05
        assert np.isfinite(track.robot).all()
        assert np.isfinite(track.robot_std).all()
    bounds = estimates.bounds(made, CENTROID_STD_PX / INTRINSICS.fx)
    assert 0 < bounds["pose"] < bounds["velocity_hard"] < bounds["velocity_free"]


def test_the_same_seed_gives_the_same_recording(rig, monkeypatch: pytest.MonkeyPatch) -> None:
    from fixation_gym.experiments.distance import estimates, recording

    monkeypatch.setattr(recording, "BURN_IN_S", 0.2)
    monkeypatch.setattr(recording, "MEASURE_S", 0.2)
    monkeypatch.setattr(recording, "AFTER_JUMP_S", 0.2)
    condition = Condition(0.66, 0.05, "fixation", 0.1, 0)
    noise = replace(SENSOR_NOISE["nominal"])
    made = [recording.record(rig, condition, noise, np.random.default_rng(7)) for _ in range(2)]
    tracks = [
        estimates.run(one, estimates.Method("pose", CalibratingEstimator(recording.calibrating_settings(noise, 0.5))))
        for one in made
    ]
    np.testing.assert_array_equal(tracks[0].robot, tracks[1].robot)
    np.testing.assert_array_equal(made[0].frames[-1].seen.T_base_cam, made[1].frames[-1].seen.T_base_cam)
