"""What the distance experiment runs, resumes and writes; the sequences themselves are made up."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fixation_gym import cli
from fixation_gym.errors import UsageError
from fixation_gym.experiments.distance import figure as distance_figure
from fixation_gym.experiments.distance import run as distance
from fixation_gym.experiments.distance.config import DISTANCES, DistanceConfig
from fixation_gym.experiments.distance.duck_print import WIDTHS, card_image, duck_mask, valid_widths
from fixation_gym.experiments.distance.run import (
    CSV_FILE,
    FIGURE_FILE,
    SEQUENCES_FILE,
    cell_key,
    measure,
)
from fixation_gym.experiments.distance.sequence import HOME, INTRINSICS, JUMP_M, Circle, Condition
from fixation_gym.experiments.distance.statistics import (
    errors_of,
    format_table,
    motion_ratios,
    nees_bounds,
    summary_rows,
)

SAMPLES = 225


def sums(error: float, std: float) -> dict[str, Any]:
    square = error**2
    return {
        "samples": SAMPLES,
        "error": SAMPLES * error,
        "error2": SAMPLES * square,
        "absolute": SAMPLES * abs(error),
        "nees": SAMPLES * square / std**2,
        "std": SAMPLES * std,
    }


def fake_result(estimator: str, flow: str | None, hand_eye: bool, error: float) -> dict[str, Any]:
    return {
        "estimator": estimator,
        "flow": flow,
        "hand_eye": hand_eye,
        "robot": sums(error, abs(error) + 1e-9),
        "lens": sums(2 * error, abs(error) + 1e-9),
        "nis": 1.0,
        "relative_1s": 0.02,
        "settle_s": 0.4,
        "jump_relative_1s": 0.03,
        "jump_settle_s": None,
    }


def fake_run(cell: dict[str, Any]) -> dict[str, Any]:
    scale = 1e-3 * cell["distance_m"] * (1.0 if cell["motion"] == "fixation" else 4.0)
    kinds = [("pose", None, True), ("pose", None, False), ("pose3", None, True)]
    flows = ("gradient", "warped", "dis")
    kinds += [(kind, flow, True) for kind in ("hard", "free") for flow in flows if (kind, cell["motion"]) != _NONE]
    results = [fake_result(*kind, scale * (1.0 + 0.1 * (cell["seed"] % 7))) for kind in kinds]
    bounds = {"pose": scale, "velocity_hard": 2 * scale, "velocity_free": 3 * scale}
    return {**cell, "results": results, "bounds": bounds, "gaze_error_px": 1.0, "visible": 1.0}


_NONE = ("hard", "translation")


def test_thirteen_distances_and_both_amplitudes_with_all_prints_that_fit() -> None:
    cells = DistanceConfig().cells()
    assert len({cell_key(cell) for cell in cells}) == len(cells) == (13 + 11) * 2 * 20
    assert min(DISTANCES) == 0.066
    assert max(DISTANCES) == 6.6
    assert np.diff(np.log(DISTANCES)).std() < 0.06
    groups: dict[tuple[Any, ...], set[float]] = {}
    for cell in cells:
        groups.setdefault(cell_key(cell)[:3], set()).add(cell["print_width_m"])
    for (distance_m, amplitude_m, motion), widths in groups.items():
        assert widths == set(valid_widths(distance_m, INTRINSICS, amplitude_m * (motion == "translation")))
    assert {cell["print_width_m"] for cell in cells} == set(WIDTHS)


def test_quick_is_small() -> None:
    cells = DistanceConfig(quick=True).cells()
    assert len({cell["distance_m"] for cell in cells}) == 6
    assert len(cells) == 6 * 2 * 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--noise", "loud"], "unknown sensor noise 'loud'; choose one of ideal, nominal, conservative"),
        (["--seed", "-1"], "--seed must be 0 or more"),
        (["--seeds", "0"], "--seeds must be within 1.."),
        (["--workers", "0"], "--workers must be at least 1"),
        (["--workers", "many"], "--workers"),
        (["--distance", "1"], "--distance"),
    ],
)
def test_bad_options_are_one_line_and_leave_no_folder(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["distance", "--out", str(tmp_path / "out"), *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert message in captured.err
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def _no_figure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(distance_figure, "draw_figure", lambda path, rows: None)


@pytest.mark.usefixtures("_no_figure")
def test_a_killed_run_resumes_without_losing_or_repeating(tmp_path: Path) -> None:
    config = DistanceConfig(quick=True)
    calls: list[tuple[Any, ...]] = []

    def dying(cell: dict[str, Any]) -> dict[str, Any]:
        if len(calls) == 9:
            raise KeyboardInterrupt
        calls.append(cell_key(cell))
        return fake_run(cell)

    with pytest.raises(KeyboardInterrupt):
        measure(config, tmp_path, dying)
    with (tmp_path / SEQUENCES_FILE).open("ab") as file:
        file.write(b'{"distance_m": 0.0')  # the kill tore a line
    calls.append(("killed",))
    summary = measure(config, tmp_path, lambda cell: calls.append(cell_key(cell)) or fake_run(cell))
    calls.remove(("killed",))
    assert summary["sequences_resumed"] == 9
    assert sorted(calls) == sorted(cell_key(cell) for cell in config.cells())
    assert summary["rows"] == measure(config, tmp_path / "other", fake_run)["rows"]
    measure(config, tmp_path, lambda cell: pytest.fail("nothing is left to do"))


@pytest.mark.usefixtures("_no_figure")
def test_another_run_in_the_folder_is_refused(tmp_path: Path) -> None:
    measure(DistanceConfig(quick=True, count=1), tmp_path, fake_run)
    with pytest.raises(UsageError, match="noise conservative instead of nominal"):
        measure(DistanceConfig(quick=True, noise="nominal"), tmp_path, fake_run)


def test_the_folder_holds_summary_csv_and_figure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cli, "select_backend", lambda: "egl")
    monkeypatch.setattr(distance.measure, "__defaults__", (fake_run,))
    assert cli.main(["distance", "--quick", "--out", str(tmp_path)]) == 0
    summary = json.loads((tmp_path / "summary.json").read_text())
    row = summary["rows"][0]
    contract = "distance_m motion estimator amplitude_m noise bias_m std_m mae_m nees samples seeds"
    assert set(contract.split()) <= set(row)
    with (tmp_path / CSV_FILE).open(newline="") as file:
        assert len(list(csv.DictReader(file))) == len(summary["rows"])
    assert (tmp_path / FIGURE_FILE).read_bytes().startswith(b"\x89PNG")
    assert {entry["reached"] for entry in summary["wanted"]} <= {"goal", "floor", "no"}
    assert "fixation" in format_table(summary)


def test_sums_become_bias_spread_and_nees() -> None:
    parts = [{"robot": sums(error, 0.002)} for error in (0.001, 0.003)]
    values = errors_of(parts, "robot")
    assert values["bias_m"] == pytest.approx(0.002)
    assert values["std_m"] == pytest.approx(0.001)
    assert values["mae_m"] == pytest.approx(0.002)
    assert values["nees"] == pytest.approx((0.25 + 2.25) / 2)
    assert values["samples"] == 2 * SAMPLES
    broken = {"robot": dict.fromkeys(("error", "error2", "absolute", "nees", "std")) | {"samples": SAMPLES}}
    assert errors_of([*parts, broken], "robot")["mae_m"] is None
    assert errors_of([*parts, broken], "robot")["mae_median_m"] == pytest.approx(0.002)


def test_nees_bounds_are_those_of_chi_square() -> None:
    rng = np.random.default_rng(0)
    low, high = nees_bounds(20)
    means = (rng.standard_normal((4000, 20)) ** 2).mean(axis=1)
    assert np.mean((means > low) & (means < high)) == pytest.approx(0.95, abs=0.012)


def test_ratios_compare_the_motions_on_the_prints_that_both_have_seen() -> None:
    cells = [fake_run(cell) for cell in DistanceConfig(count=6).cells() if cell["distance_m"] == 0.066]
    widths = {
        motion: {c["print_width_m"] for c in cells if c["motion"] == motion} for motion in ("fixation", "translation")
    }
    assert widths["translation"] < widths["fixation"]
    ratios = motion_ratios(cells)
    assert {(r["fixation_estimator"], r["flow"]) for r in ratios} >= {
        ("pose", None),
        ("hard", "dis"),
        ("free", "warped"),
    }
    assert all(0.15 < r["ratio_robot"] < 0.4 for r in ratios)
    assert all(row["jump_not_settled"] == row["seeds"] for row in summary_rows(cells, "ideal"))


def test_the_duck_is_in_the_middle_of_its_card_and_red() -> None:
    card = card_image().astype(int)
    red = card[..., 0] - card[..., 1] > 90
    rows, columns = np.nonzero(red)
    middle = (card.shape[0] - 1) / 2
    assert abs(rows.mean() - middle) < 0.3
    assert abs(columns.mean() - middle) < 0.3
    assert np.ptp(columns) + 1 == pytest.approx(card.shape[0] / 1.4, abs=2)
    assert duck_mask(64).any(axis=0).all()


@pytest.mark.parametrize("distance_m", DISTANCES)
def test_prints_span_the_wanted_share_and_stay_in_view_without_rotation(distance_m: float) -> None:
    image_width = 640 * distance_m / INTRINSICS.fx
    assert all(0.05 <= width / image_width <= 0.75 for width in valid_widths(distance_m, INTRINSICS))
    for amplitude in (0.02, 0.05) if distance_m >= 0.15 else (0.02,):
        assert valid_widths(distance_m, INTRINSICS, amplitude)


@pytest.mark.parametrize("motion", ["fixation", "translation"])
def test_both_motions_keep_the_distance_and_the_amplitude(motion: Any) -> None:
    condition = Condition(0.15, 0.05, motion, 0.01, 0)
    circle = Circle(condition, np.random.default_rng(0))
    times = np.arange(0.0, 12.0, 0.04)
    places = np.array([circle.at(time)[0] for time in times])
    np.testing.assert_allclose(np.linalg.norm(places - HOME[:3, 3], axis=1), 0.05)
    to_print = condition.print_position() - places
    if motion == "fixation":
        np.testing.assert_allclose(np.linalg.norm(to_print, axis=1), 0.15)
    else:
        np.testing.assert_allclose(to_print @ HOME[:3, 2], 0.15)
    velocity = np.array([circle.at(time)[1] for time in times])
    np.testing.assert_allclose(velocity[1:-1], (places[2:] - places[:-2]) / 0.08, atol=2e-3)
    np.testing.assert_allclose(velocity[0], 0.0)
    np.testing.assert_allclose(np.linalg.norm(velocity[11:], axis=1), 0.05)


def test_a_jump_has_its_length_and_stays_in_view() -> None:
    for distance_m in DISTANCES:
        condition = Condition(distance_m, 0.02, "fixation", 0.1, 0)
        jump = HOME[:3, :3].T @ condition.jump(np.random.default_rng(1))
        assert np.linalg.norm(jump) == pytest.approx(JUMP_M)
        assert np.linalg.norm(jump[:2]) / (distance_m + jump[2]) < 0.15
