"""What ``replay`` says about made-up recordings, against exact truth; and how it ends where something is wrong."""

import csv
import json
import math
from dataclasses import replace as changed
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
    write_camera,
    write_layout,
    write_npz,
    write_rows,
    write_seven_scenes,
    write_tum,
)

from fixation_gym import cli
from fixation_gym.errors import UsageError
from fixation_gym.perception.detection.detector import GivenMasks
from fixation_gym.perception.distance.calibrating_estimator import CalibratingEstimator
from fixation_gym.perception.distance.estimator import PoseEstimator
from fixation_gym.perception.distance.pose_filter import DistanceSettings
from fixation_gym.perception.pipeline import Perception
from fixation_gym.recordings.recording import RecordedFrame
from fixation_gym.recordings.stamps import in_order
from fixation_gym.replay.config import ReplayConfig
from fixation_gym.replay.estimators import learning_settings
from fixation_gym.replay.run import FILES, replay
from fixation_gym.types import Observation

BOX = ",".join(map(str, bounding_box(made_frames()[0].mask)))
PIXEL = ",".join(str(int(np.median(axis))) for axis in np.nonzero(made_frames()[0].mask)[::-1])


def estimates(out):
    with (out / "estimates.csv").open() as file:
        return list(csv.DictReader(file))


def run(path, out, **options):
    config = ReplayConfig(recording=path, **options)
    config.check()
    return replay(config, out)


@pytest.fixture(scope="module")
def masked(tmp_path_factory):
    """Summary and folder of a replay with the recording's masks."""
    folder = tmp_path_factory.mktemp("masked")
    return run(write_layout(folder / "recording"), folder / "out"), folder / "out"


def test_distance_map_and_masks_are_judged_by_the_recordings_truth(masked):
    summary, out = masked
    assert {path.name for path in out.iterdir()} == set(FILES)
    assert summary["found_by"] == "masks of the recording"
    assert summary["perceived"] == summary["pictures"] == summary["seen"] == COUNT
    assert summary["distance"]["median_abs_error_m"] < 0.01
    assert summary["distance"]["median_true_m"] == pytest.approx(0.6, abs=0.02)
    assert summary["map"]["sign_right"] > 0.97
    assert summary["map"]["precision"] > 0.9
    assert summary["map"]["recall"] > 0.75  # the post is 17 px wide, and its outline is half of it
    assert summary["map"]["false_alarms"] < 0.02
    assert summary["map"]["frames"] == COUNT - 2
    assert summary["mask"]["least_overlap"] == 1.0
    assert json.loads((out / "summary.json").read_text()) == summary


def pose_estimator():
    return PoseEstimator(DistanceSettings(position_std_m=3e-3, rotation_std_rad=math.radians(0.5)))


def calibrating_estimator():
    return CalibratingEstimator(learning_settings(ReplayConfig(recording=Path("any"), pose_noise=(3.0, 0.5))))


@pytest.mark.parametrize("make", [pose_estimator, calibrating_estimator])
def test_estimates_are_those_of_the_same_perception_by_hand(make, masked, tmp_path):
    out = masked[1]
    if make is pose_estimator:
        out = tmp_path / "out"
        assert run(write_layout(tmp_path / "recording"), out, estimator="pose")["calibration"] is None
    perception = Perception(CAMERA, detector=GivenMasks(), estimator=make())
    for frame, row in zip(made_frames(), estimates(out), strict=True):
        percept = perception.update(Observation.of_camera(frame.time, frame.rgb, frame.pose, mask=frame.mask))
        assert (float(row["distance_m"]), float(row["distance_std_m"])) == percept.fixation.depth_seen
        assert float(row["distance_true_m"]) == frame.distance
        assert (row["no_map"] == "") == (percept.zfc.fixated_inverse_depth > 0.0)
        if row["no_map"] == "":
            assert float(row["map_known"]) == np.mean(percept.zfc.cells != 128)


def test_video_and_figure_are_there(masked):
    film = cv2.VideoCapture(str(masked[1] / "overlay.mp4"))
    assert film.get(cv2.CAP_PROP_FRAME_COUNT) == COUNT
    assert film.get(cv2.CAP_PROP_FPS) == pytest.approx(1 / PERIOD, rel=0.01)
    assert film.get(cv2.CAP_PROP_FRAME_HEIGHT) >= CAMERA.height
    assert cv2.imread(str(masked[1] / "distance.png")).std() > 5.0


