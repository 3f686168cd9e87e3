"""``FixationPick-v0`` with the observation that LeRobot's policies take, named as in data sets of ``export``."""

from __future__ import annotations

from typing import Any

import cv2
import gymnasium as gym
import numpy as np
from gymnasium import spaces

from fixation_gym.envs.config import CONTROL_FREQUENCY, EPISODE_SECONDS, IMAGE_SIZE, TASK
from fixation_gym.envs.perceiving import perception_for
from fixation_gym.envs.pick_env import FixationPickEnv
from fixation_gym.perception.zero_flow.evidence_map import CELLS
from fixation_gym.types import Observation

EPISODE_LENGTH = round(EPISODE_SECONDS * CONTROL_FREQUENCY)
"""Decisions in an episode, at most."""


class LeRobotLayout(gym.Wrapper[dict[str, Any], np.ndarray, dict[str, Any], np.ndarray]):
    """Pictures under ``pixels``, the robot's own state under ``agent_pos``; actions, rewards and info stay.

    | key | shape | meaning |
    |---|---|---|
    | ``pixels/wrist`` | (H, W, 3) uint8 | wrist image |
    | ``pixels/zero_flow_map`` | (32, 32, 3) uint8 | P(nearer than the fixated object) in grey, 128 = unknown |
    | ``agent_pos`` | (8,) float32 | joint angles in rad, opening between the finger pads in m |

    The map is perceived here, from image and camera pose, as the servo does; ``zero_flow_map=False`` leaves it out.
    """

    task = task_description = TASK

    def __init__(self, env: gym.Env[dict[str, Any], np.ndarray], zero_flow_map: bool = True) -> None:
        """Wrap an environment made by ``gym.make("FixationPick-v0")``.

        Raises:
            ValueError: if it is another one, or has no image.
        """
        super().__init__(env)
        base, given = env.unwrapped, env.observation_space
        if type(base) is not FixationPickEnv or not isinstance(given, spaces.Dict) or "rgb" not in given.spaces:
            raise ValueError(f"LeRobotLayout is for FixationPick-v0 with an image_size, got {base}")
        self._base = base
        self._perception = perception_for(base.scenario, base.intrinsics) if zero_flow_map else None
        pixels: dict[str, spaces.Space[Any]] = {"wrist": given["rgb"]}
        if zero_flow_map:
            pixels["zero_flow_map"] = spaces.Box(0, 255, (CELLS, CELLS, 3), np.uint8)
        own = [given[key] for key in ("joint_pos", "gripper_width")]
        low, high = (np.concatenate([getattr(box, bound) for box in own]) for bound in ("low", "high"))
        self.observation_space = spaces.Dict({"pixels": spaces.Dict(pixels), "agent_pos": spaces.Box(low, high)})

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Draw a new scene. ``options`` are not used."""
        sensed, info = self.env.reset(seed=seed, options=options)
        if self._perception is not None:
            self._perception.reset()
        return self._laid_out(sensed), info

    def step(self, action: np.ndarray) -> tuple[dict[str, Any], Any, bool, bool, dict[str, Any]]:
        """Run one control period."""
        sensed, reward, terminated, truncated, info = self.env.step(action)
        return self._laid_out(sensed), reward, terminated, truncated, info

    def _laid_out(self, sensed: dict[str, Any]) -> dict[str, Any]:
        pixels = {"wrist": sensed["rgb"]}
        if self._perception is not None:
            self._base.percept = percept = self._perception.update(Observation.from_dict(sensed))
            pixels["zero_flow_map"] = np.asarray(cv2.cvtColor(percept.zfc.cells, cv2.COLOR_GRAY2RGB), np.uint8)
        own = np.concatenate([sensed["joint_pos"], sensed["gripper_width"]])
        return {"pixels": pixels, "agent_pos": own}


def make_pick(
    scenario: str = "clear",
    image_size: tuple[int, int] = IMAGE_SIZE,
    zero_flow_map: bool = True,
    episode_length: int = EPISODE_LENGTH,
    render_mode: str | None = None,
    render_view: str = "front",
) -> LeRobotLayout:
    """``FixationPick-v0`` in LeRobot's layout.

    Args:
        scenario: as in ``FixationPickEnv``, like the others but for two:
        image_size: (height, width) of the wrist image, px.
        zero_flow_map: whether to perceive and show it.
        episode_length: decisions after which an episode is truncated.
        render_mode: None, "rgb_array" or "human".
        render_view: of "rgb_array": "wrist", "front" or, if there are maps, "overlay".

    Raises:
        ValueError: for a value that is not allowed; the message says what is.
    """
    env = gym.make(
        "fixation_gym:FixationPick-v0",
        max_episode_steps=episode_length,
        scenario=scenario,
        image_size=image_size,
        render_mode=render_mode,
        render_view=render_view,
    )
    return LeRobotLayout(env, zero_flow_map)
