"""The command line. Each command is a dataclass: its fields are the options, ``run`` does the work.

A command that runs what a config describes inherits its fields, with their defaults and help texts. Heavy modules are
imported in ``run``, so that help and errors come at once.
"""

from __future__ import annotations

import contextlib
import errno
import io
import json
import os
import signal
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Protocol

import tyro

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.experiments.distance.config import DistanceConfig
from fixation_gym.experiments.scenarios.config import ScenariosConfig
from fixation_gym.export.config import ExportConfig
from fixation_gym.gl import MissingGLError, select_backend
from fixation_gym.learning_commands import Compare, Train, Transfer
from fixation_gym.recording_commands import Record, Replay
from fixation_gym.report_commands import Ablate, Ladder, Necessity, Report, Robustness, print_different
from fixation_gym.termination import Terminated, orderly_end

_DISK_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO)
"""What a disk that is full or broken says."""


class Command(Protocol):
    """What every command has."""

    def run(self) -> int:
        """Do the work; returns the exit code."""
        ...


@dataclass(frozen=True)
class Demo(EvaluationConfig):
    """Film a policy in a few episodes of several scenarios: table, MP4 and contact sheet."""

    episodes: int = 1
    """Episodes per scenario."""
    workers: tyro.conf.Fixed[int] = 1
    backend: tyro.conf.Fixed[str] = "loky"
    out: Path = Path("out/demo")
    """Folder of the results; an earlier demonstration there is replaced."""

    def run(self) -> int:
        """Film and print the table."""
        self.check()
        # One environment alone in a process that does not fork: here threads of Mesa's are safe, and have work.
        os.environ.setdefault("LP_NUM_THREADS", "2")
        select_backend()
        from fixation_gym.evaluation.demo import SHEET_FILE, VIDEO_FILE, run_demo
        from fixation_gym.evaluation.report import format_table

        summary = run_demo(self, self.out)
        print(format_table(summary["scenarios"]))
        print(f"\n{self.out / VIDEO_FILE}\n{self.out / SHEET_FILE}")
        return 0


@dataclass(frozen=True)
class Evaluate(EvaluationConfig):
    """Evaluate a policy over scenarios and seeds. The same command again resumes a run that was killed."""

    film_failures: bool = False
    """Run every failed episode again, and keep six moments of it as a picture in the folder clips."""
    out: Path = Path("out/evaluate")
    """Folder of the results."""

    def run(self) -> int:
        """Evaluate and print the table."""
        self.check()
        select_backend()
        from fixation_gym.evaluation.evaluate import evaluate
        from fixation_gym.evaluation.report import format_table
        from fixation_gym.evaluation.storage import SUMMARY_FILE

        summary = evaluate(self, self.out)
        if self.film_failures:
            from fixation_gym.evaluation.clips import film_failures

            print_different(film_failures(self.out, self.episode_keys(), self.workers, self.backend))
        print(format_table(summary["scenarios"]))
        print(f"\n{self.out / SUMMARY_FILE}")
        return 0


@dataclass(frozen=True)
class Export(ExportConfig):
    """Record a policy's episodes as a data set for other libraries. The same command again resumes, or adds more."""

    out: Path = Path("out/export")
    """Folder of the data set."""

    def run(self) -> int:
        """Record and say what there is."""
        self.check()
        select_backend()
        from fixation_gym.export.run import export

        summary = export(self, self.out)
        print(f"{summary['episodes']} episodes, {summary['frames']} frames, {summary['successes']} picks\n\n{self.out}")
        return 0


@dataclass(frozen=True)
class Distance(DistanceConfig):
    """Error of the distance against distance, fixating and only translating. The same command again resumes."""

    out: Path = Path("out/distance")
    """Folder of the results."""

    def run(self) -> int:
        """Measure and print the table."""
        self.check()
        select_backend()
        from fixation_gym.experiments.distance.run import EXPERIMENT, measure

        return EXPERIMENT.show(measure(self, self.out), self.out)


@dataclass(frozen=True)
class Scenarios(ScenariosConfig):
    """What is in front of the fixated object, in four hard scenes. The same command again resumes."""

    out: Path = Path("out/scenarios")
    """Folder of the results."""

    def run(self) -> int:
        """Look and print the table."""
        self.check()
        select_backend()
        from fixation_gym.experiments.scenarios.run import EXPERIMENT, measure

        return EXPERIMENT.show(measure(self, self.out), self.out)