@pytest.mark.parametrize(
    ("write", "options"),
    [
        (write_layout, {"target": BOX}),
        (write_layout, {"target": PIXEL}),
        (write_layout, {"detector": "colour"}),
        (write_tum, {"target": BOX, "camera": True}),
        (write_seven_scenes, {"target": BOX, "camera": True}),
        (write_npz, {"camera": True}),
    ],
)
def test_a_box_or_a_colour_finds_the_target_in_any_layout(write, options, tmp_path):
    if "camera" in options:
        options = {**options, "camera": write_camera(tmp_path / "K.json")}
    path = write(tmp_path / "recording.npz")
    summary = run(path, tmp_path / "out", **options)
    assert summary["found_by"] == options.get("detector", "box")
    assert summary["seen"] == COUNT
    if summary["distance"] is not None:  # an .npz has no truth
        assert summary["distance"]["median_abs_error_m"] < 0.02
        assert summary["map"]["sign_right"] > 0.95
    last = estimates(tmp_path / "out")[-1]
    assert float(last["distance_m"]) == pytest.approx(made_frames()[-1].distance, rel=0.05)


def test_a_lens_is_taken_out_of_pictures_masks_and_depth(tmp_path):
    """Only masks and depth are bent here, by OpenCV's own inverse: truth must come out as that of the pinhole."""
    coefficients = np.array([-0.25, 0.05, 0.0, 0.0, 0.0])
    rows, columns = np.mgrid[:120, :160].astype(np.float32)
    pixels = np.stack([columns, rows], axis=-1).reshape(-1, 1, 2)
    straight = cv2.undistortPoints(pixels, CAMERA.matrix, coefficients, P=CAMERA.matrix).reshape(120, 160, 2)

    def bent(image, how):
        return cv2.remap(image, *cv2.split(straight.astype(np.float32)), how, borderMode=cv2.BORDER_REPLICATE)

    frames = [
        changed(
            frame,
            rgb=bent(frame.rgb, cv2.INTER_LINEAR),
            depth=bent(frame.depth.astype(np.float32), cv2.INTER_NEAREST),
            mask=bent(frame.mask.astype(np.uint8), cv2.INTER_NEAREST) > 0,
        )
        for frame in made_frames()
    ]
    folder = write_layout(tmp_path / "recording", frames)
    blind = run(folder, tmp_path / "without")
    write_camera(folder / "camera.json", distortion=coefficients.tolist())
    knowing = run(folder, tmp_path / "with")
    assert knowing["distance"]["median_abs_error_m"] < 0.012
    assert knowing["map"]["sign_right"] > 0.96
    assert knowing["map"]["precision"] > blind["map"]["precision"]
    assert knowing["unexplained_px"] < 0.8 * blind["unexplained_px"]


def test_frames_whose_times_are_wrong_are_left_out_and_counted(tmp_path):
    rows = layout_rows(made_frames())
    rows[5][0] = rows[4][0]  # a duplicate
    rows[9][0] = "100000.0"  # one wrong clock must not cost all that follow
    rows[12][1:8] = [""] * 7  # no pose
    summary = run(write_layout(tmp_path / "a", rows=rows), tmp_path / "out")
    assert (summary["duplicate_times"], summary["times_out_of_order"], summary["without_pose"]) == (1, 1, 1)
    assert summary["perceived"] == COUNT - 3
    assert summary["distance"]["median_abs_error_m"] < 0.01
    notes = " ".join(summary["notes"])
    assert "1 picture left out, since another has the same time" in notes
    assert "no camera pose is known" in notes


def test_a_gap_is_survived_and_the_missing_map_is_said(tmp_path):
    rows = layout_rows(made_frames())
    for row in rows[10:]:
        row[0] = repr(float(row[0]) + 0.5)
    summary = run(write_layout(tmp_path / "a", rows=rows), tmp_path / "out")
    assert summary["gaps"] == 1
    assert summary["longest_gap_s"] == pytest.approx(0.5 + PERIOD)
    why = [row["no_map"] for row in estimates(tmp_path / "out")]
    assert [k for k, text in enumerate(why) if text] == [0, 1, 10, 11]
    assert "fewer than three pictures since the start or a gap" in why[10]
    assert any("across a gap there is no map" in note for note in summary["notes"])
    assert summary["distance"]["median_abs_error_m"] < 0.01


def test_fewest_frames_are_left_out_of_an_order():
    def frame(time):
        return RecordedFrame("", time, image=lambda: np.zeros((1, 1), np.uint8), camera_pose=np.eye(7)[3])

    times = [0.0, 1.0, 9.0, 2.0, 2.0, 3.0, 0.5, 4.0]
    ordered = in_order(map(frame, times), "made up")
    assert [frame.time for frame in ordered.frames] == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert (ordered.duplicates, ordered.backwards) == (1, 2)


