"""Every reader gives the pictures, times, poses and truth that a recording was made of, or says what is wrong."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from made_recordings import (
    CAMERA,
    COLUMNS,
    COUNT,
    PERIOD,
    bounding_box,
    layout_rows,
    made_frames,
    millimetres,
    write_camera,
    write_layout,
    write_npz,
    write_picture,
    write_rows,
    write_seven_scenes,
    write_tum,
    write_video,
)

from fixation_gym.errors import UsageError
from fixation_gym.geometry.camera import Lens
from fixation_gym.geometry.rigid import pose_to_matrix
from fixation_gym.recordings.camera_file import camera_values, read_camera
from fixation_gym.recordings.catalogue import open_recording
from fixation_gym.recordings.options import ReaderOptions

PAGE = Path(__file__).parents[2] / "docs" / "recordings.md"


def write_poses(path: Path, order: str | None) -> Path:
    """Of every frame, with named columns, or in an order of the quaternion without names."""
    lines = [] if order else [",".join(COLUMNS[:8])]
    for frame in made_frames():
        x, y, z, qw, qx, qy, qz = frame.pose.tolist()
        quaternion = [qx, qy, qz, qw] if order == "xyzw" else [qw, qx, qy, qz]
        lines.append(("," if order is None else " ").join(map(repr, (frame.time, x, y, z, *quaternion))))
    path.write_text("\n".join(lines))
    return path


@pytest.fixture
def written(tmp_path):
    """Path and options by reader."""
    camera = write_camera(tmp_path / "K.json")
    poses = write_poses(tmp_path / "poses.csv", None)
    return {
        "layout": (write_layout(tmp_path / "layout"), ReaderOptions()),
        "tum": (write_tum(tmp_path / "tum"), ReaderOptions(camera=camera)),
        "7scenes": (write_seven_scenes(tmp_path / "scenes"), ReaderOptions(camera=camera)),
        "video": (write_video(tmp_path / "film.avi"), ReaderOptions(camera=camera, poses=poses)),
        "npz": (write_npz(tmp_path / "robot.npz"), ReaderOptions(camera=camera)),
    }


def turned_apart(a, b):
    """Angle between two poses' rotations, rad."""
    R = pose_to_matrix(a)[:3, :3].T @ pose_to_matrix(b)[:3, :3]
    return np.linalg.norm(cv2.Rodrigues(R)[0])


@pytest.mark.parametrize("name", ["layout", "tum", "7scenes", "video", "npz"])
def test_a_recording_gives_back_what_it_was_made_of(name, written):
    recording = open_recording(*written[name])
    assert len(recording) == COUNT
    assert recording.camera == CAMERA
    for frame, true in zip(recording, made_frames(), strict=True):
        period = 1 / 30 if name == "7scenes" else PERIOD  # the former has no times
        assert frame.time == pytest.approx(true.time * period / PERIOD, abs=1e-5)
        assert np.abs(frame.image().astype(int) - true.rgb).max() <= (4 if name == "video" else 0)  # YUV and back
        assert frame.camera_pose[:3] == pytest.approx(true.pose[:3], abs=3e-4)
        assert turned_apart(frame.camera_pose, true.pose) < 1e-3
        if frame.depth is not None:
            step = 1 / 5000 if name == "tum" else 1e-3
            np.testing.assert_allclose(frame.depth(), millimetres(true.depth, step) * step, rtol=1e-6)
        if frame.mask is not None:
            np.testing.assert_array_equal(frame.mask(), true.mask)
    has_depth = {"layout", "tum", "7scenes"}
    assert (frame.depth is not None) == (name in has_depth)
    if name in ("layout", "npz"):
        np.testing.assert_array_equal(recording.target_box, bounding_box(made_frames()[0].mask))


def test_the_layout_has_exact_poses_truth_and_gaps_in_it(tmp_path):
    frames = made_frames()[:3]
    rows = layout_rows(frames)
    rows[1][1:8] = [""] * 7
    rows[2][9:] = ["", "", ""]
    first, second, third = open_recording(write_layout(tmp_path / "a", frames, rows=rows))
    np.testing.assert_array_equal(first.camera_pose, frames[0].pose)
    assert first.distance_true_m == frames[0].distance
    assert second.camera_pose is None
    assert third.depth is third.mask is third.distance_true_m is None


def test_joint_readings_of_the_layout_are_kept(tmp_path):
    frames = made_frames()[:2]
    folder = write_layout(tmp_path / "a", frames)
    write_rows(folder, [[*row, "0.5", "-1.0"] for row in layout_rows(frames)], [*COLUMNS, "joint_1", "joint_2"])
    assert [frame.joint_pos.tolist() for frame in open_recording(folder)] == [[0.5, -1.0]] * 2


def test_the_lens_of_the_camera_file_is_read(tmp_path):
    folder = write_layout(tmp_path / "a", made_frames()[:1])
    write_camera(folder / "camera.json", distortion=[0.1, 0.0, 0.0, 0.0], distortion_model="fisheye")
    assert open_recording(folder).camera.lens == Lens((0.1, 0.0, 0.0, 0.0), "fisheye")


