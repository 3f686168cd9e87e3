"""A rolling shutter that perception knows of: pictures whose rows are of their own times, with exact truth."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pinhole_scene import Scene, fixating_pose, noise_texture, upright
from scipy.spatial.transform import Rotation

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import inverse, matrix_to_pose, transform
from fixation_gym.geometry.twist import mean_twist
from fixation_gym.perception.flow.optic_flow import plane_homography
from fixation_gym.perception.flow.rolling_shutter import row_maps, row_motions
from fixation_gym.perception.pairing import PoseHistory
from fixation_gym.perception.pipeline import Perception
from fixation_gym.types import Observation

CAMERA = Intrinsics(160, 120, 150.0, 152.0, 81.0, 58.0)
READOUT, PERIOD, COUNT = 0.03, 1.0 / 30.0, 10
ROLLING = replace(CAMERA, readout_s=READOUT)
TARGET, WALL, POST = np.array([0.6, 0.0, 0.2]), 0.61, 0.45
BAND = 2
"""Rows that are rendered at once, in the middle of their times."""


def pose_at(time: float) -> np.ndarray:
    """A camera that sways before the target at up to 0.6 m/s, and is shaken by up to 7 rad/s^2 about each axis."""
    T = fixating_pose([0.03 * np.sin(4 * time), 0.08 * np.sin(6 * time), 0.22 + 0.05 * np.sin(7 * time + 1)], TARGET)
    shaken = [0.05 * np.sin(11 * time), 0.05 * np.sin(9 * time + 1), 0.04 * np.sin(13 * time)]
    T = T.copy()
    T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec(shaken).as_matrix()
    return T


def row_s(row, readout: float):
    return readout * (row - 0.5 * (CAMERA.height - 1)) / (CAMERA.height - 1)


@cache
def pictures(readout: float):
    """Time, picture, depth, and which thing is seen (0: a wall 1 cm behind the target, 2: a post in front)."""
    scene = Scene(
        [
            upright([WALL, 0.0, 0.2], 1.5, 1.2, noise_texture(1)),
            upright(TARGET, 0.06, 0.06, noise_texture(2, (1.0, 0.15, 0.1), 0.2)),
            upright([POST, 0.08, 0.2], 0.03, 0.07, noise_texture(3)),
        ]
    )
    made = []
    for k in range(COUNT):
        bands = []
        for first in range(0, CAMERA.height, BAND):
            taken = k * PERIOD + row_s(first + 0.5 * (BAND - 1), readout)
            parts = scene.render(pose_at(taken), CAMERA, 1.0, 1000 * k + first)
            bands.append([part[first : first + BAND] for part in parts])
        made.append((k * PERIOD, *(np.concatenate(parts) for parts in zip(*bands, strict=True))))
    return made


def judged(camera: Intrinsics, readout: float) -> tuple[float, float, float]:
    """Share of the wall that is called front, of the post, and median error of the inverse depth, 1/m."""
    perception, before = Perception(camera), None
    calls: dict[str, list[np.ndarray]] = {"wall": [], "post": [], "errors": []}
    for time, rgb, depth, thing in pictures(readout):
        zero_flow = perception.update(Observation.of_camera(time, rgb, matrix_to_pose(pose_at(time)))).zfc
        if zero_flow.fixated_inverse_depth > 0.0:
            assert before is not None
            seen, (true, which) = zero_flow.supported, before
            calls["wall"].append(zero_flow.p_nearer[seen & (which == 0)] > 0.5)
            calls["post"].append(zero_flow.p_nearer[seen & (which == 2)] > 0.5)
            calls["errors"].append(np.abs(zero_flow.inverse_depth - 1.0 / true)[seen])
        before = depth[1::2, 1::2], thing[1::2, 1::2]
    wall, post, errors = (np.concatenate(parts) for parts in calls.values())
    return float(wall.mean()), float(post.mean()), float(np.median(errors))


def test_a_known_shutter_does_nearly_what_a_shutter_of_all_rows_at_once_does():
    """An error of the inverse depth by 7 % puts the wall in front."""
    wall_at_once, _, error_at_once = judged(CAMERA, 0.0)
    wall_unknown, _, error_unknown = judged(CAMERA, READOUT)
    wall_known, post_known, error_known = judged(ROLLING, READOUT)
    assert wall_unknown > 0.02
    assert wall_known < 0.1 * wall_unknown
    assert wall_known < wall_at_once + 0.004
    assert post_known > 0.98
    assert error_unknown > 4.0 * error_at_once
    assert error_known < 1.2 * error_at_once


def row_errors(motions) -> tuple[list[float], list[float]]:
    """How far from where points are when their rows are exposed, px: by maps of ``motions``, and without a shutter.

    Points are followed by the exact path of the camera: the row that shows them tells when, and that tells the row.
    """
    depth, times = 0.6, (0.5 - PERIOD, 0.5, 0.5 + PERIOD)
    poses = [pose_at(time) for time in times]
    maps = row_maps(poses, motions(poses, times), 1.0 / depth, ROLLING)
    errors, unknown = [], []
    for other, (columns, rows) in zip((0, 2), maps, strict=True):
        plain = plane_homography(inverse(poses[other]) @ poses[1], 1.0 / depth, CAMERA)
        for u, v in ((5, 3), (150, 8), (80, 60), (20, 110), (155, 115)):
            ray = np.array([(u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy, 1.0])
            point = transform(pose_at(times[1] + row_s(v, READOUT)), depth * ray)
            row = float(v)
            for _ in range(10):
                pose = pose_at(times[other] + row_s(row, READOUT))
                column, row = CAMERA.project(transform(inverse(pose), point))
            errors.append(float(np.hypot(columns[v, u] - column, rows[v, u] - row)))
            x, y, n = plain @ (u, v, 1.0)
            unknown.append(float(np.hypot(x / n - column, y / n - row)))
    return errors, unknown


def test_rows_are_mapped_to_where_their_points_are_when_their_rows_are_exposed():
    """What is left by three poses is the change of the acceleration."""
    errors, unknown = row_errors(row_motions)
    assert max(errors) < 0.25
    assert np.median(errors) < 0.25 * np.median(unknown)


def test_readings_between_pictures_say_how_rows_moved():
    """Readings every 10 ms with the twist of their moment: a fifth at most is left of what three poses leave."""
    history = PoseHistory()
    for time in np.arange(0.40, 0.60, 0.01):
        twist = mean_twist(pose_at(time - 1e-5), pose_at(time + 1e-5), 2e-5)
        reading = Observation.of_camera(float(time), np.zeros((1, 1, 3), np.uint8), matrix_to_pose(pose_at(time)))
        history = history.with_reading(replace(reading, camera_twist=twist))
    errors, _ = row_errors(lambda poses, times: [history.row_motion(time, READOUT) for time in times])
    by_poses, _ = row_errors(row_motions)
    assert max(errors) < 0.04
    assert np.median(errors) < 0.2 * np.median(by_poses)
    assert history.row_motion(0.41, READOUT) is history.row_motion(0.58, READOUT) is None  # rows before and after all
    assert history.row_motion(0.5, 0.0) is None


def test_without_time_between_rows_the_map_is_that_of_the_plane():
    times = (0.0, PERIOD, 2 * PERIOD)
    poses = [pose_at(time) for time in times]
    grid = np.stack([*np.meshgrid(np.arange(160.0), np.arange(120.0)), np.ones((120, 160))])
    for other, (columns, rows) in zip((0, 2), row_maps(poses, row_motions(poses, times), 1.5, CAMERA), strict=True):
        x, y, n = np.tensordot(plane_homography(inverse(poses[other]) @ poses[1], 1.5, CAMERA), grid, 1)
        assert np.abs(columns - x / n).max() < 0.01
        assert np.abs(rows - y / n).max() < 0.01


@pytest.mark.parametrize("readout_s", [-0.01, np.nan, np.inf, "0.03"])
def test_a_shutter_takes_a_time(readout_s):
    with pytest.raises(ValueError, match="readout_s must be 0 or above, and finite"):
        replace(CAMERA, readout_s=readout_s)


def test_a_smaller_picture_takes_as_long():
    assert ROLLING.scaled(60, 80).readout_s == ROLLING.halved(100).readout_s == ROLLING.pinhole.readout_s == READOUT
