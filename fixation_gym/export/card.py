"""The card of a data set, as the Hugging Face Hub shows it: what was recorded, how, and what its columns are."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from fixation_gym.envs.config import CONTROL_FREQUENCY, TASK
from fixation_gym.export.config import ExportConfig
from fixation_gym.export.recording import NAMES, VIDEOS, Recorded
from fixation_gym.perception.zero_flow.evidence_map import UNKNOWN

CARD_FILE = "README.md"
_TAGS = {"lerobot": "LeRobot", "minari": "minari"}


def dataset_card(config: ExportConfig, episodes: Sequence[Recorded], summary: Mapping[str, Any]) -> str:
    """Text of the card.

    Args:
        config: what was recorded.
        episodes: in the order of their numbers.
        summary: as in ``summary.json``.

    Returns:
        Markdown after a header of metadata.
    """
    height, width = config.needed_environment.image_size
    count = len(episodes)
    versions = ", ".join(f"{name} {version}" for name, version in summary["versions"].items())
    columns = "\n".join(f"| `{name}` | {', '.join(parts)} |" for name, parts in NAMES.items())
    return f"""---
task_categories:
- robotics
tags:
- {_TAGS[config.format]}
- fixation-gym
- manipulation
- simulation
---
# {count} episodes of `{config.policy}`: {TASK}

A simulated Franka Panda picks a target among obstacles with a camera at its wrist (`FixationPick-v0` of fixation-gym).
Every frame has the picture, and what fixation makes of it: the zero-flow map and the distance with its std.

- Frames: {summary["frames"]} at {CONTROL_FREQUENCY} Hz; pictures of {width}x{height} px.
- Picked: {summary["successes"]} of {count}; with a collision: {summary["collisions"]}. Failures are part of the data.
- Sensor noise: `{config.sensor_noise}`; pictures by `{config.renderer}`.
- Versions: {versions}; commit {summary["commit"]}.

| scenario | episodes | picked |
|---|---|---|
{_by_scenario(episodes)}

Made by this command; the seed of each scene is kept beside its episode, and the same seed draws the same scene:

```sh
{_command(config)}
```

| column | numbers |
|---|---|
{columns}
| `action` | those of the policy's environment, from -1 to 1 |
| {" and ".join(f"`{name}`" for name in VIDEOS)} | videos |

Lengths are in m, angles in rad, times in s; poses are of the camera in the robot's base. The grey of a cell of the
map is the probability that something there is nearer than the target, times 255; {UNKNOWN} is unknown.
"""


def _command(config: ExportConfig) -> str:
    height, width = config.needed_environment.image_size
    words = ["fixation-gym", "export", "--policy", config.policy, "--scenario", ",".join(config.scenarios)]
    words += ["--episodes", str(config.episodes), "--seed", str(config.seed), "--format", config.format]
    words += ["--sensor-noise", config.sensor_noise, "--image-size", str(height), str(width)]
    words += ["--renderer", config.renderer]
    words += [] if config.detector is None else ["--detector", config.detector]
    return f"{shlex.join(words)} --out DIR"


def _by_scenario(episodes: Sequence[Recorded]) -> str:
    counts = Counter(episode.scenario for episode in episodes)
    picked = Counter(episode.scenario for episode in episodes if episode.success)
    return "\n".join(f"| `{name}` | {count} | {picked[name]} |" for name, count in counts.items())
