"""Every command that writes, cut down to seconds: what the checks of this folder run in processes of their own.

``python tests/reliability/small_commands.py NAME FOLDER`` runs one of them, or goes on with it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

from fixation_gym import cli, learning_commands, recording_commands, report_commands
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.evaluation.storage import RUN_FILE
from fixation_gym.experiments.distance import config as distance_config

SMALLEST = (32, 32)
SMALL = (64, 80)
SOURCES = {"report": ("evaluate", "source"), "replay": ("record", "recordings")}
"""Commands that read the results of another one, that one, and the folder beside their own in which those are."""
_TRAINING = {
    "config": "blind",
    "scenario": "clear",
    "steps": 20,
    "eval_every": 20,
    "eval_episodes": 1,
    "workers": 1,
    "checkpoint_minutes": 0.02,
    "learning_starts": 8,
    "buffer_size": 200,
}


def evaluate(out: Path, workers: int = 1) -> int:
    return cli.Evaluate(
        policy="oracle", scenarios=("clear", "shelf"), episodes=2, image_size=SMALLEST, workers=workers, out=out
    ).run()


def evaluate_workers(out: Path) -> int:
    return evaluate(out, workers=2)


def export(out: Path, workers: int = 1) -> int:
    return cli.Export(
        policy="oracle", scenarios=("clear",), episodes=3, image_size=SMALLEST, workers=workers, out=out
    ).run()


def export_workers(out: Path) -> int:
    return export(out, workers=2)


def record(out: Path, workers: int = 1) -> int:
    return recording_commands.Record(
        policy="oracle", scenarios=("clear",), episodes=3, image_size=SMALL, seconds=2.0, workers=workers, out=out
    ).run()


def record_workers(out: Path) -> int:
    return record(out, workers=2)


def replay(out: Path) -> int:
    recordings = out.parent / SOURCES["replay"][1]
    return recording_commands.Replay(recording=min(recordings.glob("clear-*")), out=out).run()


def report(out: Path) -> int:
    return report_commands.Report((out.parent / SOURCES["report"][1],), out=out).run()


def ablate(out: Path) -> int:
    return report_commands.Ablate(variant=("blind",), scenarios=("clear",), episodes=1, image_size=SMALL, out=out).run()


def ladder(out: Path) -> int:
    from fixation_gym.reporting.ladder import climb

    cli.select_backend()
    climb(EvaluationConfig(scenarios=("clear",), episodes=1, image_size=SMALL), {"paper": "it"}, ("oracle",), out, 4)
    return 0


def train(out: Path) -> int:
    return learning_commands.Train(**_TRAINING, resume=(out / RUN_FILE).exists(), out=out).run()


def compare(out: Path) -> int:
    from fixation_policies.rl import compare as comparison
    from fixation_policies.rl.config import TrainConfig

    cli.select_backend()
    config = comparison.CompareConfig(("blind",), 1, TrainConfig(**_TRAINING), scenarios=("clear",), episodes=1)
    config.check()
    comparison.compare(config, out)
    return 0


def distance(out: Path) -> int:
    distance_config.QUICK_DISTANCES = (0.15,)
    return cli.Distance(quick=True, count=1, out=out).run()


def scenarios(out: Path) -> int:
    return cli.Scenarios(quick=True, count=1, out=out).run()


def necessity(out: Path) -> int:
    return report_commands.Necessity(scenarios=("opaque",), quick=True, episodes=2, beside=(), out=out).run()


def robustness(out: Path) -> int:
    return report_commands.Robustness(rows=("jpeg",), scenarios=("clear",), episodes=1, out=out).run()


def transfer(out: Path) -> int:
    return learning_commands.Transfer(
        configs=(), policies=("oracle",), axes=("light_colour",), severities=("middle",), episodes=3, out=out
    ).run()


def demo(out: Path) -> int:
    return cli.Demo(policy="blind", scenarios=("clear",), out=out).run()


COMMANDS: dict[str, Callable[[Path], int]] = {
    command.__name__: command
    for command in (
        *(evaluate, evaluate_workers, export, export_workers, record, record_workers, report, replay),
        *(ablate, ladder, distance, necessity, scenarios, robustness, transfer, demo, train, compare),
    )
}
REFERENCES = {"evaluate_workers": "evaluate", "export_workers": "export", "record_workers": "record"}
"""Commands that have to leave what another one leaves."""


def main(name: str, out: Path) -> int:
    """Run a command of this file as the command line runs its own."""
    with patch.object(cli, "parse", return_value=SimpleNamespace(run=partial(COMMANDS[name], out))):
        return cli.main()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], Path(sys.argv[2])))
