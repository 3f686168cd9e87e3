"""Policies by name, for the command line."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fixation_gym.envs.config import IMAGE_SIZE
from fixation_gym.errors import UsageError
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.detection.box_tracker import BoxTracker
from fixation_gym.perception.detection.colour import ColourDetector
from fixation_gym.perception.detection.detector import Detector
from fixation_gym.perception.detection.named import DETECTOR_METHODS, DETECTORS, detector_named
from fixation_gym.perception.pipeline import Perception
from fixation_gym.robots import ROBOT
from fixation_gym.strangers import is_class_name, load_class, source_hash
from fixation_policies.base import Policy
from fixation_policies.baselines import RandomPolicy
from fixation_policies.paper import PAPER_NAMES, paper_variant
from fixation_policies.rl.agent_file import read_agent, read_card
from fixation_policies.rl.config import CONFIGS
from fixation_policies.servo.servo_policy import ServoPolicy
from fixation_policies.servo.variants import VARIANT_NAMES, ServoVariant, servo_variant

AGENT_SUFFIX = ".zip"
POLICY_NAMES = (
    *("servo", "blind", "random", "oracle", "paper"),
    *(name for name in (*VARIANT_NAMES, *PAPER_NAMES) if ":" in name),
)
_POLICY_METHODS = ("reset", "act")


@dataclass(frozen=True)
class NeededEnvironment:
    """The environment that a policy acts in."""

    env_id: str = "fixation_gym:FixationPick-v0"
    arguments: dict[str, Any] = field(default_factory=dict)
    """Of the environment, beside those that the user chooses."""
    image_size: tuple[int, int] = IMAGE_SIZE
    """Height and width of the wrist image if the user does not choose, px."""


def check_policy(name: str) -> None:
    """Check that a policy can be had.

    Raises:
        UsageError: for an unknown name, or a file that is no agent or has no agent's weights.
    """
    if name.endswith(AGENT_SUFFIX):
        read_agent(Path(name))
    elif name in POLICY_NAMES:
        return
    elif is_class_name(name):
        load_class(name, "--policy", _POLICY_METHODS)
    else:
        known = ", ".join(POLICY_NAMES)
        raise UsageError(f"unknown policy '{name}'; choose one of {known}, an agent's .zip, or module:Class")


def check_detector(name: str | None, policy: str) -> None:
    """Check that a detector can be had, and that the policy takes one; None stands for the default.

    Raises:
        UsageError: if not, saying what is allowed.
    """
    if name is None:
        return
    if policy not in VARIANT_NAMES:
        raise UsageError(f"--detector goes with the policies that look: {', '.join(VARIANT_NAMES)}; got '{policy}'")
    detector_named(name)


def source_hashes(policy: str, detector: str | None) -> dict[str, str]:
    """Of an agent's file and of somebody else's classes, what the files held: changed, they are others."""
    hashes = {}
    if policy.endswith(AGENT_SUFFIX):
        hashes["policy_sha256"] = hashlib.sha256(Path(policy).read_bytes()).hexdigest()
    elif policy not in POLICY_NAMES:
        hashes["policy_sha256"] = source_hash(policy, "--policy", _POLICY_METHODS)
    if detector is not None and detector not in DETECTORS:
        hashes["detector_sha256"] = source_hash(detector, "--detector", DETECTOR_METHODS)
    return hashes


def needed_environment(name: str) -> NeededEnvironment:
    """What the policy of that name, or the agent in that file, acts in.

    Raises:
        UsageError: for a file that is no agent.
    """
    if name in VARIANT_NAMES:
        return NeededEnvironment(arguments={"depth_camera": True} if servo_variant(name).depth_camera else {})
    if not name.endswith(AGENT_SUFFIX):
        return NeededEnvironment()
    card = read_card(Path(name))
    learner = CONFIGS[card.config]
    if learner.residual:
        return NeededEnvironment(image_size=card.image_size)
    arguments = {"observation": learner.observation}
    return NeededEnvironment("fixation_gym:FixationPickZFC-v0", arguments, card.image_size)


def make_policy(name: str, env: Any, detector: str | None = None) -> Policy:
    """Build a policy for an environment made by ``gym.make("FixationPick-v0")``.

    Args:
        name: one of ``POLICY_NAMES``, the path of an agent for an environment as its ``needed_environment``, or
            ``module:Class``; such a class is called with the unwrapped environment.
        env: the environment; only "oracle" looks into it during an episode.
        detector: one of ``DETECTORS`` or ``module:Class``, called with the camera's ``Intrinsics``. None: by colour, or
            by the box in the first image where the target may be of any colour.

    Raises:
        UsageError: for an unknown name or a file that is no agent; the message says what is allowed.
    """
    check_policy(name)
    check_detector(detector, name)
    if name.endswith(AGENT_SUFFIX):
        from fixation_policies.rl.agent import load_agent

        return load_agent(Path(name), env)
    if name == "random":
        return RandomPolicy()
    if name == "oracle":
        from fixation_policies.oracle import OraclePolicy

        return OraclePolicy(env.unwrapped)
    if name not in POLICY_NAMES:
        return load_class(name, "--policy", _POLICY_METHODS)(env.unwrapped)
    if name in PAPER_NAMES:
        return paper_variant(name).policy(env.unwrapped.intrinsics, ROBOT.workspace.table_height)
    variant, intrinsics = servo_variant(name), env.unwrapped.intrinsics
    perception = Perception(
        intrinsics,
        variant.perception,
        support_height_m=ROBOT.workspace.table_height,
        detector=_detector(detector, variant, env.unwrapped)(intrinsics),
        estimator=None if variant.estimator is None else variant.estimator(),
    )
    return ServoPolicy(perception, variant.gains, variant.memory, variant.avoid_obstacles)


def _detector(name: str | None, variant: ServoVariant, env: Any) -> Callable[[Intrinsics], Detector]:
    """What makes the detector of that name."""
    if name is None:
        return variant.detector or (ColourDetector if env.scenario.red_target else BoxTracker)
    return detector_named(name)
