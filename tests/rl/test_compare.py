"""The comparison with made-up training: resumes, aggregates, and comes out alike on every backend."""

import csv
import json
import os
from dataclasses import replace
from pathlib import Path

import pytest

from fixation_gym.errors import UsageError
from fixation_policies.rl.compare import SERVO, CompareConfig, compare
from fixation_policies.rl.comparison_tables import format_differences, format_table
from fixation_policies.rl.config import TrainConfig

CONFIG = CompareConfig(configs=("zfc", "blind"), seeds=4, scenarios=("clear", "mixed"), episodes=10)
SUCCESSES = {"zfc": (10, 8), "blind": (10, 5), SERVO: (9, 9)}


def run_fake_cell(cell):
    """Known rates: seed k of every configuration has k collisions on mixed."""
    clear, mixed = SUCCESSES[cell["config"]]
    rows = {
        "clear": {"episodes": 10, "successes": clear, "collision_free_successes": clear},
        "mixed": {"episodes": 10, "successes": mixed, "collision_free_successes": mixed - cell["seed"]},
    }
    points = [
        {
            "decisions": n,
            "env_steps": 9 * n + cell["seed"],
            "wall_s": 60.0 * n,
            "success": 0.1 * n,
            "collision_free": 0.0,
        }
        for n in (1, 2)
    ]
    curve = [] if cell["config"] == SERVO else points
    return {"config": cell["config"], "seed": cell["seed"], "curve": curve, "wall_s": 1.0, "scenarios": rows}


def test_tables_and_curves_are_the_aggregates_of_the_runs(tmp_path):
    summary = compare(CONFIG, tmp_path, run_fake_cell)
    assert json.loads((tmp_path / "summary.json").read_text()) == summary
    row = next(row for row in summary["table"] if (row["config"], row["scenario"]) == ("zfc", "mixed"))
    assert (row["seeds"], row["episodes"], row["success"]) == (4, 40, 0.8)
    assert row["collision_free"] == pytest.approx(0.65)  # the middle two of 0.8, 0.7, 0.6, 0.5
    assert 0.5 <= row["collision_free_low"] < 0.65 < row["collision_free_high"] <= 0.8
    difference = next(row for row in summary["differences"] if row["scenario"] == "mixed")
    assert (difference["config"], difference["minus"], difference["seeds"]) == ("zfc", "blind", 4)
    assert difference["success"] == difference["success_low"] == difference["success_high"] == pytest.approx(0.3)
    assert (difference["success_t_low"], difference["success_t_high"]) == pytest.approx((0.3, 0.3))
    assert difference["success_improved"] == 1.0
    point = next(point for point in summary["curves"] if point["config"] == "blind" and point["decisions"] == 2)
    assert (point["env_steps"], point["wall_min"], point["success"]) == (19.5, 2.0, pytest.approx(0.2))
    assert SERVO not in {point["config"] for point in summary["curves"]}
    with (tmp_path / "table.csv").open() as file:
        assert [row["config"] for row in csv.DictReader(file)] == [SERVO] * 3 + ["zfc"] * 3 + ["blind"] * 3
    with (tmp_path / "differences.csv").open() as file:
        assert [(row["minus"], row["scenario"]) for row in csv.DictReader(file)] == [
            ("blind", "clear"),
            ("blind", "mixed"),
        ]
    assert (tmp_path / "comparison.png").read_bytes().startswith(b"\x89PNG")


def test_a_killed_comparison_repeats_no_finished_run(tmp_path):
    ran = []

    def run(cell):
        if len(ran) == 5:
            raise KeyboardInterrupt
        ran.append((cell["config"], cell["seed"]))
        return run_fake_cell(cell)

    with pytest.raises(KeyboardInterrupt):
        compare(CONFIG, tmp_path / "killed", run)

    def run_rest(cell):
        ran.append((cell["config"], cell["seed"]))
        return run_fake_cell(cell)

    summary = compare(CONFIG, tmp_path / "killed", run_rest)
    assert len(ran) == len(set(ran)) == 9
    assert summary["table"] == compare(CONFIG, tmp_path / "whole", run_fake_cell)["table"]


def test_seeds_can_be_added_but_not_other_training(tmp_path):
    compare(CONFIG, tmp_path, run_fake_cell)
    more = compare(replace(CONFIG, seeds=5), tmp_path, run_fake_cell)
    assert {row["seeds"] for row in more["table"] if row["config"] != SERVO} == {5}
    with pytest.raises(UsageError, match="holds another run, with training"):
        compare(replace(CONFIG, training=TrainConfig(steps=5)), tmp_path, run_fake_cell)


@pytest.fixture(scope="module")
def local_ray():
    """A Ray cluster on this machine, whose workers can import this file."""
    import ray

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(Path(__file__).parent))
        ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
        yield
        ray.shutdown()


@pytest.mark.parametrize("backend", ["loky", "ray"])
def test_a_backend_finds_what_this_process_finds(tmp_path, backend, request):
    if backend == "ray":
        request.getfixturevalue("local_ray")
    here = compare(CONFIG, tmp_path / "here", run_fake_cell)
    there = compare(replace(CONFIG, workers=2, backend=backend), tmp_path / "there", run_fake_cell)
    for part in ("table", "curves", "runs"):
        assert there[part] == here[part]


def run_and_die(cell):
    os._exit(1)


def run_badly(cell):
    raise UsageError("the agent is damaged")


@pytest.mark.parametrize(
    ("workers", "run", "message"),
    [
        (3, run_fake_cell, "--workers must be at most 2, the CPUs of the Ray cluster, got 3"),
        (2, run_and_die, "Ray says .*Error: .*; finished batches are kept, and the same command goes on"),
        (2, run_badly, "^the agent is damaged$"),
    ],
)
def test_what_goes_wrong_on_a_ray_cluster_is_said_in_one_line(tmp_path, local_ray, workers, run, message):
    with pytest.raises(UsageError, match=message) as caught:
        compare(replace(CONFIG, workers=workers, backend="ray"), tmp_path, run)
    assert len(str(caught.value).splitlines()) == 1


def test_one_seed_has_no_difference_since_it_would_have_no_interval(tmp_path):
    summary = compare(replace(CONFIG, seeds=1), tmp_path, run_fake_cell)
    assert summary["differences"] == []
    assert (tmp_path / "differences.csv").read_text().strip() == ""


def test_the_table_for_people_has_percents_and_intervals(tmp_path):
    summary = compare(CONFIG, tmp_path, run_fake_cell)
    lines = format_table(summary["table"]).splitlines()
    assert len(lines) == 10
    assert " ".join(lines[1].split()) == "servo clear 1 90 [ 60, 98] 90 [ 60, 98]"  # Wilson's of 9 in 10
    assert format_differences(summary["differences"]).splitlines()[1].split() == (
        ["zfc", "-", "blind", "mixed", "4", "+30", "[", "+30,", "+30]", "+30", "[", "+30,", "+30]"]
    )


@pytest.mark.parametrize(
    ("config", "message"),
    [
        (replace(CONFIG, configs=("zfc", "sonar")), "unknown configuration 'sonar'; choose one of zfc, ways, blind"),
        (replace(CONFIG, configs=("zfc", "zfc")), "different ones"),
        (replace(CONFIG, seeds=0), "--seeds must be within 1..1000"),
        (replace(CONFIG, scenarios=("fog",)), "unknown scenario 'fog'"),
    ],
)
def test_bad_values_are_refused_with_what_is_allowed(config, message):
    with pytest.raises(UsageError, match=message):
        config.check()