def test_quaternions_in_the_wrong_order_and_inverted_poses_are_noticed(tmp_path):
    turned, inverted = layout_rows(made_frames()), layout_rows(made_frames())
    for row, other, frame in zip(turned, inverted, made_frames(), strict=True):
        row[4:8] = [row[5], row[6], row[7], row[4]]
        from fixation_gym.geometry.rigid import inverse, matrix_to_pose, pose_to_matrix

        other[1:8] = map(repr, matrix_to_pose(inverse(pose_to_matrix(frame.pose))).tolist())
    folder = write_layout(tmp_path / "a", rows=turned)
    with pytest.raises(UsageError, match=r"poses contradict the pictures .* quaternion as x, y, z, w they fit"):
        run(folder, tmp_path / "out")
    write_rows(folder, inverted)
    with pytest.raises(UsageError, match=r"poses contradict the pictures .* inverted, .* they fit"):
        run(folder, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_frames_before_one_that_cannot_be_read_are_kept(tmp_path, capsys):
    folder = write_layout(tmp_path / "a")
    (folder / "rgb/15.png").write_text("broken")
    out = tmp_path / "out"
    assert cli.main(["replay", str(folder), "--out", str(out)]) == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert "rgb/15.png cannot be read as a picture; 15 pictures before it are in" in last
    assert len(estimates(out)) == 15
    summary = json.loads((out / "summary.json").read_text())
    assert summary["perceived"] == 15
    assert "rgb/15.png" in summary["error"]
    assert cv2.VideoCapture(str(out / "overlay.mp4")).get(cv2.CAP_PROP_FRAME_COUNT) == 15


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--target", "150,100,30,30"], "--target 150,100,30,30 reaches out of the first picture, which is 160 x 120"),
        (["--target", "10,10,1,1"], "must be 3 x 3 px at least"),
        (["--target", "200,10"], "the target's pixel must lie in the image (160 x 120), got 200, 10"),
        (["--target", "10"], "--target must be x,y,w,h or x,y in px of the first picture, got '10'"),
        (["--target", "a,b"], "--target must be x,y,w,h or x,y"),
        (["--detector", "eyes"], "unknown detector 'eyes'; choose one of colour"),
        (["--quaternion", "wzyx"], "wzyx"),
        (["--reader", "exr"], "unknown reader 'exr'"),
    ],
)
def test_a_wrong_option_is_one_line_and_leaves_no_folder(arguments, message, tmp_path, capsys):
    folder, out = write_layout(tmp_path / "a", made_frames()[:2]), tmp_path / "out"
    assert cli.main(["replay", str(folder), "--out", str(out), *arguments]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert message in error
    assert not out.exists()


def test_without_poses_or_a_target_nothing_is_begun(tmp_path):
    rows = layout_rows(made_frames()[:2], truth=False)
    folder = write_layout(tmp_path / "a", made_frames()[:2], truth=False, rows=rows, box=False)
    with pytest.raises(UsageError, match=r"does not say which thing is the target; give --target"):
        run(folder, tmp_path / "out")
    write_rows(folder, [[row[0], *[""] * 7, *row[8:]] for row in rows], COLUMNS)
    with pytest.raises(UsageError, match=r"none of its 2 frames has a camera pose"):
        run(folder, tmp_path / "out", detector="colour")
    assert not (tmp_path / "out").exists()


def test_results_of_another_command_are_not_touched(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "summary.json").write_text("{}")
    with pytest.raises(UsageError, match="holds results of another command"):
        run(write_layout(tmp_path / "a", made_frames()[:3]), tmp_path / "out")
    assert (tmp_path / "out" / "summary.json").read_text() == "{}"


def test_a_viewer_gets_pictures_map_target_distance_path_and_plane(tmp_path):
    pytest.importorskip("rerun")
    path = tmp_path / "log" / "replay.rrd"
    run(write_layout(tmp_path / "a", made_frames()[:6]), tmp_path / "out", rerun=path)
    content = path.read_bytes()
    for entity in ("picture", "camera_path", "zero_flow_plane", "target", "distance", "zero_flow/map", "flow"):
        assert entity.encode() in content, entity


def test_without_the_viewers_package_the_extra_is_named(tmp_path, monkeypatch):
    import importlib.util

    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(UsageError, match=r"pip install 'fixation-gym\[viz\]'"):
        ReplayConfig(recording=tmp_path, rerun=tmp_path / "a.rrd").check()


def test_noise_of_poses_must_be_above_nothing(tmp_path):
    with pytest.raises(UsageError, match="--pose-noise must be two numbers above 0, mm and deg"):
        ReplayConfig(recording=tmp_path, pose_noise=(1.0, 0.0)).check()
