"""Policies by name, for the command line."""

from __future__ import annotations

from typing import Any

from fixation_gym.perception.pipeline import Perception
from policies.base import Policy
from policies.baselines import RandomPolicy
from policies.servo.servo_policy import ServoPolicy
from policies.servo.variants import VARIANT_NAMES, servo_variant

POLICY_NAMES = ("servo", "blind", "random", "oracle", *(name for name in VARIANT_NAMES if ":" in name))


def make_policy(name: str, env: Any) -> Policy:
    """Build a policy for an environment made by ``gym.make("FixationPick-v0")``.

    Args:
        name: one of ``POLICY_NAMES``.
        env: the environment; only "oracle" looks into it during an episode.

    Raises:
        ValueError: for an unknown name; the message lists the valid ones.
    """
    if name not in POLICY_NAMES:
        raise ValueError(f"unknown policy {name!r}; choose one of {', '.join(POLICY_NAMES)}")
    if name == "random":
        return RandomPolicy()
    if name == "oracle":
        from policies.oracle import OraclePolicy

        return OraclePolicy(env.unwrapped)
    from fixation_gym.envs.scene import TABLE_HEIGHT

    variant = servo_variant(name)
    perception = Perception(env.unwrapped.intrinsics, variant.perception, support_height_m=TABLE_HEIGHT)
    return ServoPolicy(perception, variant.gains, avoid_obstacles=variant.avoid_obstacles)
