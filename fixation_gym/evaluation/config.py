"""What ``evaluate`` runs, as a value. Imports nothing heavy, so that the command line answers at once."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from fixation_gym.doctor import installed_versions
from fixation_gym.errors import UsageError, check_names
from fixation_gym.names import Names

if TYPE_CHECKING:
    from fixation_gym.evaluation.rollout import EpisodeKey
    from fixation_gym.evaluation.workers import Cell
    from fixation_policies.catalogue import NeededEnvironment

SEED_BLOCK = 100_000
"""Episode i of ``--seed S`` has seed S * SEED_BLOCK + i, in every scenario: policies meet the same scenes."""

_IMAGE_SIZES = (32, 2048)


@dataclass(frozen=True)
class EvaluationConfig:
    """What to evaluate, and with how many processes."""

    policy: str = "servo"
    """servo, blind, random, oracle, a variant of the servo, such as servo:no_retry, the path of an agent's zip, or
    module:Class of your own."""
    detector: str | None = None
    """Finds the target for policies that look: colour, mean_shift, box (what the first box shows), or module:Class of
    your own; by default colour, and box in any_colour."""
    scenarios: Annotated[Names, tyro.conf.arg(name="scenario")] = ("clear", "opaque", "translucent", "mirror")
    """Scenario names, separated by commas."""
    episodes: int = 20
    """Episodes per scenario."""
    seed: int = 0
    """Chooses the block of episode seeds: episode i has seed 100000 * SEED + i in every scenario."""
    sensor_noise: str = "nominal"
    """ideal, nominal, conservative or realistic."""
    image_size: tuple[int, int] | None = None
    """Height and width of the wrist image, px; 240 320 by default, for an agent those of its training."""
    renderer: str = "mujoco"
    """Who makes the wrist image: mujoco, or mitsuba with real glass and mirrors (extra photoreal; slow)."""
    workers: int = 1
    """Number of processes."""
    backend: str = "loky"
    """Where the processes run: loky (this machine) or ray (a Ray cluster)."""

    def check(self) -> None:
        """Check everything that can be checked without building an environment.

        Raises:
            UsageError: naming the first bad value and what is allowed.
        """
        from fixation_gym.envs.photoreal.engine import check_renderer
        from fixation_gym.envs.sensor_noise import SENSOR_NOISE
        from fixation_gym.evaluation.workers import check_backend
        from fixation_policies.catalogue import check_detector, check_policy

        check_policy(self.policy)
        check_detector(self.detector, self.policy)
        check_names([self.sensor_noise], SENSOR_NOISE, "sensor noise")
        check_renderer(self.renderer)
        check_scenarios(self.scenarios)
        if not 1 <= self.episodes <= SEED_BLOCK:
            raise UsageError(f"--episodes must be within 1..{SEED_BLOCK}, got {self.episodes}")
        check_seed(self.seed)
        size = self.needed_environment.image_size
        if not all(_IMAGE_SIZES[0] <= length <= _IMAGE_SIZES[1] for length in size):
            raise UsageError(f"--image-size must be within {_IMAGE_SIZES[0]}..{_IMAGE_SIZES[1]}, got {size}")
        check_backend(self.backend, self.workers)

    @property
    def needed_environment(self) -> NeededEnvironment:
        """What the policy acts in, with the image size that is asked for."""
        from fixation_policies.catalogue import needed_environment

        own = needed_environment(self.policy)
        return own if self.image_size is None else replace(own, image_size=self.image_size)

    def run_description(self) -> dict[str, Any]:
        """Everything the result of one episode depends on, apart from its scenario and seed."""
        from fixation_policies.catalogue import source_hashes

        needed = self.needed_environment
        return {
            "policy": self.policy,
            "seed": self.seed,
            "sensor_noise": self.sensor_noise,
            "image_size": list(needed.image_size),
            "env_id": needed.env_id,
            **({} if self.detector is None else {"detector": self.detector}),
            **self._renderer_description(),
            **source_hashes(self.policy, self.detector),
            "gl": os.environ.get("MUJOCO_GL"),
            "versions": installed_versions(),
        }

    def _renderer_description(self) -> dict[str, str]:
        """The renderer, if it is not MuJoCo's. Variants of Mitsuba differ in the noise of their pictures."""
        if self.renderer == "mujoco":
            return {}
        from fixation_gym.envs.photoreal.engine import choose_variant

        return {"renderer": self.renderer, "variant": choose_variant()}

    def episode_keys(self) -> list[EpisodeKey]:
        """(scenario, seed) of every episode, in order."""
        return [(scenario, seed) for scenario in self.scenarios for seed in episode_seeds(self.seed, self.episodes)]

    def cell(self, key: EpisodeKey) -> Cell:
        """The episode with this key, as ``workers.run_cell`` takes it."""
        scenario, seed = key
        needed = self.needed_environment
        return {
            "env_id": needed.env_id,
            "scenario": scenario,
            "policy": self.policy,
            "detector": self.detector,
            "seed": seed,
            "sensor_noise": self.sensor_noise,
            "image_size": list(needed.image_size),
            "renderer": self.renderer,
        }


def episode_seeds(seed: int, episodes: int) -> list[int]:
    """Seeds of the episodes of one scenario; blocks of different ``seed`` never overlap."""
    return [seed * SEED_BLOCK + index for index in range(episodes)]


def check_scenarios(names: Sequence[str]) -> None:
    """Check names of scenarios.

    Raises:
        UsageError: if there are none, one is unknown, or one is named twice.
    """
    from fixation_gym.envs.config import SCENARIO_NAMES

    check_names(names, SCENARIO_NAMES, "scenario")
    if len(set(names)) < len(names):
        raise UsageError(f"--scenario must name one or more different scenarios, got {','.join(names)!r}")


def check_seed(seed: int) -> None:
    """Check the block of seeds.

    Raises:
        UsageError: if it is negative.
    """
    if seed < 0:
        raise UsageError(f"--seed must be 0 or more, got {seed}")
