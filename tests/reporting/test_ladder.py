"""The ladder without a simulator: its rungs, their paired steps, table and figure."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import pytest
from evaluation_fakes import run_fake_cell

from fixation_gym.evaluation import workers
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.evaluation.statistics import paired_difference_interval
from fixation_gym.reporting.ladder import FIGURE_FILE, LADDER_FILE, climb, format_ladder
from fixation_policies.catalogue import POLICY_NAMES
from fixation_policies.ladder import BESIDE, LADDER
from fixation_policies.paper import PAPER_NAMES

RUNGS = {"paper": "the start", "servo": "all the rest"}


def run(cell: workers.Cell) -> dict[str, Any]:
    """Of every four seeds the servo picks the second and the third, the paper's algorithm the third."""
    result = run_fake_cell(cell)
    success = cell["seed"] % 4 in ((2,) if cell["policy"] == "paper" else (1, 2))
    return {**result, "success": success, "collision": False, "collision_free_success": success}


def test_every_rung_is_a_policy_and_the_ladder_leads_from_the_paper_to_the_servo() -> None:
    assert {*LADDER, *BESIDE} <= set(POLICY_NAMES)
    assert not set(LADDER) & set(BESIDE)
    assert tuple(LADDER)[: len(PAPER_NAMES)] == PAPER_NAMES
    assert tuple(LADDER)[-1] == "servo"


@pytest.mark.parametrize("scenarios", [("clear",), ("clear", "opaque")])
def test_each_rung_is_paired_with_the_one_below(tmp_path: Path, scenarios: tuple[str, ...]) -> None:
    config = EvaluationConfig(scenarios=scenarios, episodes=4)
    rows = climb(config, RUNGS, ["random"], tmp_path, 0, run)
    assert [row["policy"] for row in rows if row["scenario"] == "clear"] == ["paper", "servo", "random"]
    paper, servo, beside = (row for row in rows if row["scenario"] == "all")
    n = len(scenarios)
    assert (paper["collision_free"], servo["collision_free"], servo["episodes"]) == (n, 2 * n, 4 * n)
    assert servo["step"] == pytest.approx(0.25)
    assert (servo["step_low"], servo["step_high"]) == paired_difference_interval(n, n, 0, 2 * n)
    assert paper["step"] is None
    assert beside["step"] is None
    with (tmp_path / LADDER_FILE).open(newline="") as file:
        assert len(list(csv.DictReader(file))) == len(rows)
    assert (tmp_path / FIGURE_FILE).read_bytes().startswith(b"\x89PNG")
    lines = format_ladder(rows).splitlines()
    assert len(lines) == 4
    assert "+25 [" in lines[2]
    assert lines[2].endswith("all the rest")


def test_a_killed_run_resumes(tmp_path: Path) -> None:
    config = EvaluationConfig(scenarios=("clear",), episodes=4)
    ran: list[str] = []

    def dying(cell: workers.Cell) -> dict[str, Any]:
        if len(ran) == 5:
            raise KeyboardInterrupt
        ran.append(cell["policy"])
        return run(cell)

    with pytest.raises(KeyboardInterrupt):
        climb(config, RUNGS, [], tmp_path, 0, dying)
    rest: list[str] = []
    climb(config, RUNGS, [], tmp_path, 0, lambda cell: rest.append(cell["policy"]) or run(cell))
    assert [*ran, *rest] == ["paper"] * 4 + ["servo"] * 4


def test_a_folder_with_more_episodes_counts_those_that_are_asked_for(tmp_path: Path) -> None:
    climb(EvaluationConfig(scenarios=("clear", "opaque"), episodes=4), RUNGS, [], tmp_path, 0, run)
    fewer = EvaluationConfig(scenarios=("clear",), episodes=2)
    again = climb(fewer, RUNGS, [], tmp_path, 0, lambda cell: pytest.fail("nothing is left to do"))
    assert again == climb(fewer, RUNGS, [], tmp_path / "alone", 0, run)
    assert {(row["scenario"], row["episodes"]) for row in again} == {("clear", 2), ("all", 2)}
