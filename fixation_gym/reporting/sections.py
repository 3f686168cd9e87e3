"""The page's sections, each as HTML; empty where there is nothing to say."""

from __future__ import annotations

from collections.abc import Sequence

from fixation_gym.evaluation.rollout import EpisodeResult
from fixation_gym.evaluation.trace import Trace
from fixation_gym.reporting import tables
from fixation_gym.reporting.comparison import SUCCESS_MEASURES, VALUE_MEASURES, compare_success, compare_values
from fixation_gym.reporting.digest import PolicyRecord
from fixation_gym.reporting.figures import colour_of, error_figure, success_figure
from fixation_gym.reporting.gallery import chosen_failures, failed_episodes, failure_list, gallery
from fixation_gym.reporting.markup import Html, details, element, figure, image, joined
from fixation_gym.reporting.path_figures import path_figure
from fixation_gym.reporting.provenance import differences, provenance


def introduction(records: Sequence[PolicyRecord], scenarios: Sequence[str]) -> Html:
    """What the page is about, in two lines."""
    episodes = sum(len(record.episodes) for record in records)
    names = ", ".join(record.label for record in records)
    text = f"{names}: {episodes} episodes in {', '.join(scenarios)}. Intervals are 95 %."
    meaning = (
        "Success: the target is lifted by 10 cm and held for 0.5 s within 25 s. Collision-free: besides, no contact of "
        "robot and obstacle above 1 N, and no obstacle pushed by more than 1 cm."
    )
    return joined([element("p", text), element("p", meaning, "note")])


def success(records: Sequence[PolicyRecord], scenarios: Sequence[str]) -> Html:
    """Rates, as tables and as a figure."""
    names = {"success": "Success", "collision-free success": "Collision-free success"}
    parts = [
        tables.rate_table(records, scenarios, succeeded, f"{names[measure]}: k/n, rate [Wilson interval]")
        for measure, succeeded in SUCCESS_MEASURES.items()
    ]
    picture = image(success_figure(records, scenarios), "png", "Success rates over scenarios with intervals")
    return joined([*parts, figure(picture, "Success rates with Wilson 95 % intervals.")])


def paired(records: Sequence[PolicyRecord], scenarios: Sequence[str]) -> Html:
    """Every other policy against the first one."""
    reference, parts = records[0], []
    for other in records[1:]:
        found = compare_success(reference, other, list(scenarios))
        parts.append(element("h3", f"{other.label} against {reference.label}"))
        if not found:
            parts.append(element("p", "No episodes in common."))
            continue
        parts += [
            tables.comparison_table(
                [row for row in found if row.measure == measure],
                f"{measure.capitalize()}; reference: {reference.label}",
            )
            for measure in SUCCESS_MEASURES
        ]
        parts.append(tables.difference_table(compare_values(reference, other)))
    if not parts:
        return Html("")
    note = (
        "Pairs of episodes with the same scenario and seed, hence the same scene. Difference: rate of the other minus "
        "that of the reference, Newcombe's interval for paired rates; p: exact McNemar test, two-sided."
    )
    different = differences(records)
    if different:
        note += f" The evaluations also differ in: {', '.join(different)}."
    return joined([element("p", note, "note"), *parts])


def measurements(records: Sequence[PolicyRecord], scenarios: Sequence[str]) -> Html:
    """Times, distance errors, and errors over time."""
    captions = {
        "time to lift, s": ("Median time to lift, s (quartiles), successful episodes", 1),
        "distance error at grasp, mm": ("Median distance error at grasp, mm (quartiles), where a grasp began", 1),
    }
    parts = [
        tables.value_table(records, scenarios, VALUE_MEASURES[measure], digits, caption)
        for measure, (caption, digits) in captions.items()
    ]
    parts.append(tables.detail_table(records))
    data = error_figure(records)
    if data is None:
        parts.append(element("p", "No traces: errors over time are not known.", "note"))
    else:
        caption = "Distance error and stated standard deviation over time, all scenarios, while the gaze is held."
        parts.append(figure(image(data, "png", caption), caption))
    return joined(parts)


def paths(records: Sequence[PolicyRecord], scenarios: Sequence[str]) -> Html:
    """One scene per scenario, with the paths of all policies that met it."""
    parts = []
    for scenario in scenarios:
        chosen = _typical(records[0].of(scenario), records[0])
        if chosen is None:
            continue
        drawn = _paths_of(records, chosen)
        picture = image(path_figure(drawn), "png", f"Paths in scenario {scenario}, seed {chosen.seed}")
        parts.append(figure(picture, f"{scenario}, seed {chosen.seed}"))
    if not parts:
        return Html("")
    note = (
        "Of every scenario the scene in which the first policy took its median time. Line: tool, from circle to "
        "square; dots: camera; red: target; other boxes: obstacles, dashed where they were moved to."
    )
    return joined([element("p", note, "note"), *parts])


def failures(records: Sequence[PolicyRecord], pictures: int) -> Html:
    """Counts, the list of all failures, and pictures of some."""
    every = failed_episodes(records)
    if not every:
        return element("p", "None: every episode was a collision-free success.")
    shown = chosen_failures(every, pictures)
    parts = [tables.failure_table(records), details(f"All {len(every)} failures", failure_list(records, every))]
    if len(shown) < len(every):
        parts.append(
            element("p", f"Pictures of {len(shown)} of {len(every)}, spread over scenarios and kinds.", "note")
        )
    return joined([*parts, gallery(records, shown)])


def source(records: Sequence[PolicyRecord]) -> Html:
    """Commands, seeds, versions, wall times."""
    return provenance(records)


def _typical(results: Sequence[EpisodeResult], record: PolicyRecord) -> EpisodeResult | None:
    """The episode with a trace whose time is the median, of the clean ones if there are any."""
    traced = {episode.result.seed for episode in record.episodes if episode.has_trace}
    known = [result for result in results if result.seed in traced]
    clean = [result for result in known if result.collision_free_success] or known
    return sorted(clean, key=lambda result: result.time_s)[(len(clean) - 1) // 2] if clean else None


def _paths_of(records: Sequence[PolicyRecord], chosen: EpisodeResult) -> list[tuple[str, str, Trace]]:
    """Label, colour and trace of every policy's episode in the same scene."""
    found = []
    for index, record in enumerate(records):
        for episode in record.episodes:
            if episode.result.key == chosen.key and episode.has_trace:
                trace = record.evaluation.trace(episode.result)
                assert trace is not None, "it was there when the episodes were read"
                found.append((record.label, colour_of(index), trace))
    return found
