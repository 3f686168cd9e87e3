"""Traces: what is recorded, how small it is stored, what happens to damaged and missing files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from evaluation_fakes import FakeEnv, FakePolicy, SilentPolicy, run_fake_cell
from made_traces import make_trace

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.evaluation.evaluate import evaluate
from fixation_gym.evaluation.rollout import run_episode
from fixation_gym.evaluation.storage import EPISODES_FILE, EpisodeStore
from fixation_gym.evaluation.trace import TRACES_FOLDER, read_trace, trace_file, write_trace


def test_an_episode_has_a_row_per_decision_and_one_for_the_end() -> None:
    trace = run_episode(FakeEnv(), FakePolicy(), seed=4).trace
    assert trace is not None
    assert trace.phases == ("search", "approach", "approach", "grasp", "lift", "lift")
    np.testing.assert_allclose(trace.time_s, 0.04 * np.arange(6), atol=1e-6)
    np.testing.assert_allclose(trace.distance_true_m, 1.0 - 0.1 * np.arange(6))
    np.testing.assert_allclose(trace.distance_m, [0.85] * 5 + [np.nan])
    assert trace.collided.tolist() == [False, False, True, True, True, True]
    assert trace.boxes == ()
    assert np.isnan(trace.target_rise_m).all()


def test_a_policy_without_beliefs_has_no_phases() -> None:
    trace = run_episode(FakeEnv(), SilentPolicy(), seed=4).trace
    assert trace is not None
    assert set(trace.phases) == {""}
    assert np.isnan(trace.distance_m).all()


def test_a_trace_is_read_as_it_was_written_to_a_tenth_of_a_millimetre(tmp_path: Path) -> None:
    trace = make_trace([("search", 3), ("approach", 5), ("search", 2)], rise=(0.0, 0.1), collided_from=4)
    trace.distance_m[0], trace.distance_m[1] = np.nan, 50.0
    write_trace(tmp_path / "a.npz", trace)
    again = read_trace(tmp_path / "a.npz")
    assert again is not None
    assert (again.phases, again.boxes) == (trace.phases, trace.boxes)
    for name in ("distance_std_m", "distance_true_m", "clearance_m", "gripper_width_m", "tool_m", "things_m"):
        np.testing.assert_allclose(getattr(again, name), getattr(trace, name), atol=5.1e-5)
    np.testing.assert_allclose(again.time_s, trace.time_s, atol=1e-6)
    np.testing.assert_array_equal(again.collided, trace.collided)
    assert np.isnan(again.distance_m[0])
    assert again.distance_m[1] == pytest.approx(3.2767)  # saturated
    assert [path.name for path in tmp_path.iterdir()] == ["a.npz"]


def test_a_long_noisy_episode_stays_below_thirty_kilobytes(tmp_path: Path) -> None:
    trace = make_trace([("approach", 626)])
    rng = np.random.default_rng(0)
    for name in ("distance_m", "distance_std_m", "distance_true_m", "clearance_m", "camera_m", "tool_m"):
        values = getattr(trace, name)
        values += rng.normal(0.0, 0.01, values.shape)
    write_trace(tmp_path / "a.npz", trace)
    first = (tmp_path / "a.npz").read_bytes()
    assert len(first) < 30_000
    write_trace(tmp_path / "a.npz", trace)
    assert (tmp_path / "a.npz").read_bytes() == first


def test_no_file_is_no_trace_and_a_damaged_one_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    assert read_trace(path) is None
    write_trace(path, make_trace([("approach", 5)]))
    for content in (b"", b"nothing", path.read_bytes()[:200]):
        path.write_bytes(content)
        with pytest.raises(UsageError, match=r"a\.npz is no trace"):
            read_trace(path)


def test_every_stored_episode_has_its_trace_and_a_killed_run_resumes(tmp_path: Path) -> None:
    config = EvaluationConfig(scenarios=("clear",), episodes=3)
    ran: list[int] = []

    def run(cell: dict) -> dict:
        if len(ran) == 2:
            raise KeyboardInterrupt
        ran.append(cell["seed"])
        return run_fake_cell(cell)

    with pytest.raises(KeyboardInterrupt):
        evaluate(config, tmp_path, run)
    # A kill between a trace and its line: the episode runs again and replaces the trace.
    trace_file(tmp_path, "clear", 2).write_bytes(b"of the run that was killed")
    evaluate(config, tmp_path, run_fake_cell)
    assert len((tmp_path / EPISODES_FILE).read_text().splitlines()) == 3
    assert "trace" not in (tmp_path / EPISODES_FILE).read_text()
    for seed in range(3):
        trace = read_trace(trace_file(tmp_path, "clear", seed))
        assert trace is not None
        assert len(trace.phases) == 6


def test_a_file_in_the_place_of_the_traces_is_an_error(tmp_path: Path) -> None:
    (tmp_path / TRACES_FOLDER).write_text("mine")
    with pytest.raises(UsageError, match="traces is a file where a folder is needed; choose another --out"):
        EpisodeStore(tmp_path, {})
    assert [path.name for path in tmp_path.iterdir()] == [TRACES_FOLDER]
