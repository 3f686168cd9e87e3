"""What is wrong with a recording is one sentence that names file, line and column, or the option."""

from pathlib import Path

import numpy as np
import pytest
from made_recordings import (
    COLUMNS,
    layout_rows,
    made_frames,
    write_camera,
    write_layout,
    write_picture,
    write_rows,
    write_seven_scenes,
    write_tum,
)

from fixation_gym.errors import UsageError
from fixation_gym.recordings.catalogue import open_recording
from fixation_gym.recordings.options import ReaderOptions


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


def test_other_formats_name_the_file_that_is_wrong(tmp_path):
    camera = ReaderOptions(write_camera(tmp_path / "K.json"))
    folder = write_seven_scenes(tmp_path / "scenes", made_frames()[:5])
    (folder / "frame-000003.pose.txt").write_text("1 2 3")
    with pytest.raises(UsageError, match=r"frame-000003.pose.txt must hold the 16 numbers"):
        open_recording(folder, camera)
    np.savetxt(folder / "frame-000003.pose.txt", np.diag([1.0, 1.0, -1.0, 1.0]))
    with pytest.raises(UsageError, match=r"frame-000003.pose.txt: .* no rotation"):
        open_recording(folder, camera)
    folder = write_tum(tmp_path / "tum", made_frames()[:5])
    (folder / "groundtruth.txt").write_text("0.0 1 2 3 0 0 0")
    with pytest.raises(UsageError, match=r"groundtruth.txt, line 1 lacks 'qw'"):
        open_recording(folder, camera)
    np.savez(tmp_path / "odd.npz", time=np.zeros(3), rgb=np.zeros((3, 120, 160, 3), np.uint8))
    with pytest.raises(UsageError, match=r"odd.npz has no array 'camera_pose'"):
        open_recording(tmp_path / "odd.npz")
    (tmp_path / "film.mp4").write_text("no film")
    (folder / "poses.txt").write_text("0 1 2 3 1 0 0 0")
    with pytest.raises(UsageError, match=r"film.mp4: a video needs --camera FILE and --poses FILE"):
        open_recording(tmp_path / "film.mp4")
    with pytest.raises(UsageError, match=r"film.mp4 cannot be read as a video"):
        open_recording(
            tmp_path / "film.mp4", ReaderOptions(camera.camera, poses=folder / "poses.txt", quaternion="wxyz")
        )
