"""The best blind way: how it is chosen, and what the command runs and writes."""

from __future__ import annotations

import csv
import json
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from evaluation_fakes import FakeEnv, FakePolicy

from fixation_gym import cli, report_commands
from fixation_gym.errors import UsageError
from fixation_gym.evaluation.statistics import paired_difference_interval, wilson_interval
from fixation_gym.experiments.necessity import run as necessity
from fixation_gym.experiments.necessity.config import NecessityConfig, scenarios_with_obstacles
from fixation_gym.experiments.necessity.episodes import Outcome, play_in
from fixation_gym.experiments.necessity.run import (
    FIGURE_FILE,
    ROWS_FILE,
    TABLE_FILE,
    cell_key,
    measure,
)
from fixation_gym.experiments.necessity.statistics import chosen_ways, format_table, summarise
from fixation_gym.experiments.necessity.ways import QUICK_WAYS, WAYS

CONFIG = NecessityConfig(scenarios=("opaque", "bin"), quick=True)


# -- the choice --------------------------------------------------------------------------------------------------------


def episode(scenario: str, member: str, seed: int, success: bool) -> dict[str, Any]:
    values = {"scenario": scenario, "member": member, "seed": seed, "success": success}
    return {**values, "collision": not success, "time_s": 1.0, "phase": "lift"}


def made_up(scenario: str, successes: Mapping[str, tuple[int, int]], n: int = 10) -> list[dict[str, Any]]:
    """Episodes with so many successes of n on the even seeds and on the odd ones."""
    return [
        episode(scenario, member, 2 * index + half, index < k)
        for member, halves in successes.items()
        for half, k in enumerate(halves)
        for index in range(n)
    ]


def test_the_best_way_is_chosen_on_one_half_and_judged_on_the_other():
    episodes = made_up("bin", {"a": (4, 9), "b": (6, 2), "c": (6, 5), "blind": (1, 2), "oracle": (10, 9)})
    summary = summarise(episodes, ("a", "b", "c"))
    (row,) = summary["table"]
    assert (row["best"], row["best_k"], row["best_n"], row["chosen_on_k"]) == ("b", 2, 10, 6)
    assert (row["best_low"], row["best_high"]) == wilson_interval(2, 10)
    assert row["mean_rate"] == pytest.approx(16 / 30)
    assert (row["blind_k"], row["blind_n"], row["oracle_k"]) == (3, 20, 19)
    assert "agent_k" not in row
    assert {(r["member"], r["k"], r["n"], r["collisions"]) for r in summary["rows"]} >= {("a", 13, 20, 7)}
    text = format_table(summary["table"])
    assert "2/10  20% [6, 51]" in text
    assert "upper bound" in text


def test_ways_are_chosen_by_scenario_and_for_all_at_once():
    episodes = [*made_up("bin", {"a": (6, 9), "b": (5, 0)}), *made_up("opaque", {"a": (0, 9), "b": (4, 0)})]
    even = [episode for episode in episodes if episode["seed"] % 2 == 0]
    assert chosen_ways(even, ("a", "b")) == {"bin": ("a", "b"), "opaque": ("b",)}
    only = [episode for episode in even if episode["scenario"] == "bin"]
    assert chosen_ways(only, ("a", "b")) == {"bin": ("a",)}


def test_an_evaluation_is_paired_with_the_best_way_on_the_odd_seeds():
    episodes = made_up("bin", {"a": (6, 2), "b": (5, 9)})  # a: seeds 1 and 3 of the odd ones
    evaluated = {("bin", seed): seed != 1 for seed in range(20)}
    (row,) = summarise(episodes, ("a", "b"), evaluated)["table"]
    assert (row["evaluated_k"], row["evaluated_n"]) == (9, 10)
    assert row["difference"] == pytest.approx(0.7)
    assert (row["difference_low"], row["difference_high"]) == paired_difference_interval(1, 8, 1, 0)
    assert "+70 [" in format_table([row])
    (row,) = summarise(episodes, ("a", "b"), {("opaque", 1): True})["table"]
    assert "difference" not in row


def test_one_way_for_all_scenarios_is_chosen_too_and_an_agent_has_its_column():
    first = made_up("bin", {"a": (6, 1), "b": (5, 5), "agent:0123": (3, 3)})
    second = made_up("opaque", {"a": (0, 9), "b": (4, 4), "agent:0123": (1, 0)})
    table = summarise([*first, *second], ("a", "b"))["table"]
    assert [row["scenario"] for row in table] == ["bin", "opaque", "all"]
    assert [row["best"] for row in table] == ["a", "b", "b"]
    assert table[-1]["best_low"] is None
    assert "9/20  45%  " in format_table(table)
    assert (table[-1]["best_k"], table[-1]["best_n"], table[-1]["agent_k"]) == (9, 20, 7)


# -- the command -------------------------------------------------------------------------------------------------------


def fake_run(cell: dict[str, Any]) -> dict[str, Any]:
    good = cell["member"] == "oracle" or zlib.crc32(f"{cell['member']} {cell['seed']}".encode()) % 5 == 0
    return episode(cell["scenario"], cell["member"], cell["seed"], good)


def read_lines(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / "episodes.jsonl").read_text().splitlines()]


