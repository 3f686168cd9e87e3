"""Where the numbers come from: commands, seeds, versions, wall times."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import Any

from fixation_gym.evaluation.evaluate import seed_hash
from fixation_gym.evaluation.folders import Evaluation
from fixation_gym.reporting.digest import PolicyRecord
from fixation_gym.reporting.markup import Html, details, element, joined, table
from fixation_gym.reporting.tables import NOTHING


def evaluate_command(evaluation: Evaluation) -> str:
    """The command that gives the same episodes."""
    run = evaluation.run
    scenarios = list(dict.fromkeys(result.scenario for result in evaluation.results))
    episodes = max(sum(result.scenario == name for result in evaluation.results) for name in scenarios)
    height, width = run["image_size"]
    options = {
        "--policy": run["policy"],
        "--scenario": ",".join(scenarios),
        "--episodes": episodes,
        "--seed": run["seed"],
        "--sensor-noise": run["sensor_noise"],
        "--image-size": f"{height} {width}",
        **({"--renderer": run["renderer"]} if "renderer" in run else {}),
    }
    words = [word for option, value in options.items() for word in (option, *str(value).split())]
    return f"fixation-gym evaluate {shlex.join(words)} --out DIR"


def provenance(records: Sequence[PolicyRecord]) -> Html:
    """Commands, then a table of the runs, then versions."""
    commands = "\n".join(evaluate_command(record.evaluation) for record in records)
    head = ("policy", "seeds", "noise", "image", "commit", "OpenGL", "wall time", "seed list SHA-256")
    rows = [_run(record) for record in records]
    return joined(
        [
            element("pre", commands),
            table(head, rows, "Wall time: of the last call; episodes of earlier, interrupted calls are not in it."),
            *_versions(records),
        ]
    )


def differences(records: Sequence[PolicyRecord]) -> list[str]:
    """In what the evaluations differ, apart from the policy; comparisons should know."""
    values = {
        "sensor noise": [record.evaluation.run["sensor_noise"] for record in records],
        "image size": [record.evaluation.run["image_size"] for record in records],
        "renderer": [record.evaluation.run.get("renderer") for record in records],
        "versions of packages": [record.evaluation.run.get("versions") for record in records],
        "commit": [record.evaluation.summary.get("commit") for record in records],
    }
    return [name for name, found in values.items() if any(value != found[0] for value in found)]


def _run(record: PolicyRecord) -> tuple[str, ...]:
    evaluation = record.evaluation
    run, summary = evaluation.run, evaluation.summary
    seeds = [result.seed for result in evaluation.results]
    commit = summary.get("commit")
    height, width = run["image_size"]
    resumed = summary.get("episodes_resumed")
    wall = _duration(summary.get("wall_s"))
    return (
        record.label,
        f"{min(seeds)} to {max(seeds)}",
        run["sensor_noise"],
        f"{width} x {height}",
        element("code", commit[:10] + commit[40:]) if commit else NOTHING,
        str(run.get("gl") or NOTHING),
        f"{wall}, {resumed} of {len(seeds)} before" if resumed else wall,
        element("code", seed_hash(evaluation.keys), "hash"),
    )


def _versions(records: Sequence[PolicyRecord]) -> list[Html]:
    """One list where all agree, otherwise one per policy."""
    found: dict[str, list[str]] = {}
    for record in records:
        versions: dict[str, Any] = record.evaluation.run.get("versions") or {}
        text = ", ".join(f"{name} {version}" for name, version in versions.items()) or "unknown"
        found.setdefault(text, []).append(record.label)
    if len(found) == 1:
        return [details("Versions", element("p", next(iter(found))))]
    return [details(f"Versions: {'; '.join(names)}", element("p", text)) for text, names in found.items()]


def _duration(seconds: float | None) -> str:
    if seconds is None:
        return "unknown"
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"
