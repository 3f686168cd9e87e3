"""The robustness experiment: scores with known truth, the table, and the command's folder."""

import json
from collections import Counter
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

from fixation_gym.cli import main
from fixation_gym.envs.privileged_map import PictureTruth
from fixation_gym.experiments.robustness.config import RobustnessConfig
from fixation_gym.experiments.robustness.degradations import CLEAN, DEGRADATIONS, MEANINGS
from fixation_gym.experiments.robustness.map_scores import cell_counts, map_scores
from fixation_gym.experiments.robustness.run import CSV_FILE, FIGURE_FILE, measure
from fixation_gym.experiments.robustness.statistics import format_table, summarise
from fixation_gym.robots import ROBOT


def test_cells_are_counted_against_the_truth():
    cells = np.full((32, 32), 128, np.uint8)
    nearer, clearly = np.zeros((2, 32, 32), np.uint8)
    nearer[:4], clearly[:4] = 255, 255  # 128 cells in front
    nearer[4] = clearly[4] = 30  # an edge: neither clear nor mostly in front
    cells[:2], cells[2], cells[4], cells[10], cells[20:] = 250, 3, 250, 200, 5
    counts = cell_counts(cells, nearer, clearly)
    scores = map_scores(counts)
    assert scores["precision"] == pytest.approx(96 / 128)  # rows 0, 1 and 4 of those and 10
    assert scores["recall"] == pytest.approx(64 / 96)  # row 3 is not known
    assert scores["clear_alarmed"] == pytest.approx(32 / (27 * 32))
    assert scores["known"] == pytest.approx((2 + 1 + 1 + 1 + 12) / 32)
    assert map_scores(Counter())["precision"] is None


def episode(row, seed, alarm, right, success=True):
    counts = {"alarm": alarm, "alarm_right": right, "clear": 1000, "clear_alarmed": alarm - right}
    values = {"distance_error": 0.01, "seen": 1.0, "maps": 5, "time_s": 9.0}
    named = {"row": row, "scenario": "opaque", "seed": seed}
    return {**named, **values, "success": success, "collision": False, "counts": counts}


def test_each_row_is_compared_with_the_clean_one_on_its_scenes():
    clean = [episode(CLEAN, seed, 100, 90) for seed in range(3)]
    degraded = [episode("jpeg", 0, 100, 45), episode("jpeg", 1, 100, 45, success=False)]
    rows = summarise([*clean, *degraded])
    assert [row["row"] for row in rows] == [CLEAN, "jpeg"]
    assert rows[0]["precision_of_clean"] == 1.0
    assert rows[1]["precision_of_clean"] == pytest.approx(0.5)
    assert rows[1]["clear_alarmed"] == pytest.approx(110 / 2000)
    assert rows[1]["free"] == 1
    assert rows[1]["difference"] == pytest.approx(-0.5)
    text = format_table(rows)
    assert "JPEG 30" in text
    assert "1/2 (-50)" in text


def test_a_run_resumes_and_writes_table_and_figure(tmp_path):
    calls = []

    def run(cell):
        calls.append(cell)
        return {**episode(cell["row"], cell["seed"], 100, 80), **cell}

    measure(RobustnessConfig(rows=("jpeg",), scenarios=("opaque",), episodes=2), tmp_path, run)
    assert [(cell["row"], cell["seed"]) for cell in calls] == [(CLEAN, 0), (CLEAN, 1), ("jpeg", 0), ("jpeg", 1)]
    summary = measure(RobustnessConfig(rows=("jpeg", "blur"), scenarios=("opaque",), episodes=2), tmp_path, run)
    assert [cell["row"] for cell in calls[4:]] == ["blur", "blur"]
    assert summary["episodes_resumed"] == 4
    assert [row["row"] for row in summary["rows"]] == [CLEAN, "jpeg", "blur"]
    assert json.loads((tmp_path / "summary.json").read_text())["noise"]["jpeg"]["jpeg_quality"] == 30
    assert (tmp_path / CSV_FILE).read_text().startswith("row,")
    assert (tmp_path / FIGURE_FILE).stat().st_size > 10_000


def test_a_row_whose_noise_was_changed_is_measured_again(tmp_path, monkeypatch):
    calls = []

    def run(cell):
        calls.append(cell["row"])
        return {**episode(cell["row"], cell["seed"], 100, 80), **cell}

    config = RobustnessConfig(rows=("lens",), scenarios=("opaque",), episodes=1)
    measure(config, tmp_path, run)
    measure(config, tmp_path, run)
    monkeypatch.setitem(DEGRADATIONS, "lens", replace(DEGRADATIONS["lens"], lens=(-0.2, 0.1, 0.0, 0.0)))
    assert measure(config, tmp_path, run)["noise"]["lens"]["lens"] == (-0.2, 0.1, 0.0, 0.0)
    assert calls == [CLEAN, "lens", "lens"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--row", "fog"], "unknown degradation 'fog'; choose one of nominal, jpeg"),
        (["--scenario", "moon"], "unknown scenario 'moon'"),
        (["--episodes", "0"], "--episodes must be within 1.."),
        (["--workers", "0"], "--workers must be at least 1"),
    ],
)
def test_bad_options_end_as_one_line(options, message, capsys, tmp_path):
    assert main(["robustness", *options, "--out", str(tmp_path / "out")]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_every_row_has_a_meaning_and_is_a_noise_of_its_own():
    assert list(DEGRADATIONS) == list(MEANINGS)
    assert len(set(DEGRADATIONS.values())) == len(DEGRADATIONS)


@pytest.mark.sim
def test_the_truth_of_a_picture_is_that_of_its_time():
    env = gym.make("FixationPick-v0", scenario="opaque", image_size=(96, 128), sensor_noise={"delay_s": 0.04})
    base = env.unwrapped
    env.reset(seed=0)
    action = np.zeros(7, np.float32)
    action[2] = 0.6
    distances = [base._info({})["distance_true_m"]]
    truth = PictureTruth(base.wrist_view, base.model)
    for _ in range(4):
        *_, info = env.step(action)
        depth, distance = truth.look(base.picture_qpos)
        assert distance == pytest.approx(distances[-1], abs=1e-6)  # of the step before
        distances.append(info["distance_true_m"])
    assert distances[0] - distances[-1] > 0.5 * 4 * 0.04 * 0.6 * ROBOT.arm.linear_speed
    assert (depth < distance).any()
    env.close()
