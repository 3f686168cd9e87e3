"""What is wrong with poses, stamps or K is learnt, or at least said: on recordings with one thing wrong each."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_recordings import (
    CAMERA,
    HAND_PERIOD,
    hand_frames,
    hand_pose,
    write_camera,
    write_layout,
)
from scipy.spatial.transform import Rotation

from fixation_gym.geometry.rigid import matrix_to_pose, pose_to_matrix
from fixation_gym.perception.distance.calibrating_estimator import Calibration
from fixation_gym.recordings.recording import RecordedFrame
from fixation_gym.recordings.stamps import OrderedFrames
from fixation_gym.replay import run
from fixation_gym.replay.alarms import alarms_on
from fixation_gym.replay.config import ReplayConfig
from fixation_gym.replay.estimators import learning_settings
from fixation_gym.replay.run import replay
from fixation_gym.replay.time_offset import TimeOffset, put_right, time_offset

IMAGE = np.zeros((120, 160), np.uint8)


def judged(folder, frames, camera=CAMERA, **options):
    """Summary of a replay with the recording's masks."""
    recording = write_layout(folder / "recording", frames)
    write_camera(recording / "camera.json", camera)
    config = ReplayConfig(recording=recording, **options)
    config.check()
    return replay(config, folder / "out")


def turned(degrees, millimetres):
    """Frames whose poses have a hand-eye error."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(np.radians(degrees) * np.array([1.0, 1.0, -1.0]) / math.sqrt(3.0)).as_matrix()
    T[:3, 3] = 1e-3 * millimetres * np.array([1.0, -1.0, 1.0]) / math.sqrt(3.0)
    return [replace(frame, pose=matrix_to_pose(pose_to_matrix(frame.pose) @ T)) for frame in hand_frames()]


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    return judged(tmp_path_factory.mktemp("clean"), hand_frames())


def test_without_errors_nothing_is_said_and_nothing_is_found(clean):
    summary, found = clean, clean["calibration"]
    assert summary["alarms"] == []
    assert abs(summary["pose_delay_ms"]) < 1.0
    assert abs(found["image_age_ms"]) < 2.0 * found["image_age_std_ms"] < 10.0
    assert abs(found["focal_percent"]) < 2.0 * found["focal_std_percent"]
    assert found["noise_ratio"] < 0.5  # exact poses are better than --pose-noise says
    assert found["pose_noise_mm"] == pytest.approx(1.5 * found["noise_ratio"])
    assert summary["distance"]["median_abs_error_m"] < 0.01


def test_one_triangulation_of_all_centroids_is_judged_beside(clean):
    at_once = clean["triangulation"]
    assert at_once["distance"]["frames"] == len(hand_frames())  # it knows from the first picture on
    assert at_once["distance"]["median_abs_error_m"] < 0.005
    assert abs(at_once["image_age_ms"]) < 3.0 * at_once["image_age_std_ms"]
    assert clean["distance"]["last_error_m"] == pytest.approx(at_once["distance"]["last_error_m"], abs=0.01)


def late(frames):
    """Frames with the poses of so many pictures before."""
    return [
        replace(frame, pose=matrix_to_pose(hand_pose((k - frames) * HAND_PERIOD)))
        for k, frame in enumerate(hand_frames())
    ]


@pytest.mark.parametrize(("frames_late", "left_out"), [(1, 0), (-1, 0), (2.6, 2)])
def test_late_and_early_poses_are_put_right_by_the_pictures_and_said(frames_late, left_out, clean, tmp_path):
    summary = judged(tmp_path, late(frames_late))
    assert summary["pose_delay_ms"] == pytest.approx(1e3 * frames_late * HAND_PERIOD, abs=1.0)
    (alarm,) = summary["alarms"]
    assert "every picture was given the pose of its own moment" in alarm
    assert ("late" if frames_late > 0 else "early") in alarm
    assert abs(summary["calibration"]["image_age_ms"]) < 3.0 * summary["calibration"]["image_age_std_ms"]
    assert summary["distance"]["median_abs_error_m"] < clean["distance"]["median_abs_error_m"] + 5e-3
    assert summary["map"]["precision"] > clean["map"]["precision"] - 0.02
    assert summary["unexplained_px"] < 1.5 * clean["unexplained_px"]
    assert not any("the first picture was left out" in note for note in summary["notes"])
    assert summary["without_pose"] == left_out  # beyond the end one pose is made up, the others are not known


def test_a_delay_beyond_what_is_tried_is_not_put_right_by_a_part_of_it(tmp_path):
    summary = judged(tmp_path, late(5))
    assert summary["without_pose"] == 0
    assert not any("every picture was given the pose" in alarm for alarm in summary["alarms"])
    assert summary["alarms"]  # but something is said


def test_late_poses_are_learnt_by_the_distance_where_pictures_do_not_tell(monkeypatch, tmp_path):
    monkeypatch.setattr(run, "time_offset", lambda *_: None)
    summary = judged(tmp_path, late(1))
    assert summary["pose_delay_ms"] is None
    assert summary["calibration"]["image_age_ms"] == pytest.approx(-1e3 * HAND_PERIOD, abs=6.0)
    assert any("newer than their poses" in alarm and "correct the stamps" in alarm for alarm in summary["alarms"])
    assert summary["distance"]["median_abs_error_over_std"] < 3.0


def test_a_hand_eye_error_of_5_mm_and_1_degree_is_within_the_stated_std(tmp_path):
    summary = judged(tmp_path, turned(1.0, 5.0))
    assert summary["distance"]["median_abs_error_over_std"] < 2.0
    assert summary["distance"]["p95_abs_error_over_std"] < 3.0


@pytest.mark.parametrize("percent", [1.0, -1.0])
def test_a_focal_length_that_is_a_percent_off_is_within_the_stated_std(percent, tmp_path):
    wrong = replace(CAMERA, fx=CAMERA.fx * (1.0 + 0.01 * percent), fy=CAMERA.fy * (1.0 + 0.01 * percent))
    summary = judged(tmp_path, hand_frames(), wrong)
    assert summary["distance"]["median_abs_error_over_std"] < 2.0
    assert summary["distance"]["p95_abs_error_over_std"] < 3.0


def test_poses_that_are_noisier_than_said_scale_the_std_up_and_are_said(tmp_path):
    rng = np.random.default_rng(1)
    frames = []
    for frame in hand_frames():
        T = pose_to_matrix(frame.pose).copy()
        T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec(rng.normal(0.0, 0.02, 3)).as_matrix()
        frames.append(replace(frame, pose=matrix_to_pose(T)))
    summary = judged(tmp_path, frames)
    assert any("as stated noise explains" in alarm for alarm in summary["alarms"])
    assert 0.3 * math.degrees(0.02) < summary["calibration"]["pose_noise_deg"] < 2.0 * math.degrees(0.02)
    assert summary["distance"]["median_abs_error_over_std"] < 2.0


NOTHING = Calibration(
    *(np.zeros(3), np.full(3, 1e-3), np.zeros(3), np.full(3, 2e-3)),
    *(0.0, 1e-3, 0.0, 3e-3, 1.0, 100.0, 0),
)


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"image_age_s": 0.03}, "pictures are 30 ms older than their poses (std 1 ms)"),
        ({"image_age_s": -0.03}, "pictures are 30 ms newer than their poses, which come late"),
        ({"translation_m": np.array([0.0, 0.02, 0.0])}, "the camera seems to be 20.0 mm from where the poses have it"),
        ({"rotation_rad": np.array([0.0, 0.0, 0.06])}, "the camera seems turned by 3.4 deg against the poses"),
        ({"focal": 0.04}, "the focal length seems +4.0 % off (std 0.3 %): check K"),
        ({"noise": 1.5}, "centroids are 1.5 times as far from where they should be as stated noise explains"),
        ({"restarts": 2}, "the target was 2 times not where it should be"),
    ],
)
def test_each_contradiction_has_its_sentence(wrong, sentence):
    settings = learning_settings(ReplayConfig(recording=Path("any")))
    assert alarms_on(NOTHING, settings, 0.2, TimeOffset(0.03, 0.02, False)) == []
    (alarm,) = alarms_on(replace(NOTHING, **wrong), settings, 0.2, None)
    assert sentence in alarm
    assert "2.0 px" in alarms_on(None, settings, 2.0, None)[0]


def test_stills_have_no_offset_and_keep_their_poses():
    frames = [
        RecordedFrame("", 0.5 * k, image=lambda: IMAGE, camera_pose=frame.pose)
        for k, frame in enumerate(hand_frames()[:5])
    ]
    assert time_offset(frames, [], CAMERA) is None
    right = put_right(OrderedFrames(frames, 0, 0, 0), 0.03).frames
    for before, after in zip(frames, right, strict=True):
        np.testing.assert_array_equal(before.camera_pose, after.camera_pose)
