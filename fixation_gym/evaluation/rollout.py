"""One episode of one policy, and what is measured in it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from fixation_gym.envs.info import reward_terms
from fixation_gym.envs.pick_env import FixationPickEnv
from fixation_gym.envs.rewards import TERMS
from fixation_gym.evaluation.scene_truth import scene_of
from fixation_gym.evaluation.statistics import mean, minimum, root_mean_square
from fixation_gym.evaluation.trace import Trace, TraceRecorder
from fixation_policies.base import Estimate, Policy, decision

APPROACH = "approach"
GRASP = "grasp"
GAZE_PHASES = ("fixate", APPROACH)
"""Phases in which a policy holds its gaze on the target."""

EpisodeKey = tuple[str, int]
"""(scenario, seed)"""
FrameCallback = Callable[[NDArray[np.uint8]], None]


@dataclass(frozen=True)
class EpisodeResult:
    """Measurements of one episode; None where there was nothing to measure. All but the trace are JSON-able."""

    scenario: str
    policy: str
    seed: int
    success: bool
    collision: bool
    collision_free_success: bool
    time_s: float
    """Simulated time at the end, s."""
    steps: int
    return_: float
    """Sum of the rewards."""
    reward_terms: dict[str, float]
    """Sum of every reward term over the episode."""
    final_phase: str | None
    distance_error_at_grasp_m: float | None
    """Absolute error of the last distance estimate of the approach that ended in a grasp, m."""
    distance_mae_m: float | None
    """Mean absolute error of the distance estimate while the gaze is held, m."""
    fixation_rms_px: float | None
    """Root mean square of the target's offset from the image centre while the gaze is held, px."""
    min_clearance_m: float | None
    """Smallest distance between robot and obstacles, m; 0.5 also where they are further apart or there is none."""

    trace: Trace | None = field(default=None, compare=False, repr=False)
    """What happened step by step, if known; it is kept in a file of its own."""

    @property
    def key(self) -> EpisodeKey:
        """What tells the results of one run apart."""
        return self.scenario, self.seed

    def to_json(self) -> dict[str, Any]:
        """A dict of JSON values, without the trace."""
        values = asdict(replace(self, trace=None))
        del values["trace"]
        return values

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> EpisodeResult:
        """The inverse of ``to_json``; ``values`` may also hold a ``trace``.

        Raises:
            TypeError: if a field is missing or unknown.
        """
        return cls(**values)


@dataclass(frozen=True)
class Step:
    """One decision: what the policy believed, and what was true at the same instant."""

    phase: str | None
    distance_m: float
    """Estimated distance; NaN without an estimate."""
    distance_true_m: float
    fixation_error_px: float

    @property
    def distance_error_m(self) -> float:
        """Absolute error of the estimate; NaN without one."""
        return abs(self.distance_m - self.distance_true_m)


def every_decision(step: int) -> bool:
    """Film all decisions."""
    return True


def run_episode(
    env: gymnasium.Env,
    policy: Policy,
    seed: int,
    on_frame: FrameCallback | None = None,
    scenario: str = "",
    policy_name: str = "",
    filmed: Callable[[int], bool] = every_decision,
) -> EpisodeResult:
    """Run one episode to its end.

    Args:
        env: environment with the ``info`` keys of ``FixationPick-v0``.
        policy: is reset with the same seed. If it has an attribute ``estimate``, None or a
            ``fixation_policies.base.Estimate``, its distances are judged.
        seed: of the environment's reset.
        on_frame: called with ``env.render()`` at decisions, after the policy has seen the observation, and at the end.
        scenario: name written to the result.
        policy_name: name written to the result.
        filmed: tells which decisions are rendered, by their number from 0.
    """
    obs, info = env.reset(seed=seed)
    policy.reset(seed)
    recorder = TraceRecorder(scene_of(env))
    steps: list[Step] = []
    total = 0.0
    terms = dict.fromkeys(TERMS, 0.0)
    terminated = truncated = False
    while not (terminated or truncated):
        action = decision(policy, obs)
        estimate = getattr(policy, "estimate", None)
        _show_percept(env, policy)
        recorder.add(_sensed(env, obs), info, estimate)
        steps.append(_record(estimate, info))
        if on_frame is not None and filmed(len(steps) - 1):
            on_frame(_render(env))
        obs, reward, terminated, truncated, info = env.step(action)
        total += float(reward)
        terms = {term: terms[term] + value for term, value in reward_terms(info).items()}
    if on_frame is not None:
        on_frame(_render(env))
    recorder.add_end(_sensed(env, obs), info)
    return _result((scenario, policy_name, seed), steps, recorder.trace(), bool(info["is_success"]), total, terms)


def _result(
    names: tuple[str, str, int],
    steps: Sequence[Step],
    trace: Trace,
    success: bool,
    total: float,
    terms: dict[str, float],
) -> EpisodeResult:
    """Measurements of an episode with these decisions; ``names`` are scenario, policy and seed."""
    scenario, policy, seed = names
    gazing = [step for step in steps if step.phase is None or step.phase in GAZE_PHASES]
    collision = bool(trace.collided[-1])
    return EpisodeResult(
        scenario=scenario,
        policy=policy,
        seed=seed,
        success=success,
        collision=collision,
        collision_free_success=success and not collision,
        time_s=float(trace.time_s[-1]),
        steps=len(steps),
        return_=total,
        reward_terms=terms,
        final_phase=steps[-1].phase,
        distance_error_at_grasp_m=error_at_grasp(steps),
        distance_mae_m=mean(step.distance_error_m for step in gazing),
        fixation_rms_px=root_mean_square(step.fixation_error_px for step in gazing),
        min_clearance_m=minimum(trace.clearance_m),
        trace=trace,
    )


def error_at_grasp(steps: Sequence[Step]) -> float | None:
    """Distance error at the last approach step that a grasp step follows; None without such a step or estimate."""
    for before, after in zip(reversed(steps[:-1]), reversed(steps), strict=False):
        if before.phase == APPROACH and after.phase == GRASP:
            return before.distance_error_m if math.isfinite(before.distance_error_m) else None
    return None


def _record(estimate: Estimate | None, info: Mapping[str, Any]) -> Step:
    """Pair the policy's estimate with the truth of the observation that it was made from."""
    return Step(
        phase=None if estimate is None else str(estimate.phase),
        distance_m=math.nan if estimate is None else float(estimate.distance_m),
        distance_true_m=float(info["distance_true_m"]),
        fixation_error_px=float(info["fixation_error_px"]),
    )


def _sensed(env: gymnasium.Env, obs: Mapping[str, Any]) -> Mapping[str, Any]:
    """What the sensors read, also where the policy is shown something else."""
    base = env.unwrapped
    return base.sensed if isinstance(base, FixationPickEnv) else obs


def _show_percept(env: gymnasium.Env, policy: Policy) -> None:
    """Let the overlay draw what the policy perceived, if it says so; an agent's environment says it itself."""
    base, percept = env.unwrapped, getattr(policy, "percept", None)
    if isinstance(base, FixationPickEnv) and percept is not None:
        base.percept = percept


def _render(env: gymnasium.Env) -> NDArray[np.uint8]:
    frame = env.render()
    if not isinstance(frame, np.ndarray):
        raise TypeError("frames were asked for, but the environment renders none; make it with render_mode='rgb_array'")
    return frame
