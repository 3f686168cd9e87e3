"""``export``: record the episodes that a folder does not have yet, and write the data set."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from fixation_gym.envs.config import CONTROL_FREQUENCY
from fixation_gym.evaluation import workers
from fixation_gym.evaluation.files import write_file, write_json
from fixation_gym.evaluation.missing_cells import run_missing
from fixation_gym.evaluation.source import source_commit
from fixation_gym.evaluation.storage import EPISODES_FILE, SUMMARY_FILE, ResultStore
from fixation_gym.export.card import CARD_FILE, dataset_card
from fixation_gym.export.config import ExportConfig
from fixation_gym.export.recording import Recorded, record


def export(config: ExportConfig, out: Path) -> dict[str, Any]:
    """Record what is missing, and write the data set.

    Args:
        config: must have passed ``check``.
        out: folder of the data set; made if needed. The same call again resumes, and more episodes come after.

    Returns:
        The summary, as in ``summary.json``.

    Raises:
        UsageError: if the folder cannot be used, or holds another run.
    """
    keys = config.episode_keys()
    cells = {key: {**config.cell(key), "index": index} for index, key in enumerate(keys)}
    description = {"command": "export", **config.run_description()}
    with ResultStore(out, description, EPISODES_FILE, _key, _from_json, asdict) as store:
        resumed = run_missing(
            store,
            cells,
            partial(_run, out.resolve()),
            parse=_from_json,
            note=lambda episode: f"{episode.scenario}, {'picked' if episode.success else 'not picked'}",
            unit="episode",
            processes=config.workers,
            backend=config.backend,
        )
        workers.close_kept()
        episodes = [store.finished[key] for key in keys]
        _writer(config.format)(out, episodes, config)
        summary = {
            "policy": config.policy,
            "format": config.format,
            "episodes": len(episodes),
            "frames": sum(episode.length for episode in episodes),
            "successes": sum(episode.success for episode in episodes),
            "collisions": sum(episode.collision for episode in episodes),
            "episodes_resumed": resumed,
            "seed": config.seed,
            "versions": description["versions"],
            "commit": source_commit(),
        }
        write_file(out / CARD_FILE, dataset_card(config, episodes, summary).encode())
        write_json(out / SUMMARY_FILE, summary)
    return summary


def _run(out: Path, cell: workers.Cell) -> dict[str, Any]:
    """Record one episode, in a worker process if there are several."""
    place = {name: value for name, value in cell.items() if name != "index"}
    return asdict(record(place, out, cell["index"], CONTROL_FREQUENCY))


def _writer(format_name: str) -> Callable[[Path, Sequence[Recorded], ExportConfig], None]:
    """What writes a data set of that format from the recordings in a folder; their libraries are extras."""
    if format_name == "minari":
        from fixation_gym.export import minari

        return minari.write_dataset
    from fixation_gym.export import lerobot

    return lerobot.write_dataset


def _key(episode: Recorded) -> tuple[str, int]:
    return episode.key


def _from_json(values: dict[str, Any]) -> Recorded:
    return Recorded(**values)
