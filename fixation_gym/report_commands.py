"""The commands ``ablate``, ``ladder``, ``necessity``, ``robustness`` and ``report``; see ``cli``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro
from tyro.conf import Fixed

from fixation_gym.errors import check_names
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.experiments.necessity.config import NecessityConfig
from fixation_gym.experiments.robustness.config import RobustnessConfig
from fixation_gym.gl import select_backend
from fixation_gym.names import Names

if TYPE_CHECKING:
    from fixation_gym.evaluation.rollout import EpisodeResult


@dataclass(frozen=True)
class SeveralPolicies(EvaluationConfig):
    """Episodes that several policies meet: options of evaluation, without what is one policy's own."""

    policy: Fixed[str] = "servo"
    detector: Fixed[str | None] = None
    seed: int = 0
    """Chooses the block of episode seeds, as in evaluate."""
    backend: Fixed[str] = "loky"


@dataclass(frozen=True)
class Ablate(SeveralPolicies):
    """Evaluate the servo and variants that leave something out on the same episodes, and write their report."""

    episodes: int = 20
    """Episodes per scenario and variant."""
    image_size: tuple[int, int] = (240, 320)
    """Height and width of the wrist image, px."""
    variant: Names = ()
    """Names of variants, separated by commas; all by default. The full servo always runs."""
    film_failures: bool = False
    """Run every failed episode again, and keep six moments of it as a picture for the report."""
    gallery: int = 40
    """Most failures to show with pictures."""
    out: Path = Path("out/ablate")
    """Folder of the report; each variant gets a folder in it. The same command again resumes."""

    def run(self) -> int:
        """Evaluate and print the table."""
        from fixation_policies.servo.variants import VARIANT_NAMES, VARIANTS

        names = self.variant or VARIANT_NAMES
        check_names(names, VARIANT_NAMES, "variant")
        self.check()
        select_backend()
        from fixation_gym.reporting.ablation import ablate, format_ablations
        from fixation_gym.reporting.report import REPORT_FILE

        chosen = tuple(dict.fromkeys((VARIANT_NAMES[0], *names)))
        _, summary, different = ablate(self, chosen, self.out, self.gallery, self.film_failures)
        print_different(different)
        print(format_ablations(summary, {variant.name: variant.summary for variant in VARIANTS}))
        print(f"\n{self.out / REPORT_FILE}")
        return 0


@dataclass(frozen=True)
class Ladder(SeveralPolicies):
    """From the paper's algorithm to the servo, one step at a time, on the same episodes; what each step buys."""

    scenarios: Annotated[Names, tyro.conf.arg(name="scenario")] = ()
    """Scenario names, separated by commas, of those in which the target is red; by default all of them that
    need no extra."""
    episodes: int = 20
    """Episodes per scenario and policy."""
    sensor_noise: Fixed[str] = "nominal"
    image_size: Fixed[tuple[int, int] | None] = None
    gallery: int = 40
    """Most failures that the report shows."""
    out: Path = Path("out/ladder")
    """Folder of table, figure and report; each policy gets a folder in it. The same command again resumes."""

    def run(self) -> int:
        """Evaluate and print the table."""
        from fixation_gym.envs.config import SCENARIOS
        from fixation_policies.ladder import BESIDE, LADDER

        red = tuple(name for name, item in SCENARIOS.items() if item.red_target)
        config = replace(self, scenarios=self.scenarios or tuple(name for name in red if SCENARIOS[name].plain))
        check_names(config.scenarios, red, "scenario")
        config.check()
        select_backend()
        from fixation_gym.reporting.ladder import FIGURE_FILE, LADDER_FILE, climb, format_ladder
        from fixation_gym.reporting.report import REPORT_FILE

        print(format_ladder(climb(config, LADDER, BESIDE, self.out, self.gallery)))
        print("\n" + "\n".join(str(self.out / name) for name in (LADDER_FILE, FIGURE_FILE, REPORT_FILE)))
        return 0


@dataclass(frozen=True)
class Necessity(NecessityConfig):
    """The best fixed blind way of every scenario: must obstacles be seen? The same command again resumes."""

    out: Path = Path("out/necessity")
    """Folder of the results."""

    def run(self) -> int:
        """Try the ways and print the table."""
        self.check()
        select_backend()
        from fixation_gym.experiments.necessity.run import EXPERIMENT, measure

        return EXPERIMENT.show(measure(self, self.out), self.out)


@dataclass(frozen=True)
class Robustness(RobustnessConfig):
    """The servo and its map under degraded pictures, times and poses, one by one. The same command again resumes."""

    out: Path = Path("out/robustness")
    """Folder of the results."""

    def run(self) -> int:
        """Measure and print the table."""
        self.check()
        select_backend()
        from fixation_gym.experiments.robustness.run import EXPERIMENT, measure

        return EXPERIMENT.show(measure(self, self.out), self.out)


@dataclass(frozen=True)
class Report:
    """One HTML page from folders of evaluations: tables with intervals, paired comparisons, paths, failures."""

    folders: tyro.conf.Positional[tuple[Path, ...]]
    """Folders that evaluate or ablate wrote; the first policy is the reference of comparisons."""
    gallery: int = 40
    """Most failures to show with pictures; all are listed."""
    title: str = "Picking by gaze fixation"
    """Heading of the page."""
    out: Path = Path("out/report")
    """Folder of the page; an earlier report there is replaced."""

    def run(self) -> int:
        """Write the page and print where it is."""
        from fixation_gym.reporting.report import REPORT_FILE, write_report

        write_report(self.folders, self.out, self.gallery, self.title)
        print(self.out / REPORT_FILE)
        return 0


def print_different(results: Sequence[EpisodeResult]) -> None:
    """Say which episodes could not be filmed because they came out differently."""
    for result in results:
        print(f"{result.scenario} seed {result.seed} came out differently when it was run again: not filmed")
