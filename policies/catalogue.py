"""Policies by name, for the command line."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fixation_gym.envs.config import IMAGE_SIZE
from fixation_gym.errors import UsageError
from fixation_gym.perception.pipeline import Perception
from policies.base import Policy
from policies.baselines import RandomPolicy
from policies.rl.agent_file import read_card
from policies.rl.config import CONFIGS, require_learning_packages
from policies.servo.servo_policy import ServoPolicy
from policies.servo.variants import VARIANT_NAMES, servo_variant

AGENT_SUFFIX = ".zip"
POLICY_NAMES = ("servo", "blind", "random", "oracle", *(name for name in VARIANT_NAMES if ":" in name))


@dataclass(frozen=True)
class Surroundings:
    """Where a policy acts."""

    env_id: str = "fixation_gym:FixationPick-v0"
    arguments: dict[str, Any] = field(default_factory=dict)
    """Of the environment, beside those that the user chooses."""
    image_size: tuple[int, int] = IMAGE_SIZE
    """Height and width of the wrist image if the user does not choose, px."""


def check_policy(name: str) -> None:
    """Check that a policy can be had.

    Raises:
        UsageError: for an unknown name, or a file that is no agent.
    """
    if name.endswith(AGENT_SUFFIX):
        read_card(Path(name))
        require_learning_packages()
    elif name not in POLICY_NAMES:
        raise UsageError(f"unknown policy '{name}'; choose one of {', '.join(POLICY_NAMES)}, or an agent's .zip")


def surroundings(name: str) -> Surroundings:
    """Where the policy of that name, or the agent in that file, acts.

    Raises:
        UsageError: for a file that is no agent.
    """
    if not name.endswith(AGENT_SUFFIX):
        return Surroundings()
    card = read_card(Path(name))
    if card.config == "residual":
        return Surroundings(image_size=card.image_size)
    arguments = {"observation": CONFIGS[card.config]}
    return Surroundings("fixation_gym:FixationPickZFC-v0", arguments, card.image_size)


def make_policy(name: str, env: Any) -> Policy:
    """Build a policy for an environment made by ``gym.make("FixationPick-v0")``.

    Args:
        name: one of ``POLICY_NAMES``, or the path of an agent for an environment as its ``surroundings``.
        env: the environment; only "oracle" looks into it during an episode.

    Raises:
        UsageError: for an unknown name or a file that is no agent; the message says what is allowed.
    """
    check_policy(name)
    if name.endswith(AGENT_SUFFIX):
        from policies.rl.agent import load_agent

        return load_agent(Path(name), env)
    if name == "random":
        return RandomPolicy()
    if name == "oracle":
        from policies.oracle import OraclePolicy

        return OraclePolicy(env.unwrapped)
    from fixation_gym.envs.scene import TABLE_HEIGHT

    variant = servo_variant(name)
    perception = Perception(env.unwrapped.intrinsics, variant.perception, support_height_m=TABLE_HEIGHT)
    return ServoPolicy(perception, variant.gains, variant.memory, variant.avoid_obstacles)