@dataclass(frozen=True)
class Bench:
    """Time every stage and comparable environments in one run: table of medians, ratios and a bar chart."""

    quick: bool = False
    """Fewer rounds, without worker processes and memory run."""
    growth: bool = False
    """In place of that: how costs grow with image, obstacles, episode and workers, and what a first use takes."""
    out: Path = Path("out/bench")
    """Folder of the results; earlier ones of the same kind are replaced."""

    def run(self) -> int:
        """Measure and print the table."""
        select_backend()
        from fixation_gym.evaluation.storage import make_folder

        make_folder(self.out)
        if self.growth:
            from fixation_gym.experiments.bench.growth import GROWTH_FIGURE, format_growth, growth

            print(format_growth(growth(self.quick, self.out)))
            print(f"\n{self.out / GROWTH_FIGURE}")
        else:
            from fixation_gym.experiments.bench.run import FIGURE_FILE, bench, format_table

            print(format_table(bench(self.quick, self.out)))
            print(f"\n{self.out / FIGURE_FILE}")
        return 0


@dataclass(frozen=True)
class Doctor:
    """Check the installation: versions, GL backend, OpenCV, one rendered frame."""

    out: Path | None = None
    """Folder for summary.json; none is written by default."""

    def run(self) -> int:
        """Print what was found; exit code 1 if something has to be done."""
        from fixation_gym.doctor import diagnose

        if self.out is None:
            diagnosis = diagnose()
        else:  # imports packages whose absence is for diagnose to report
            from fixation_gym.evaluation.files import write_json
            from fixation_gym.evaluation.storage import SUMMARY_FILE, make_folder

            make_folder(self.out)
            diagnosis = diagnose()
            write_json(self.out / SUMMARY_FILE, diagnosis)
        print(json.dumps(diagnosis, indent=2))
        return 0 if diagnosis["ok"] else 1


Commands = (
    Annotated[Demo, tyro.conf.subcommand("demo")]
    | Annotated[Evaluate, tyro.conf.subcommand("evaluate")]
    | Annotated[Ablate, tyro.conf.subcommand("ablate")]
    | Annotated[Ladder, tyro.conf.subcommand("ladder")]
    | Annotated[Export, tyro.conf.subcommand("export")]
    | Annotated[Record, tyro.conf.subcommand("record")]
    | Annotated[Replay, tyro.conf.subcommand("replay")]
    | Annotated[Report, tyro.conf.subcommand("report")]
    | Annotated[Train, tyro.conf.subcommand("train")]
    | Annotated[Compare, tyro.conf.subcommand("compare")]
    | Annotated[Transfer, tyro.conf.subcommand("transfer")]
    | Annotated[Distance, tyro.conf.subcommand("distance")]
    | Annotated[Scenarios, tyro.conf.subcommand("scenarios")]
    | Annotated[Necessity, tyro.conf.subcommand("necessity")]
    | Annotated[Robustness, tyro.conf.subcommand("robustness")]
    | Annotated[Bench, tyro.conf.subcommand("bench")]
    | Annotated[Doctor, tyro.conf.subcommand("doctor")]
)


def parse(argv: Sequence[str] | None) -> Command:
    """Parse options.

    Raises:
        UsageError: with tyro's message, which it would print as a box, as one line.
        SystemExit: after ``--help``.
    """
    given = sys.argv[1:] if argv is None else list(argv)
    for argument in given:
        try:
            argument.encode()
        except UnicodeEncodeError:
            raise UsageError(f"arguments must be valid UTF-8, got {argument!a}") from None
    output = io.StringIO()
    try:
        with contextlib.redirect_stderr(output):
            return tyro.cli(
                Commands,
                prog="fixation-gym",
                description="Gaze fixation for robots: distance and obstacles from one's own motion.",
                args=given,
                config=(tyro.conf.SuppressFixed,),
            )
    except SystemExit as exit_:
        if exit_.code in (None, 0):
            raise
        raise UsageError(_unbox(output.getvalue())) from None


def _unbox(text: str) -> str:
    """What a box of line characters, or of ASCII, says as one line; its blocks without the help text of the option."""
    blocks = [""]
    for line in text.splitlines()[1:]:  # the first is the title
        words = line.strip(" │|+╭╮╰╯─")
        if words.strip("-"):
            blocks[-1] = f"{blocks[-1]} {words}".strip()
        else:
            blocks.append("")
    blocks = [block.rstrip(".") for block in blocks if block and not block.startswith("Argument helptext")]
    return "; ".join(blocks) or text.strip()


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; errors of use end as one line and exit code 2, signals as one line and 128 plus their number.

    Args:
        argv: arguments without the program's name; None for those of the process.
    """
    try:
        with orderly_end():
            return parse(argv).run()
    except (UsageError, MissingGLError) as error:
        print(f"fixation-gym: error: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        if error.errno not in _DISK_ERRORS:
            raise
        what = f" {error.filename}" if error.filename else ""
        advice = "give the same command again when it can; commands that resume keep what was finished"
        print(f"fixation-gym: error: cannot write{what} ({error.strerror}); {advice}", file=sys.stderr)
        return 2
    except KeyboardInterrupt as error:
        print("fixation-gym: interrupted; what was finished is kept", file=sys.stderr)
        return 128 + (signal.SIGTERM if isinstance(error, Terminated) else signal.SIGINT)
