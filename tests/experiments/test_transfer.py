"""The transfer experiment: known rates give known rows, a killed run goes on, and bad input ends in one line."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from fixation_gym.cli import main
from fixation_gym.errors import UsageError
from fixation_gym.experiments.transfer import config as transfer_config
from fixation_gym.experiments.transfer.config import Candidate, TransferConfig
from fixation_gym.experiments.transfer.run import CSV_FILE, DIFFERENCES_FILE, FIGURE_FILE, measure
from fixation_gym.experiments.transfer.shifts import APPEARANCE, AXES, NONE, SEVERITIES
from fixation_gym.experiments.transfer.statistics import format_table
from fixation_policies.rl.agent_file import AgentCard, write_agent
from fixation_policies.rl.config import CONFIGS, FINAL_FILE, TrainConfig
from fixation_policies.rl.network import weight_shapes

AXES_HERE = ("light_colour", "object_textures", "latency")
CONFIG = TransferConfig(
    configs=("zfc", "rgb"),
    seeds=3,
    policies=("servo",),
    axes=AXES_HERE,
    severities=("mild", "middle"),
    episodes=4,
)
LOST = {("rgb", "object_textures"): 2, ("rgb", "light_colour"): 1, ("servo", "latency"): 3}
"""Episodes of the four that end in a collision at the middle severity."""


def train(config, folder):
    return [
        Candidate(name, seed, f"{name}-{seed}.zip", "0" * 12, trained=True)
        for name in config.configs
        for seed in range(config.seeds)
    ]


def run(cell):
    lost = LOST.get((cell["name"], cell["axis"]), 0) if cell["severity"] == "middle" else 0
    index = cell["seed"] % 100_000
    named = {name: cell[name] for name in ("name", "training_seed", "digest", "axis", "severity", "seed")}
    return {**named, "success": True, "collision": index < lost, "time_s": 9.0}


def row(rows, *names):
    return next(row for row in rows if (row["config"], row["axis"], row["severity"]) == names)


def test_known_episodes_give_known_rows(tmp_path):
    summary = measure(CONFIG, tmp_path, run, train)
    assert json.loads((tmp_path / "summary.json").read_text()) == summary
    rows = summary["rows"]
    plain = row(rows, "rgb", NONE, NONE)
    assert (plain["seeds"], plain["episodes"], plain["collision_free"], plain["loss"]) == (3, 12, 1.0, None)
    shifted = row(rows, "rgb", "object_textures", "middle")
    assert (shifted["success"], shifted["collision_free"], shifted["loss"]) == (1.0, 0.5, 0.5)
    assert row(rows, "rgb", APPEARANCE, "middle")["loss"] == pytest.approx(1.5 / 4)  # of colours and light, not latency
    assert row(rows, "zfc", APPEARANCE, "middle")["loss"] == 0.0
    servo = row(rows, "servo", "latency", "middle")
    assert (servo["seeds"], servo["episodes"], servo["loss"]) == (1, 4, 0.75)
    assert 0.0 < servo["loss_low"] < 0.75 < servo["loss_high"] <= 1.0
    assert row(rows, "servo", "latency", "mild")["loss"] == 0.0
    assert "50 (+50)" in format_table(rows)


def test_differences_are_paired_by_training_seed(tmp_path):
    rows = measure(CONFIG, tmp_path, run, train)["differences"]
    found = {(row["minus"], row["axis"], row["severity"]): row for row in rows}
    assert {minus for minus, *_ in found} == {"rgb"}
    assert found["rgb", "object_textures", "middle"]["collision_free"] == 0.5
    assert found["rgb", APPEARANCE, "middle"]["collision_free"] == pytest.approx(0.375)
    assert found["rgb", NONE, NONE]["collision_free"] == 0.0


def test_files_are_there(tmp_path):
    measure(CONFIG, tmp_path, run, train)
    with (tmp_path / CSV_FILE).open() as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == 3 * (1 + 2 * (len(AXES_HERE) + 1))
    assert (tmp_path / DIFFERENCES_FILE).read_text().startswith("config,minus,axis,severity,seeds")
    assert (tmp_path / FIGURE_FILE).stat().st_size > 10_000


def test_a_killed_run_repeats_no_episode_and_more_severities_can_be_added(tmp_path):
    ran = []

    def killed(cell):
        if len(ran) == 50:
            raise KeyboardInterrupt
        ran.append((cell["name"], cell["training_seed"], cell["axis"], cell["severity"], cell["seed"]))
        return run(cell)

    with pytest.raises(KeyboardInterrupt):
        measure(CONFIG, tmp_path, killed, train)
    ran.append("killed")
    measure(replace(CONFIG, severities=SEVERITIES), tmp_path, killed, train)
    ran.remove("killed")
    assert len(ran) == len(set(ran)) == 7 * 4 * (1 + 3 * len(AXES_HERE))


def test_all_axes_at_the_middle_severity_come_before_any_other():
    names = [(shift.axis, shift.severity) for shift in TransferConfig().shifts()]
    assert names[0] == (NONE, NONE)
    assert names[1 : 1 + len(AXES)] == [(axis, "middle") for axis in AXES]
    assert len(names) == len(set(names)) == 1 + 3 * len(AXES)


def test_an_agent_that_was_trained_again_is_tested_again(tmp_path):
    def other(config, folder):
        return [replace(agent, digest="1" * 12) for agent in train(config, folder)]

    measure(CONFIG, tmp_path, run, train)
    summary = measure(CONFIG, tmp_path, run, other)
    assert summary["episodes_resumed"] == 4 * (1 + 2 * len(AXES_HERE))  # the servo's


def test_a_class_that_was_changed_is_tested_again_and_is_no_learner(tmp_path, monkeypatch):
    module = tmp_path / "somebodys_policy.py"
    module.write_text("class Still:\n    reset = act = print\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    config = replace(CONFIG, configs=(), policies=("somebodys_policy:Still",))
    assert measure(config, tmp_path / "out", run)["differences"] == []
    assert measure(config, tmp_path / "out", run)["episodes_resumed"] == 4 * (1 + 2 * len(AXES_HERE))
    module.write_text(module.read_text() + "# changed\n")
    assert measure(config, tmp_path / "out", run)["episodes_resumed"] == 0


@pytest.fixture
def agent(tmp_path):
    path = tmp_path / "agent.zip"
    weights = {name: np.zeros(shape) for name, shape in weight_shapes("sac", CONFIGS["blind"], 4).items()}
    write_agent(path, AgentCard("blind", "sac", (96, 128), "mixed", 0, 1000, 9000, {"torch": "2"}), weights)
    return str(path)


@pytest.fixture
def comparison(tmp_path):
    """A comparison that was killed before its last run."""
    for name in ("zfc-0", "blind-0", "zfc-1"):
        (tmp_path / "comparison" / "runs" / name).mkdir(parents=True)
        (tmp_path / "comparison" / "runs" / name / FINAL_FILE).touch()
    return str(tmp_path / "comparison")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--axis", "fog"], "unknown axis 'fog'; choose one of material_translucent, material_mirror"),
        (["--severity", "4"], "unknown severity '4'; choose one of mild, middle, strong"),
        (["--config", "sonar"], "unknown configuration 'sonar'; choose one of zfc, ways, blind, rgb"),
        (["--policy", "blind"], "--policy takes what is not trained, got 'blind'"),
        (["--scenario", "clear"], "--axis clutter does not go with --scenario clear: obstacle_count (5, 9) needs"),
        (["--scenario", "moon"], "unknown scenario 'moon'"),
        (["--config", "", "--policy", ""], "there is nobody to test"),
        (["--episodes", "0"], "--episodes must be within 1.."),
        (["--workers", "0"], "--workers must be at least 1"),
        (["--agent", "AGENT"], "was trained on mixed; --agent takes those trained on opaque"),
        (["--agent", "AGENT,AGENT", "--scenario", "mixed"], "nobody may be tested twice"),
        (["--runs", "mistyped", "--config", "zfc", "--seeds", "1"], "lacks zfc-0"),
        (["--runs", "COMPARISON", "--config", "zfc,blind", "--seeds", "2"], "lacks blind-1"),
        (["--runs", "COMPARISON", "--config", ""], "--runs goes with agents to train"),
    ],
)
def test_bad_options_end_as_one_line(options, message, agent, comparison, capsys, tmp_path):
    options = [option.replace("AGENT", agent).replace("COMPARISON", comparison) for option in options]
    assert main(["transfer", *options, "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert len(error.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_another_scenario_is_another_run(tmp_path):
    measure(CONFIG, tmp_path, run, train)
    with pytest.raises(UsageError, match="holds another run, with scenario"):
        measure(replace(CONFIG, scenario="mixed"), tmp_path, run, train)


@pytest.mark.sim
def test_a_tiny_run_trains_and_tests_and_does_neither_again(tmp_path, monkeypatch, capsys):
    tiny = TrainConfig(
        steps=24, image_size=(48, 64), eval_every=24, eval_episodes=2, learning_starts=8, buffer_size=100
    )
    monkeypatch.setattr(transfer_config, "_QUICK", tiny)
    command = ["transfer", "--quick", "--scenario", "opaque", "--env-workers", "2", "--out", str(tmp_path)]
    assert main(command) == 0
    rows = json.loads((tmp_path / "summary.json").read_text())["rows"]
    assert {(row["config"], row["axis"]) for row in rows} == {
        (name, axis) for name in ("zfc", "servo") for axis in (NONE, "object_textures", "light_colour", APPEARANCE)
    }
    written = (tmp_path / "runs" / "zfc-0" / "final.zip").read_bytes()
    assert main(command) == 0
    assert json.loads((tmp_path / "summary.json").read_text())["episodes_resumed"] == 6
    assert (tmp_path / "runs" / "zfc-0" / "final.zip").read_bytes() == written
    capsys.readouterr()
