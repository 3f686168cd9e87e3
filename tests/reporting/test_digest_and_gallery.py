"""Names of evaluations, error curves, and which failures get pictures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_traces import make_trace

from fixation_gym.evaluation.folders import Evaluation, read_evaluation
from fixation_gym.reporting.digest import START_TIMES, digest, error_curves, labels
from fixation_gym.reporting.gallery import chosen_failures, failed_episodes
from fixation_gym.reporting.path_figures import footprint, phase_spans


def evaluation(folder: str, policy: str, noise: str = "nominal", size: tuple[int, int] = (240, 320)) -> Evaluation:
    run = {"policy": policy, "sensor_noise": noise, "image_size": list(size), "seed": 0}
    return Evaluation(Path(folder), run, {}, ())


def test_evaluations_of_one_policy_are_told_apart_by_what_differs() -> None:
    assert labels([evaluation("a", "servo"), evaluation("b", "blind")]) == ["servo", "blind"]
    assert labels([evaluation("a", "servo"), evaluation("b", "servo", "conservative"), evaluation("c", "blind")]) == [
        "servo, nominal",
        "servo, conservative",
        "blind",
    ]
    assert labels([evaluation("a", "servo"), evaluation("b", "servo")]) == ["servo, a", "servo, b"]


def test_errors_count_only_while_the_gaze_is_held() -> None:
    trace = make_trace([("search", 25), ("approach", 100), ("grasp", 25)], error_m=0.004)
    curves = error_curves(trace)
    assert curves is not None
    assert (curves.within_two_std, curves.decisions) == (100, 100)
    error, std = curves.since_start
    gazing = (START_TIMES > 0.99) & (START_TIMES < 4.99)
    np.testing.assert_allclose(error[gazing], 0.004)
    np.testing.assert_allclose(std[gazing], 0.003)
    assert np.isnan(error[~gazing]).all()
    np.testing.assert_allclose(curves.before_grasp[0, -20:], 0.004)
    assert error_curves(make_trace([("search", 9)])) is None


def test_without_a_grasp_there_is_no_time_before_it() -> None:
    curves = error_curves(make_trace([("approach", 50)]))
    assert curves is not None
    assert np.isnan(curves.before_grasp).all()


def test_pictures_are_spread_over_policies_and_scenarios(servo_folder: Path, blind_folder: Path) -> None:
    records = digest([read_evaluation(servo_folder), read_evaluation(blind_folder)])
    failures = failed_episodes(records)
    chosen = chosen_failures(failures, 2)
    assert [(item.policy, item.episode.result.seed) for item in chosen] == [(0, 1), (1, 0)]
    assert chosen_failures(failures, 99) == failures
    assert chosen_failures(failures, 0) == []


def test_phases_are_spans_of_time() -> None:
    spans = phase_spans(make_trace([("search", 5), ("approach", 10), ("search", 5)]))
    assert [name for name, _, _ in spans] == ["search", "approach", "search"]
    assert [start for _, start, _ in spans] == pytest.approx([0.0, 0.2, 0.6])
    assert spans[-1][2] == pytest.approx(0.76)
    assert phase_spans(make_trace([("", 5)])) == []


def test_a_footprint_is_turned_counter_clockwise() -> None:
    box = replace(make_trace([("search", 2)]).boxes[1], half_extent=(0.2, 0.1, 0.3), yaw=np.pi / 2)
    corners = footprint(box, np.array([1.0, 2.0, 0.0]))
    np.testing.assert_allclose(corners[0], [1.0 - 0.1, 2.0 + 0.2])
