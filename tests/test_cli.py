"""The command line: bad input ends with one line and exit code 2, and leaves nothing."""

from __future__ import annotations

import errno
import json
import os
import signal
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from fixation_gym import cli, doctor, gl, learning_commands, report_commands
from fixation_gym.evaluation import clips, demo, evaluate
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.reporting import ablation, ladder
from fixation_policies.rl.config import TrainConfig


@pytest.fixture(autouse=True)
def _no_gl(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (cli, report_commands):
        monkeypatch.setattr(module, "select_backend", lambda: "egl")


def error_line(capsys: pytest.CaptureFixture[str]) -> str:
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert captured.err.startswith("fixation-gym: error: ")
    return captured.err


@pytest.mark.parametrize("command", ["demo", "evaluate", "ablate"])
@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--scenario", "nowhere", "unknown scenario 'nowhere'; choose one of clear, opaque,"),
        ("--scenario", "clear,nowhere", "unknown scenario 'nowhere'; choose one of clear, opaque,"),
        ("--scenario", "", "unknown scenario ''"),
        ("--policy", "best", "unknown policy 'best'; choose one of "),
        ("--episodes", "0", "--episodes must be within 1.."),
        ("--episodes", "many", "--episodes"),
        ("--seed", "-1", "--seed must be 0 or more"),
        ("--bogus", "1", "--bogus"),
    ],
)
def test_bad_input_is_one_line_and_leaves_no_folder(
    command: str, option: str, value: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if (command, option) == ("ablate", "--policy"):  # ablations have variants instead
        option, message = "--variant", "unknown variant 'best'; choose one of servo, blind, blind:slow"
    assert cli.main([command, "--out", str(tmp_path / "out"), option, value]) == 2
    assert message in error_line(capsys)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("arguments", [[], ["levitate"]])
def test_a_missing_or_unknown_command_names_the_commands(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(arguments) == 2
    line = error_line(capsys)
    assert all(
        command in line for command in ("demo", "evaluate", "ablate", "report", "distance", "scenarios", "doctor")
    )


@pytest.mark.parametrize("command", ["demo", "evaluate", "ablate", "distance", "scenarios", "doctor"])
def test_an_output_folder_that_cannot_be_written_is_one_line(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("mine")
    assert cli.main([command, "--out", str(tmp_path / "file" / "out")]) == 2
    assert "cannot write to the output folder" in error_line(capsys)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("command", ["demo", "evaluate", "ablate", "distance", "scenarios"])
def test_a_missing_gl_library_is_one_line_and_leaves_no_folder(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def select_backend() -> str:
        raise gl.MissingGLError("no GL library renders here; apt-get install libegl1")

    monkeypatch.setattr(cli, "select_backend", select_backend)
    monkeypatch.setattr(report_commands, "select_backend", select_backend)
    assert cli.main([command, "--out", str(tmp_path / "out")]) == 2
    assert "no GL library renders here" in error_line(capsys)
    assert list(tmp_path.iterdir()) == []


def test_evaluate_passes_its_options_on_and_prints_the_table(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[EvaluationConfig] = []

    def fake_evaluate(config: EvaluationConfig, out: Path) -> dict[str, Any]:
        seen.append(config)
        return evaluate.summary_of(config, [], 0.0)

    monkeypatch.setattr(evaluate, "evaluate", fake_evaluate)
    options = "--policy blind --scenario clear,mirror --episodes 7 --seed 3 --workers 2 --image-size 120 160"
    assert cli.main(["evaluate", *options.split(), "--out", str(tmp_path)]) == 0
    assert seen == [
        cli.Evaluate(
            policy="blind",
            scenarios=("clear", "mirror"),
            episodes=7,
            seed=3,
            workers=2,
            image_size=(120, 160),
            out=tmp_path,
        )
    ]
    assert capsys.readouterr().out.startswith("scenario")


def test_failures_are_filmed_if_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    filmed: list[Path] = []

    def film(folder: Path, keys: Sequence[Any], processes: int, backend: str) -> list[Any]:
        filmed.append(folder)
        return []

    monkeypatch.setattr(evaluate, "evaluate", lambda config, out: evaluate.summary_of(config, [], 0.0))
    monkeypatch.setattr(clips, "film_failures", film)
    assert cli.main(["evaluate", "--out", str(tmp_path)]) == 0
    assert filmed == []
    assert cli.main(["evaluate", "--out", str(tmp_path), "--film-failures"]) == 0
    assert filmed == [tmp_path]


def test_ablate_always_runs_the_full_servo_first(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[tuple[str, ...]] = []

    def fake_ablate(config: EvaluationConfig, variants: tuple[str, ...], *rest: Any) -> Any:
        seen.append(variants)
        return [], {"policies": {}, "success_differences": []}, []

    monkeypatch.setattr(ablation, "ablate", fake_ablate)
    assert cli.main(["ablate", "--out", str(tmp_path), "--variant", "servo:no_retry,blind"]) == 0
    assert seen == [("servo", "servo:no_retry", "blind")]
    assert str(tmp_path / "report.html") in capsys.readouterr().out


def test_ladder_climbs_in_the_plain_scenarios_with_red_targets(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[evaluate.EvaluationConfig] = []

    def fake_climb(config: evaluate.EvaluationConfig, *rest: Any) -> list[dict[str, Any]]:
        seen.append(config)
        return []

    monkeypatch.setattr(ladder, "climb", fake_climb)
    assert cli.main(["ladder", "--out", str(tmp_path), "--episodes", "3"]) == 0
    assert not {"any_colour", "glass", "photoreal_mixed"} & set(seen[0].scenarios)
    assert {"clear", "discovery"} < set(seen[0].scenarios)
    assert (seen[0].episodes, seen[0].policy) == (3, "servo")
    assert str(tmp_path / "ladder.csv") in capsys.readouterr().out
    assert cli.main(["ladder", "--scenario", "any_colour"]) == 2
    assert "unknown scenario 'any_colour'; choose one of clear" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "folders"),
        (["nowhere"], "nowhere is no folder"),
        (["."], "has no episodes.jsonl; give folders that evaluate or ablate wrote"),
        ([".", "--gallery", "-1"], "--gallery must be 0 or more"),
    ],
)
def test_a_report_of_nothing_is_one_line_and_leaves_no_folder(
    arguments: list[str],
    message: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.main(["report", *arguments, "--out", "out"]) == 2
    assert message in error_line(capsys)
    assert list(tmp_path.iterdir()) == []


def test_a_training_run_is_what_its_config_says_and_the_rest_of_the_config_is_no_option(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert learning_commands.Train(resume=True, out=Path("elsewhere")).identity() == TrainConfig().identity()
    assert cli.main(["train", "--buffer-size", "9"]) == 2
    assert "Unrecognized options: --buffer-size" in error_line(capsys)


def test_demo_films_four_scenarios_by_default(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fake_demo(config: EvaluationConfig, out: Path) -> dict[str, Any]:
        assert (config.policy, config.scenarios) == ("servo", ("clear", "opaque", "translucent", "mirror"))
        return evaluate.summary_of(config, [], 0.0)

    monkeypatch.setattr(demo, "run_demo", fake_demo)
    monkeypatch.setenv("LP_NUM_THREADS", "0")  # the command sets it for its process, which here is that of all tests
    assert cli.main(["demo", "--out", str(tmp_path)]) == 0
    assert str(tmp_path / "demo.mp4") in capsys.readouterr().out


@pytest.mark.parametrize(("problems", "code"), [([], 0), (["NumPy is old; make a fresh environment"], 1)])
def test_doctor_says_by_its_exit_code_whether_all_is_well(
    problems: list[str], code: int, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    diagnosis = {"ok": not problems, "problems": problems, "versions": {}, "gl": "egl"}
    monkeypatch.setattr(doctor, "diagnose", lambda: diagnosis)
    assert cli.main(["doctor", "--out", str(tmp_path)]) == code
    assert json.loads(capsys.readouterr().out) == diagnosis
    assert json.loads((tmp_path / "summary.json").read_text()) == diagnosis


def test_a_full_disk_ends_any_command_in_one_line_and_other_system_errors_are_not_hidden(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(number: int) -> dict[str, Any]:
        raise OSError(number, os.strerror(number), "/data/out")

    monkeypatch.setattr(doctor, "diagnose", lambda: fail(errno.ENOSPC))
    assert cli.main(["doctor"]) == 2
    error = capsys.readouterr().err
    assert "cannot write /data/out (No space left on device); give the same command again" in error
    assert len(error.splitlines()) == 1
    monkeypatch.setattr(doctor, "diagnose", lambda: fail(errno.EAGAIN))
    with pytest.raises(BlockingIOError):
        cli.main(["doctor"])


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupted_command_says_so(
    number: int, code: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
    before = signal.signal(number, usual)  # jobs in the background of a shell ignore SIGINT
    try:
        monkeypatch.setattr(doctor, "diagnose", lambda: os.kill(os.getpid(), number))
        assert cli.main(["doctor"]) == code
        assert "interrupted" in capsys.readouterr().err
        assert signal.getsignal(number) is usual
    finally:
        signal.signal(number, before)
