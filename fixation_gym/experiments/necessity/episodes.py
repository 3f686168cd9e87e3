"""Episodes that end at their first collision, because the measure is success without any.

Policies that see the truth and no image need no environment: its episode is played without observations and rendering.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import gymnasium
import numpy as np

from fixation_gym.envs import config
from fixation_gym.envs.arguments import checked_action
from fixation_gym.envs.scene import SceneSpec
from fixation_gym.robots import ROBOT
from fixation_policies.base import Policy

if TYPE_CHECKING:
    from fixation_gym.envs.pick_sim import PickSim


@dataclass(frozen=True, eq=False)
class World:
    """What a privileged policy looks into."""

    sim: PickSim
    scene: SceneSpec


@dataclass(frozen=True)
class Outcome:
    """How an episode ended."""

    success: bool
    """Lifted, and no collision before."""
    collision: bool
    time_s: float
    """Simulated time at the end, s."""
    phase: str | None
    """What the policy was doing at the end."""


def play(world: World, policy: Policy) -> Outcome:
    """Run one episode with the rules of ``FixationPick-v0``; the policy has been made for this world.

    What moves by itself makes no difference to the rules.
    """
    sim, period = world.sim, 1.0 / config.CONTROL_FREQUENCY
    sim.reset(world.scene)
    policy.reset()
    lifted = step = 0
    collision = success = False
    while step < round(config.EPISODE_SECONDS / period) and not (collision or success):
        action = checked_action(policy.act({"time": np.array([step * period], np.float32)}), 7)
        _, hit = sim.step(action[:6] * ROBOT.arm.twist_limits, float(action[6]))
        step += 1
        collision = hit or sim.obstacle_push() > config.COLLISION_PUSH
        lifted = lifted + 1 if sim.target_rise() >= config.LIFT_HEIGHT else 0
        success = not collision and lifted >= config.HOLD_SECONDS * config.CONTROL_FREQUENCY
    return Outcome(success, collision, step * period, _phase(policy))


def play_in(env: gymnasium.Env, policy: Policy, seed: int) -> Outcome:
    """Run one episode of an environment with the ``info`` keys of ``FixationPick-v0``."""
    obs, info = env.reset(seed=seed)
    policy.reset(seed)
    over, steps = False, 0
    while not (over or info["collision"]):
        obs, _, terminated, truncated, info = env.step(policy.act(obs))
        over, steps = terminated or truncated, steps + 1
    collision, time = bool(info["collision"]), steps / config.CONTROL_FREQUENCY
    return Outcome(bool(info["is_success"]) and not collision, collision, time, _phase(policy))


def _phase(policy: Policy) -> str | None:
    return None if policy.estimate is None else str(policy.estimate.phase)
