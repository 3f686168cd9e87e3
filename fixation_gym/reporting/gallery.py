"""Failures: a list of all, and pictures of some."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from fixation_gym.evaluation.clips import clip_file
from fixation_gym.evaluation.failures import Failure
from fixation_gym.reporting.digest import Episode, PolicyRecord
from fixation_gym.reporting.figures import colour_of
from fixation_gym.reporting.markup import Html, element, figure, image, joined, table
from fixation_gym.reporting.path_figures import episode_figure
from fixation_gym.reporting.tables import NOTHING, number


@dataclass(frozen=True, eq=False)
class FailedEpisode:
    """A failure, and whose."""

    policy: int
    """Place of the policy among the records."""
    episode: Episode
    failure: Failure


def failed_episodes(records: Sequence[PolicyRecord]) -> list[FailedEpisode]:
    """All failures, by policy, scenario and seed."""
    return [
        FailedEpisode(index, episode, episode.failure)
        for index, record in enumerate(records)
        for episode in record.episodes
        if episode.failure is not None
    ]


def chosen_failures(failures: Sequence[FailedEpisode], count: int) -> list[FailedEpisode]:
    """At most ``count`` failures, spread evenly over policies, scenarios and kinds, in their order."""
    seen: Counter[tuple[int, str, str]] = Counter()
    ranked = []
    for place, item in enumerate(failures):
        group = (item.policy, item.episode.result.scenario, item.failure.kind.value)
        ranked.append((seen[group], item.policy, place))
        seen[group] += 1
    return [failures[place] for place in sorted(place for *_, place in sorted(ranked)[:count])]


def failure_list(records: Sequence[PolicyRecord], failures: Sequence[FailedEpisode]) -> Html:
    """A table of all failures."""
    rows = [
        (
            records[item.policy].label,
            item.episode.result.scenario,
            str(item.episode.result.seed),
            item.failure.kind.value,
            item.failure.phase or NOTHING,
            number(item.failure.time_s, 1),
            item.failure.detail,
        )
        for item in failures
    ]
    head = ("policy", "scenario", "seed", "kind", "phase", "time s", "")
    return table(head, rows, f"All {len(failures)} failures.")


def gallery(records: Sequence[PolicyRecord], failures: Sequence[FailedEpisode]) -> Html:
    """An entry with pictures for each of the given failures."""
    return joined([_entry(records[item.policy], item) for item in failures])


def _entry(record: PolicyRecord, item: FailedEpisode) -> Html:
    result, folder = item.episode.result, record.evaluation.folder
    title = joined(
        [f"{record.label}, {result.scenario}, seed {result.seed}", element("span", item.failure.kind.value, "kind")], ""
    )
    error = result.distance_error_at_grasp_m
    facts = [item.failure.detail, f"{result.time_s:.1f} s"]
    if error is not None:
        facts.append(f"distance error at grasp {1000 * error:.1f} mm")
    parts = [element("h4", title), element("p", "; ".join(facts), "note")]
    if item.episode.has_clip:
        data = clip_file(folder, *result.key).read_bytes()
        parts.append(
            figure(image(data, "jpeg", f"Six moments of {result.scenario} seed {result.seed}", plot=False), "")
        )
    trace = record.evaluation.trace(result) if item.episode.has_trace else None
    if trace is not None:
        data = episode_figure(record.label, colour_of(item.policy), trace, item.failure)
        parts.append(figure(image(data, "png", f"Paths and distance of {result.scenario} seed {result.seed}"), ""))
    if trace is None and not item.episode.has_clip:
        parts.append(element("p", "Neither trace nor clip: the episode was run by an older version.", "note"))
    return element("article", joined(parts))
