"""The cut-down commands behind `make kills` and `make full_disk` name options that there are. Nothing is run."""

import pytest
from small_commands import COMMANDS

from fixation_gym import cli, learning_commands, recording_commands, report_commands
from fixation_gym.experiments.distance import config as distance_config

CLASSES = (
    *(cli.Demo, cli.Distance, cli.Evaluate, cli.Export, cli.Scenarios, recording_commands.Record),
    *(report_commands.Ablate, report_commands.Necessity, report_commands.Report, report_commands.Robustness),
    *(learning_commands.Train, learning_commands.Transfer),
)
NOT_ONE_CLASS = {"replay", "ladder", "compare"}
"""These read a recording, or call what is behind their class."""


@pytest.mark.parametrize("name", sorted(set(COMMANDS) - NOT_ONE_CLASS))
def test_a_small_command_is_one_of_the_command_line(name, monkeypatch, tmp_path):
    monkeypatch.setattr(distance_config, "QUICK_DISTANCES", distance_config.QUICK_DISTANCES)
    started = []
    for command in CLASSES:
        monkeypatch.setattr(command, "run", lambda self: started.append(self) or 0)
    assert COMMANDS[name](tmp_path / "results") == 0
    assert [command.out for command in started] == [tmp_path / "results"]
