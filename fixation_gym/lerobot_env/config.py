"""What LeRobot's programs take as ``--env.type=fixation`` and ``--env.*``; needs LeRobot."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from lerobot.configs.types import FeatureType, PolicyFeature  # pyright: ignore[reportMissingImports]
from lerobot.envs.configs import EnvConfig  # pyright: ignore[reportMissingImports]

from fixation_gym.envs.config import CONTROL_FREQUENCY, IMAGE_SIZE
from fixation_gym.export.recording import MAP, NAMES, WRIST
from fixation_gym.lerobot_env import GYM_ID
from fixation_gym.lerobot_env.layout import EPISODE_LENGTH
from fixation_gym.perception.zero_flow.evidence_map import CELLS

_ACTION, _STATE = "action", "observation.state"


@EnvConfig.register_subclass("fixation")
@dataclass
class FixationEnvConfig(EnvConfig):
    """``FixationPick-v0`` for policies that were trained on a data set of ``fixation-gym export``."""

    task: str | None = "FixationPick-v0"
    fps: int = CONTROL_FREQUENCY
    scenario: str = "clear"
    """Name of a scenario."""
    episode_length: int = EPISODE_LENGTH
    """Decisions after which an episode is truncated."""
    observation_height: int = IMAGE_SIZE[0]
    """Of the wrist image, px."""
    observation_width: int = IMAGE_SIZE[1]
    """Of the wrist image, px."""
    zero_flow_map: bool = True
    """Whether the environment perceives the map and shows it as a second camera."""
    render_mode: str = "rgb_array"
    features: dict[str, PolicyFeature] = field(default_factory=dict)
    features_map: dict[str, str] = field(
        default_factory=lambda: {
            _ACTION: _ACTION,
            "agent_pos": _STATE,
            "pixels/wrist": WRIST,
            "pixels/zero_flow_map": MAP,
        }
    )

    def __post_init__(self) -> None:
        """Say what the environment gives."""
        size = (self.observation_height, self.observation_width, 3)
        self.features = {
            _ACTION: PolicyFeature(type=FeatureType.ACTION, shape=(7,)),
            "agent_pos": PolicyFeature(type=FeatureType.STATE, shape=(len(NAMES[_STATE]),)),
            "pixels/wrist": PolicyFeature(type=FeatureType.VISUAL, shape=size),
        }
        if self.zero_flow_map:
            self.features["pixels/zero_flow_map"] = PolicyFeature(type=FeatureType.VISUAL, shape=(CELLS, CELLS, 3))

    @property
    def package_name(self) -> str:
        """What registers the id."""
        return "fixation_gym.lerobot_env"

    @property
    def gym_id(self) -> str:
        """What ``gym.make`` is asked for."""
        return GYM_ID

    @property
    def gym_kwargs(self) -> dict[str, Any]:
        """Arguments of ``make_pick``; videos show what is perceived."""
        return {
            "scenario": self.scenario,
            "image_size": (self.observation_height, self.observation_width),
            "zero_flow_map": self.zero_flow_map,
            "episode_length": self.episode_length,
            "render_mode": self.render_mode,
            "render_view": "overlay" if self.zero_flow_map else "front",
        }
