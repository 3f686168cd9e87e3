"""Every example runs and does what it says."""

import importlib.util
from pathlib import Path

import cv2
import pytest

from fixation_gym.robot_loop import End, LoopSettings

pytestmark = pytest.mark.sim
EXAMPLES = Path(__file__).parent.parent / "examples"


def load(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_quickstart_prints_the_image_size(capsys):
    load("01_quickstart").main()
    assert "(240, 320, 3)" in capsys.readouterr().out


def test_servo_pick_lifts_the_object(capsys):
    assert load("02_servo_pick").main()
    assert "lift" in capsys.readouterr().out


def test_recorded_frames_give_the_distance(tmp_path, capsys):
    example = load("03_recorded_frames")
    example.record(tmp_path / "recording.npz")
    assert 0.3 < example.replay(tmp_path / "recording.npz") < 0.6
    assert "+-" in capsys.readouterr().out


def test_a_few_lines_on_the_zero_flow_map_pick_the_object_up(capsys):
    assert load("04_zero_flow_agent").main()
    assert "% of the map in front" in capsys.readouterr().out


def test_a_shipped_agent_lifts_the_object(capsys):
    assert load("05_trained_agent").main()
    assert "% of the map in front" in capsys.readouterr().out


def test_the_robot_loop_picks_or_ends_with_a_sentence(capsys):
    example = load("06_robot_loop")
    assert example.main("clear").end is End.HELD
    assert example.main("clear", settings=LoopSettings(longest_s=0.1)).end is End.TIME
    assert "time: 0.1 s are over; 4 periods, 0 of them late" in capsys.readouterr().out


def test_the_contact_sheet_has_a_row_for_each_scenario(tmp_path):
    path = load("08_contact_sheet").main(str(tmp_path / "scenes.png"), ("bin", "clear"), 2)
    sheet = cv2.imread(str(path))
    assert sheet.shape == (2 * 180, 2 * 240, 3)
    with pytest.raises(SystemExit, match="cannot be written"):
        load("08_contact_sheet").main(str(tmp_path / "nowhere" / "scenes.png"), ("clear",), 1)


def test_the_path_is_drawn_over_the_front_view_where_the_camera_was(tmp_path):
    assert load("07_path_over_front_view").main(str(tmp_path / "path.png"), "clear", 1)
    picture = cv2.imread(str(tmp_path / "path.png")).astype(int)
    assert picture.shape == (2 * 360, 2 * 480, 3)
    green = (picture[..., 1] > 150) & (picture[..., 0] < 120) & (picture[..., 2] < 90)
    assert green.sum() > 500
    with pytest.raises(SystemExit, match="cannot be written"):
        load("07_path_over_front_view").main(str(tmp_path / "path.txt"), "clear", 1)


def test_examples_are_short_and_each_has_a_test():
    names = sorted(path.stem for path in EXAMPLES.glob("*.py"))
    tests = Path(__file__).read_text()
    for name in names:
        assert len((EXAMPLES / f"{name}.py").read_text().splitlines()) < 60, name
        assert name in tests, name
