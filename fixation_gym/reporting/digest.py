"""What the page needs of every episode; traces are read one at a time and not kept."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fixation_gym.evaluation.clips import clip_file
from fixation_gym.evaluation.failures import Failure, classify
from fixation_gym.evaluation.folders import Evaluation
from fixation_gym.evaluation.rollout import GAZE_PHASES, GRASP, EpisodeResult
from fixation_gym.evaluation.trace import Trace
from fixation_gym.types import FloatArray

START_TIMES: FloatArray = np.arange(0.0, 25.01, 0.2)
"""Times since the start at which errors are looked at, s."""
GRASP_TIMES: FloatArray = np.arange(-8.0, 0.01, 0.1)
"""Times against the beginning of the last grasp, s."""


@dataclass(frozen=True, eq=False)
class ErrorCurves:
    """Absolute distance error and stated standard deviation while the gaze is held; NaN elsewhere. m."""

    since_start: FloatArray
    """Shape (2, len(START_TIMES))."""
    before_grasp: FloatArray
    """Shape (2, len(GRASP_TIMES))."""
    within_two_std: int
    """Decisions with an error below two standard deviations."""
    decisions: int


@dataclass(frozen=True, eq=False)
class Episode:
    """An episode, why it failed, and its distance errors."""

    result: EpisodeResult
    failure: Failure | None
    curves: ErrorCurves | None
    """None without a trace or without estimates."""
    has_trace: bool
    has_clip: bool


@dataclass(frozen=True, eq=False)
class PolicyRecord:
    """One evaluation as the page shows it."""

    label: str
    evaluation: Evaluation
    episodes: tuple[Episode, ...]

    def of(self, scenario: str | None) -> list[EpisodeResult]:
        """Results of a scenario; of all for None."""
        results = [episode.result for episode in self.episodes]
        return [result for result in results if scenario is None or result.scenario == scenario]


def digest(evaluations: Sequence[Evaluation]) -> list[PolicyRecord]:
    """Read all traces, classify all failures, and give every evaluation a name of its own.

    Raises:
        UsageError: if a trace is damaged.
    """
    names = zip(labels(evaluations), evaluations, strict=True)
    return [PolicyRecord(label, evaluation, _episodes(evaluation)) for label, evaluation in names]


def labels(evaluations: Sequence[Evaluation]) -> list[str]:
    """Name of the policy, with what tells evaluations of one policy apart; the folder's name if nothing does."""
    names = [str(evaluation.run["policy"]) for evaluation in evaluations]
    for field in ("sensor_noise", "image_size", "seed", "folder"):
        values: dict[str, set[str]] = {}
        for name, evaluation in zip(names, evaluations, strict=True):
            values.setdefault(name, set()).add(_value(evaluation, field))
        names = [
            f"{name}, {_value(evaluation, field)}" if len(values[name]) > 1 else name
            for name, evaluation in zip(names, evaluations, strict=True)
        ]
    return names


def scenario_names(records: Sequence[PolicyRecord]) -> list[str]:
    """All scenarios, in the order in which they first occur."""
    return list(dict.fromkeys(result.scenario for record in records for result in record.of(None)))


def error_curves(trace: Trace) -> ErrorCurves | None:
    """Errors of a trace over time; None if the policy made no estimates."""
    gazing = np.isin(np.array(trace.phases), GAZE_PHASES) & np.isfinite(trace.distance_m)
    if not gazing.any():
        return None
    error = np.where(gazing, np.abs(trace.distance_m - trace.distance_true_m), np.nan)
    values = np.stack([error, np.where(gazing, trace.distance_std_m, np.nan)])
    starts = [row for row in range(1, len(trace.phases)) if trace.phases[row] == GRASP != trace.phases[row - 1]]
    grasp_time = trace.time_s[starts[-1] - 1] if starts else math.nan
    within = error[gazing] < 2.0 * trace.distance_std_m[gazing]
    return ErrorCurves(
        since_start=_at(values, trace.time_s, START_TIMES),
        before_grasp=_at(values, trace.time_s, GRASP_TIMES + grasp_time),
        within_two_std=int(within.sum()),
        decisions=int(gazing.sum()),
    )


def _episodes(evaluation: Evaluation) -> tuple[Episode, ...]:
    episodes = []
    for result in evaluation.results:
        trace = evaluation.trace(result)
        episodes.append(
            Episode(
                result=result,
                failure=classify(result, trace),
                curves=None if trace is None else error_curves(trace),
                has_trace=trace is not None and bool(trace.boxes),
                has_clip=clip_file(evaluation.folder, *result.key).exists(),
            )
        )
    return tuple(episodes)


def _value(evaluation: Evaluation, field: str) -> str:
    if field == "folder":
        return str(evaluation.folder)
    value = evaluation.run[field]
    if field == "image_size":
        return f"{value[0]} x {value[1]} px"
    return f"seed {value}" if field == "seed" else str(value)


def _at(values: FloatArray, times: FloatArray, wanted: FloatArray) -> FloatArray:
    """Columns of ``values`` at the rows nearest to the wanted times; NaN outside the episode or for NaN."""
    if not np.isfinite(wanted).all():
        return np.full((len(values), len(wanted)), np.nan)
    rows = np.clip(np.searchsorted(times, wanted - 1e-3), 0, len(times) - 1)
    inside = (wanted >= times[0] - 1e-3) & (wanted <= times[-1] + 1e-3)
    return np.where(inside, values[:, rows], np.nan)