def test_the_shutter_of_the_camera_file_is_read_and_written(tmp_path):
    path = write_camera(tmp_path / "camera.json", readout_s=0.03)
    assert read_camera(path).readout_s == camera_values(read_camera(path))["readout_s"] == 0.03
    for wrong in (-1.0, "soon", True, None):
        with pytest.raises(UsageError, match=r"camera\.json.*readout_s"):
            read_camera(write_camera(tmp_path / "camera.json", readout_s=wrong))


def test_grey_pictures_are_read(tmp_path):
    folder = write_layout(tmp_path / "a", made_frames()[:1])
    grey = cv2.cvtColor(made_frames()[0].rgb, cv2.COLOR_RGB2GRAY)
    write_picture(folder / "rgb/0.png", grey)
    np.testing.assert_array_equal(next(iter(open_recording(folder))).image(), grey)


@pytest.mark.parametrize("order", ["wxyz", "xyzw"])
def test_poses_without_names_come_in_the_order_that_is_asked_for(order, tmp_path):
    poses, camera = write_poses(tmp_path / "poses.txt", order), write_camera(tmp_path / "K.json")
    film = write_video(tmp_path / "film.avi")
    with pytest.raises(UsageError, match=r"poses.txt does not name its columns; give --quaternion wxyz or"):
        open_recording(film, ReaderOptions(camera, poses))
    recording = open_recording(film, ReaderOptions(camera, poses, order))
    for frame, true in zip(recording, made_frames(), strict=True):
        np.testing.assert_allclose(frame.camera_pose, true.pose)


def test_an_order_that_is_known_is_not_asked_for(tmp_path):
    poses, camera = write_poses(tmp_path / "poses.csv", None), write_camera(tmp_path / "K.json")
    with pytest.raises(UsageError, match=r"names its columns.*leave out --quaternion"):
        open_recording(write_video(tmp_path / "film.avi"), ReaderOptions(camera, poses, "wxyz"))


def test_pictures_of_a_video_come_in_any_order(written):
    frames = list(open_recording(*written["video"]))
    for index in (5, 6, 2, 9):
        assert np.abs(frames[index].image().astype(int) - made_frames()[index].rgb).max() <= 4


def test_no_pose_is_made_up_across_a_gap(tmp_path):
    folder = write_tum(tmp_path / "tum")
    lines = (folder / "groundtruth.txt").read_text().splitlines()
    (folder / "groundtruth.txt").write_text("\n".join(lines[:10] + lines[30:]))
    posed = [frame.camera_pose is not None for frame in open_recording(folder, ReaderOptions(_camera(tmp_path)))]
    assert posed == [True] * 3 + [False] * 5 + [True] * 16


def test_the_cameras_of_tum_are_known_by_the_folders_name(tmp_path):
    folder = write_tum(tmp_path / "rgbd_dataset_freiburg3_made_up")
    assert open_recording(folder).camera.fx == 535.4
    with pytest.raises(UsageError, match=r"rgb/0.png is 160 x 120, but the camera's K is for 640 x 480"):
        next(iter(open_recording(folder))).image()
    with pytest.raises(UsageError, match=r"its camera is not known.*freiburg1, freiburg2, freiburg3.*--camera"):
        open_recording(write_tum(tmp_path / "tum"))


CODE = """
class Mine:
    def __init__(self, path):
        from fixation_gym.recordings.catalogue import open_recording
        inner = open_recording(path / "inside")
        self.camera, self.target_box, self.frames = inner.camera, inner.target_box, list(inner)[::2]
    def __len__(self):
        return len(self.frames)
    def __iter__(self):
        return iter(self.frames)

class Half:
    def __len__(self):
        return 0
"""


def test_a_readers_own_class_fits_in(tmp_path, monkeypatch):
    write_layout(tmp_path / "odd" / "inside", made_frames()[:4])
    (tmp_path / "odd_reader.py").write_text(CODE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    recording = open_recording(tmp_path / "odd", reader="odd_reader:Mine")
    assert [frame.time for frame in recording] == [0.0, 2 * PERIOD]
    with pytest.raises(UsageError, match=r"--reader odd_reader:Half: the class needs __iter__\(\)"):
        open_recording(tmp_path / "odd", reader="odd_reader:Half")
    with pytest.raises(UsageError, match="unknown reader 'exr'; choose one of layout, tum, 7scenes"):
        open_recording(tmp_path / "odd", reader="exr")


def test_the_pages_example_of_a_reader_reads_pictures_in_a_folder(tmp_path, monkeypatch):
    code = re.search(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)[1]
    (tmp_path / "page_reader.py").write_text(code)
    for k, frame in enumerate(made_frames()[:3]):
        write_picture(tmp_path / f"stills/{k}.png", frame.rgb)
    monkeypatch.syspath_prepend(tmp_path)
    frames = list(open_recording(tmp_path / "stills", reader="page_reader:Stills"))
    assert [frame.camera_pose[0] for frame in frames] == [0.0, 0.01, 0.02]
    np.testing.assert_array_equal(frames[2].image(), made_frames()[2].rgb)


def _camera(tmp_path):
    return write_camera(tmp_path / "K.json")
