"""A recording over a table of known height: how the table moves tells where the camera sits."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from made_recordings import CAMERA, Made, write_camera, write_layout
from pinhole_scene import Rectangle, Scene, fixating_pose, noise_texture
from scipy.spatial.transform import Rotation

from fixation_gym.errors import UsageError
from fixation_gym.geometry.rigid import inverse, matrix_to_pose, pose_to_matrix
from fixation_gym.replay.config import ReplayConfig
from fixation_gym.replay.run import replay

HEIGHT, PERIOD, COUNT = 0.05, 1.0 / 30.0, 80
TARGET = np.array([0.5, 0.0, HEIGHT])
T_TRUE_BELIEVED = np.eye(4)
T_TRUE_BELIEVED[:3, :3] = Rotation.from_rotvec([0.02, -0.015, 0.01]).as_matrix()
T_TRUE_BELIEVED[:3, 3] = 0.004, -0.003, 0.002


@cache
def frames() -> tuple[Made, ...]:
    """A camera that sways above a red disc on a table, with its gaze on it."""
    flat = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    table = Rectangle(TARGET, 2.0 * flat[0], 2.0 * flat[1], noise_texture(1))
    disc = Rectangle(
        TARGET + np.array([0.0, 0.0, 1e-3]), 0.04 * flat[0], 0.04 * flat[1], noise_texture(2, (1.0, 0.15, 0.1), 0.2)
    )
    made = []
    for k in range(COUNT):
        t = k * PERIOD
        place = [0.2 + 0.06 * np.sin(2.1 * t), 0.12 * np.sin(1.7 * t + 0.5), HEIGHT + 0.35 + 0.05 * np.sin(2.6 * t)]
        T = fixating_pose(place, TARGET)
        rgb, depth, index = Scene([table, disc]).render(T, CAMERA, noise=1.0, seed=k)
        made.append(Made(t, matrix_to_pose(T), rgb, depth, index == 1, float(T[:3, 2] @ (TARGET - T[:3, 3]))))
    return tuple(made)


def summary_of(folder, error, **options):
    poses = [matrix_to_pose(pose_to_matrix(frame.pose) @ error) for frame in frames()]
    recording = write_layout(folder / "log", [replace(f, pose=p) for f, p in zip(frames(), poses, strict=True)])
    write_camera(recording / "camera.json", CAMERA)
    config = ReplayConfig(recording=recording, **options)
    config.check()
    return replay(config, folder / "out")


def test_a_camera_that_sits_elsewhere_is_found_corrected_and_named(tmp_path):
    found = summary_of(tmp_path, T_TRUE_BELIEVED, table_height=HEIGHT)
    by_table, true = found["hand_eye_by_table"], inverse(T_TRUE_BELIEVED)
    assert by_table["corrected"]
    rotation = np.degrees(Rotation.from_matrix(true[:3, :3]).as_rotvec())
    assert np.abs(np.array(by_table["hand_eye_deg"]) - rotation).max() < 0.5
    assert sum(alarm.startswith("the table moves as if the camera sat") for alarm in found["alarms"]) == 1


def test_where_the_camera_sits_as_believed_nothing_is_said(tmp_path):
    found = summary_of(tmp_path, np.eye(4), table_height=HEIGHT)
    assert not found["hand_eye_by_table"]["corrected"]
    assert found["hand_eye_by_table"]["pictures"] > 40
    assert not [alarm for alarm in found["alarms"] if "the table" in alarm]


def test_without_a_height_the_table_tells_nothing(tmp_path):
    assert summary_of(tmp_path, T_TRUE_BELIEVED)["hand_eye_by_table"] is None


def test_a_height_is_a_number():
    with pytest.raises(UsageError, match="--table-height must be a number in m, got nan"):
        ReplayConfig(recording=Path(), table_height=float("nan")).check()
