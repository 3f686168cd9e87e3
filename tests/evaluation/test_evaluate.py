"""Evaluation without a simulator: seeds, resuming, summary, workers."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from evaluation_fakes import run_fake_cell

from fixation_gym.errors import UsageError
from fixation_gym.evaluation import workers
from fixation_gym.evaluation.config import EvaluationConfig, episode_seeds
from fixation_gym.evaluation.evaluate import evaluate, seed_hash
from fixation_gym.evaluation.report import format_table
from fixation_gym.evaluation.storage import EPISODES_FILE

CONFIG = EvaluationConfig(scenarios=("clear", "opaque"), episodes=4)


def test_seed_blocks_do_not_overlap() -> None:
    assert episode_seeds(0, 3) == [0, 1, 2]
    assert episode_seeds(7, 2) == [700_000, 700_001]


def test_the_seed_hash_is_stable() -> None:
    # printf '[["clear",0],["clear",1]]' | sha256sum
    expected = "5004d76341a36046a43cea527c6839dd7a7dd1e4929aaa4314f398c74500bc31"
    assert seed_hash([("clear", 0), ("clear", 1)]) == expected
    assert seed_hash([("clear", 1), ("clear", 0)]) != expected


def test_the_summary_has_the_documented_keys(tmp_path: Path) -> None:
    summary = evaluate(CONFIG, tmp_path, run_fake_cell)
    assert json.loads((tmp_path / "summary.json").read_text()) == summary
    assert {"policy", "scenarios", "seed_sha256", "versions", "gl", "wall_s"} <= set(summary)
    assert list(summary["scenarios"]) == ["clear", "opaque"]
    clear = summary["scenarios"]["clear"]
    # Seeds 0 and 2 succeed, 0 with a collision.
    assert (clear["episodes"], clear["successes"], clear["collision_free_successes"]) == (4, 2, 1)
    assert clear["success_ci95"] == pytest.approx([0.1500, 0.8500], abs=1e-4)
    assert clear["collision_free_ci95"] == pytest.approx([0.0456, 0.6994], abs=1e-4)
    assert clear["mean_time_s"] == pytest.approx(0.2)
    assert clear["distance_mae_m"] == pytest.approx(0.05)
    assert clear["fixation_rms_px"] == pytest.approx(12.5**0.5)
    assert clear["distance_error_at_grasp_median_m"] == pytest.approx(0.05)


def test_a_killed_run_resumes_without_losing_or_repeating_an_episode(tmp_path: Path) -> None:
    ran: list[tuple[str, int]] = []

    def run(cell: workers.Cell) -> dict:
        if len(ran) == 3:
            raise KeyboardInterrupt
        ran.append((cell["scenario"], cell["seed"]))
        return run_fake_cell(cell)

    with pytest.raises(KeyboardInterrupt):
        evaluate(CONFIG, tmp_path / "killed", run)
    assert not (tmp_path / "killed" / "summary.json").exists()

    def run_rest(cell: workers.Cell) -> dict:
        ran.append((cell["scenario"], cell["seed"]))
        return run_fake_cell(cell)

    resumed = evaluate(CONFIG, tmp_path / "killed", run_rest)
    assert ran == CONFIG.episode_keys()
    assert resumed["episodes_resumed"] == 3
    whole = evaluate(CONFIG, tmp_path / "whole", run_fake_cell)
    assert resumed["scenarios"] == whole["scenarios"]
    files = [(tmp_path / name / EPISODES_FILE).read_bytes() for name in ("killed", "whole")]
    assert files[0] == files[1]


def test_a_finished_run_runs_nothing_again(tmp_path: Path) -> None:
    def fail(cell: workers.Cell) -> dict:
        raise AssertionError("ran an episode again")

    first = evaluate(CONFIG, tmp_path, run_fake_cell)
    assert evaluate(CONFIG, tmp_path, fail)["scenarios"] == first["scenarios"]


def test_more_episodes_can_be_added_to_a_run(tmp_path: Path) -> None:
    evaluate(CONFIG, tmp_path, run_fake_cell)
    more = EvaluationConfig(scenarios=("opaque",), episodes=6)
    summary = evaluate(more, tmp_path, run_fake_cell)
    assert summary["episodes_resumed"] == 4
    assert list(summary["scenarios"]) == ["opaque"]
    assert summary["scenarios"]["opaque"]["episodes"] == 6


def test_two_workers_find_what_one_finds(tmp_path: Path) -> None:
    one = evaluate(CONFIG, tmp_path / "one", run_fake_cell)
    two = evaluate(
        EvaluationConfig(scenarios=CONFIG.scenarios, episodes=CONFIG.episodes, workers=2),
        tmp_path / "two",
        run_fake_cell,
    )
    assert two["scenarios"] == one["scenarios"]
    lines = [sorted((tmp_path / name / EPISODES_FILE).read_text().splitlines()) for name in ("one", "two")]
    assert lines[0] == lines[1]


def test_the_table_has_a_row_per_scenario(tmp_path: Path) -> None:
    lines = format_table(evaluate(CONFIG, tmp_path, run_fake_cell)["scenarios"]).splitlines()
    assert " ".join(lines[2].split()) == "clear 2/4 50% [15, 85] 1/4 25% [5, 70] 0.2 50.0"
    assert lines[3].startswith("opaque")


@pytest.mark.parametrize(
    ("config", "message"),
    [
        (EvaluationConfig(episodes=0), "--episodes must be within 1"),
        (EvaluationConfig(seed=-1), "--seed must be 0 or more"),
        (EvaluationConfig(scenarios=("clear", "clear")), "different scenarios"),
        (EvaluationConfig(scenarios=("clear", "nowhere")), "unknown scenario 'nowhere'; choose one of clear, opaque,"),
        (EvaluationConfig(policy="best"), "unknown policy 'best'; choose one of .*servo"),
        (EvaluationConfig(sensor_noise="loud"), "unknown sensor noise 'loud'; choose one of ideal, nominal"),
        (EvaluationConfig(image_size=(8, 320)), "--image-size must be within 32..2048"),
        (EvaluationConfig(workers=0), "--workers must be at least 1"),
        (EvaluationConfig(backend="slurm"), "unknown backend 'slurm'; choose one of loky, ray"),
    ],
)
def test_a_bad_value_is_an_error_that_says_what_is_allowed(config: EvaluationConfig, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        config.check()


@pytest.mark.parametrize(
    ("policy", "asked", "size"),
    [
        ("servo", None, [240, 320]),
        ("policies/fixation_policies/agents/zfc.zip", None, [96, 128]),
        ("servo", (64, 80), [64, 80]),
    ],
)
def test_the_image_has_the_size_that_is_asked_for_or_the_policys_own(
    policy: str, asked: tuple[int, int] | None, size: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(Path(__file__).parents[2])
    config = EvaluationConfig(policy, image_size=asked)
    assert config.cell(("clear", 0))["image_size"] == config.run_description()["image_size"] == size


def test_ray_is_an_error_where_it_is_not_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(UsageError, match="needs the package ray"):
        workers.check_backend("ray", 2)