def test_by_default_all_plain_scenarios_with_obstacles_are_tried_with_all_ways():
    config = NecessityConfig()
    made_for_mitsuba = {"glass", "chrome", "two_mirrors", "window", "photoreal_mixed"}
    assert set(scenarios_with_obstacles()) - set(config.scenario_names) == made_for_mitsuba
    assert {"opaque", "bin", "moving_obstacle"} <= set(config.scenario_names)
    assert not {"clear", "moving_target", "distractor"} & set(config.scenario_names)
    scenarios = len(config.scenario_names)
    choosing = config.choosing()
    assert len(choosing) == (len(WAYS) + 1) * 20 * scenarios
    judging = config.judging({name: tuple(WAYS)[:2] for name in config.scenario_names})
    assert len(judging) == (2 + 1 + len(config.policies())) * 20 * scenarios
    assert all(cell_key(cell) == key for key, cell in [*choosing.items(), *judging.items()])
    assert {seed % 2 for *_, seed in choosing} == {0}
    assert {seed % 2 for *_, seed in judging} == {1}
    assert config.policies() == {"blind": "blind", "blind:slow": "blind:slow"}
    alone = NecessityConfig(beside=())
    alone.check()
    assert alone.policies() == {}


def test_another_agent_is_another_member(tmp_path: Path):
    members = []
    for content in (b"one", b"two"):
        (tmp_path / "agent.zip").write_bytes(content)
        members += [m for m in NecessityConfig(agent=tmp_path / "agent.zip").policies() if m.startswith("agent:")]
    assert len(set(members)) == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--scenario", "nowhere"], "unknown scenario 'nowhere'; choose one of clear, opaque"),
        (["--scenario", "bin,bin"], "--scenario must name one or more different scenarios"),
        (["--episodes", "5"], "--episodes must be an even number within 2.."),
        (["--episodes", "0"], "--episodes must be an even number within 2.."),
        (["--seed", "-1"], "--seed must be 0 or more"),
        (["--workers", "0"], "--workers must be at least 1"),
        (["--agent", "agent.txt"], "--agent must be an agent's .zip, got agent.txt"),
        (["--agent", "nowhere.zip"], "nowhere.zip"),
        (["--beside", "oracle"], "unknown policy 'oracle'; choose one of servo, blind"),
        (["--evaluation", "nowhere"], "cannot read nowhere/run.json: it is missing"),
    ],
)
def test_bad_options_are_one_line_and_leave_no_folder(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    assert cli.main(["necessity", "--out", str(tmp_path / "out"), *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert message in captured.err
    assert list(tmp_path.iterdir()) == []


def test_a_killed_run_resumes_without_losing_or_repeating(tmp_path: Path):
    calls: list[tuple[Any, ...]] = []

    def dying(cell: dict[str, Any]) -> dict[str, Any]:
        if len(calls) == 9:
            raise KeyboardInterrupt
        calls.append(cell_key(cell))
        return fake_run(cell)

    with pytest.raises(KeyboardInterrupt):
        measure(CONFIG, tmp_path, dying)
    calls.append(("killed", "", 0))
    summary = measure(CONFIG, tmp_path, lambda cell: calls.append(cell_key(cell)) or fake_run(cell))
    calls.remove(("killed", "", 0))
    assert summary["episodes_resumed"] == 9
    assert len(calls) == len(set(calls)) == len(read_lines(tmp_path))
    assert set(CONFIG.choosing()) < set(calls)
    assert summary["table"] == measure(CONFIG, tmp_path / "other", fake_run)["table"]
    measure(CONFIG, tmp_path, lambda cell: pytest.fail("nothing is left to do"))
    with pytest.raises(UsageError, match="seed 0 instead of 1"):
        measure(NecessityConfig(scenarios=("bin",), quick=True, seed=1), tmp_path, fake_run)


def test_the_folder_holds_summary_tables_and_figure(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(report_commands, "select_backend", lambda: "egl")
    monkeypatch.setattr(necessity.measure, "__defaults__", (fake_run,))
    assert cli.main(["necessity", "--quick", "--scenario", "opaque,bin", "--out", str(tmp_path)]) == 0
    assert capsys.readouterr().out.startswith("scenario")
    summary = json.loads((tmp_path / "summary.json").read_text())
    lines = read_lines(tmp_path)
    assert sum(line["seed"] % 2 == 0 for line in lines) == (len(QUICK_WAYS) + 1) * 2 * 2
    assert all(row["best_n"] == 2 for row in summary["table"] if row["scenario"] != "all")
    for name, rows in ((ROWS_FILE, summary["rows"]), (TABLE_FILE, summary["table"])):
        with (tmp_path / name).open(newline="") as file:
            assert len(list(csv.DictReader(file))) == len(rows)
    assert (tmp_path / FIGURE_FILE).read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(("seed", "success", "steps", "phase"), [(2, True, 5, "lift"), (4, False, 2, "approach")])
def test_an_episode_with_images_ends_at_its_first_collision(seed, success, steps, phase):
    outcome = play_in(FakeEnv(), FakePolicy(), seed)
    assert outcome == Outcome(success, not success, pytest.approx(steps / 25.0), phase)
