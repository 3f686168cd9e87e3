"""Every reader gives the pictures, times, poses and truth that a recording was made of, or says what is wrong."""

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
from fixation_gym.recordings.catalogue import open_recording
from fixation_gym.recordings.options import ReaderOptions


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


def _camera(tmp_path):
    return write_camera(tmp_path / "K.json")


def drop_column(folder):
    write_rows(folder, [row[:6] + row[7:] for row in layout_rows(made_frames()[:2])], COLUMNS[:6] + COLUMNS[7:])


def spoil(column, text):
    def change(folder):
        rows = layout_rows(made_frames()[:2])
        rows[1][COLUMNS.index(column)] = text
        write_rows(folder, rows)

    return change


def without(name):
    return lambda folder: (folder / name).unlink()


def text(name, content):
    return lambda folder: (folder / name).write_text(content)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (drop_column, r"frames.csv has no column 'qy'; it needs time_s, x_m"),
        (spoil("time_s", "soon"), r"frames.csv, line 3, column 'time_s': 'soon' is not a number"),
        (spoil("x_m", ""), r"frames.csv, line 3, column 'x_m': '' is not a number"),
        (spoil("qw", "0.0"), r"frames.csv, line 3, columns 'qw' to 'qz': the quaternion .* has length"),
        (spoil("rgb", ""), r"frames.csv, line 3, column 'rgb' names no picture"),
        (spoil("rgb", "a,b"), r"frames.csv, line 3 has 13 cells, but there are 12 columns"),
        (text("frames.csv", ",".join(COLUMNS)), r"frames.csv has no rows"),
        (text("frames.csv", ""), r"frames.csv has no column 'time_s'"),
        (without("camera.json"), r"camera.json is missing"),
        (text("camera.json", "{"), r"camera.json cannot be read"),
        (text("camera.json", '{"width": 160, "height": 120}'), r"camera.json needs a number as 'fx', got None"),
        (
            lambda folder: write_camera(folder / "camera.json", distortion=[0.1, 0.2]),
            r"camera.json, 'distortion': a brown_conrady lens has 4 or 5 .* coefficients",
        ),
        (
            lambda folder: write_camera(folder / "camera.json", distortion_model="mirror"),
            r"camera.json, 'distortion': unknown lens model 'mirror'",
        ),
        (text("target.json", '{"first_frame_box_xywh": [1, 2]}'), r"target.json needs four numbers as"),
    ],
)
def test_what_is_wrong_with_a_folder_is_one_sentence(change, message, tmp_path):
    folder = write_layout(tmp_path / "a", made_frames()[:2])
    change(folder)
    with pytest.raises(UsageError, match=message):
        open_recording(folder)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (without("rgb/1.png"), r"rgb/1.png is missing"),
        (text("rgb/1.png", "no picture"), r"rgb/1.png cannot be read as a picture"),
        (
            lambda folder: write_picture(folder / "rgb/1.png", np.zeros((60, 80, 3), np.uint8)),
            r"rgb/1.png is 80 x 60, but the camera's K is for 160 x 120",
        ),
        (
            lambda folder: write_picture(folder / "rgb/1.png", np.zeros((120, 160), np.uint16)),
            r"rgb/1.png has uint16 pixels; pictures must have 8 bits",
        ),
    ],
)
def test_what_is_wrong_with_a_picture_is_said_when_it_is_loaded(change, message, tmp_path):
    folder = write_layout(tmp_path / "a", made_frames()[:2])
    change(folder)
    first, second = open_recording(folder)
    first.image()
    with pytest.raises(UsageError, match=message):
        second.image()


def test_a_depth_of_another_kind_is_refused(tmp_path):
    folder = write_layout(tmp_path / "a", made_frames()[:1])
    write_picture(folder / "depth/0.png", np.zeros((120, 160), np.uint8))
    with pytest.raises(UsageError, match=r"depth/0.png has uint8 pixels .* one channel of 16 bits"):
        next(iter(open_recording(folder))).depth()


@pytest.mark.parametrize(
    ("make", "options", "message"),
    [
        (lambda path: path.mkdir(), ReaderOptions(), "is empty"),
        (lambda path: None, ReaderOptions(), "there is no recording"),
        (lambda path: path.write_text("?"), ReaderOptions(), "no recording that is known: a folder with frames.csv"),
        (write_layout, ReaderOptions(poses=Path("p")), "--poses goes with video, but this recording is read as layout"),
        (write_layout, ReaderOptions(base_frame="x"), "--base-frame goes with bag, but"),
    ],
)
def test_a_path_that_is_no_recording_or_options_in_vain_are_one_sentence(make, options, message, tmp_path):
    make(tmp_path / "a")
    with pytest.raises(UsageError, match=message):
        open_recording(tmp_path / "a", options)


def test_other_formats_name_the_file_that_is_wrong(tmp_path, written):
    camera = ReaderOptions(_camera(tmp_path))
    folder = written["7scenes"][0]
    (folder / "frame-000003.pose.txt").write_text("1 2 3")
    with pytest.raises(UsageError, match=r"frame-000003.pose.txt must hold the 16 numbers"):
        open_recording(folder, camera)
    np.savetxt(folder / "frame-000003.pose.txt", np.diag([1.0, 1.0, -1.0, 1.0]))
    with pytest.raises(UsageError, match=r"frame-000003.pose.txt: .* no rotation"):
        open_recording(folder, camera)
    folder = written["tum"][0]
    (folder / "groundtruth.txt").write_text("0.0 1 2 3 0 0 0")
    with pytest.raises(UsageError, match=r"groundtruth.txt, line 1 lacks 'qw'"):
        open_recording(folder, camera)
    np.savez(tmp_path / "odd.npz", time=np.zeros(3), rgb=np.zeros((3, 120, 160, 3), np.uint8))
    with pytest.raises(UsageError, match=r"odd.npz has no array 'camera_pose'"):
        open_recording(tmp_path / "odd.npz")
    (tmp_path / "film.mp4").write_text("no film")
    with pytest.raises(UsageError, match=r"film.mp4: a video needs --camera FILE and --poses FILE"):
        open_recording(tmp_path / "film.mp4")
    with pytest.raises(UsageError, match=r"film.mp4 cannot be read as a video"):
        open_recording(tmp_path / "film.mp4", written["video"][1])
