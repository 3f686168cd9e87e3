"""Evaluation folders written by hand: a servo that is good and a blind one that collides."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from evaluation_fakes import FakeEnv, FakePolicy
from made_traces import make_trace

from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.evaluation.evaluate import summary_of
from fixation_gym.evaluation.files import write_json
from fixation_gym.evaluation.rollout import EpisodeResult, run_episode
from fixation_gym.evaluation.storage import EpisodeStore
from fixation_gym.evaluation.trace import Trace

BASE = replace(run_episode(FakeEnv(), FakePolicy(), seed=2), trace=None)
WAY = [("search", 5), ("fixate", 40), ("approach", 100), ("grasp", 30), ("close", 20)]
SCENARIOS = ("clear", "mirror")
EPISODES = 4


def episode(policy: str, scenario: str, seed: int, success: bool, hit: bool) -> EpisodeResult:
    end = [("lift", 50)] if success else [("recover", 10), ("search", 40)]
    trace: Trace = make_trace([*WAY, *end], collided_from=90 if hit else None, obstacle_shift=(0.0, 0.04 * hit))
    return replace(
        BASE,
        policy=policy,
        scenario=scenario,
        seed=seed,
        success=success,
        collision=hit,
        collision_free_success=success and not hit,
        time_s=float(trace.time_s[-1]) + seed,
        steps=len(trace.phases) - 1,
        final_phase=trace.phases[-1],
        trace=trace,
    )


def write_evaluation(folder: Path, config: EvaluationConfig, results: list[EpisodeResult]) -> Path:
    with EpisodeStore(folder, {"command": "evaluate", **config.run_description()}) as store:
        for result in results:
            store.append(result)
        write_json(folder / "summary.json", summary_of(config, list(store.finished.values()), wall_s=600.0))
    return folder


@pytest.fixture(scope="session")
def servo_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Fails once, in mirror: it loses the target. Not to be written to."""
    config = EvaluationConfig("servo", scenarios=SCENARIOS, episodes=EPISODES)
    results = [episode("servo", *key, success=key != ("mirror", 1), hit=False) for key in config.episode_keys()]
    return write_evaluation(tmp_path_factory.mktemp("evaluations") / "servo", config, results)


@pytest.fixture(scope="session")
def blind_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Always picks in clear, collides in mirror, and picks there half the time. Not to be written to."""
    config = EvaluationConfig("blind", scenarios=SCENARIOS, episodes=EPISODES)
    keys = config.episode_keys()
    results = [
        episode("blind", *key, success=key[0] == "clear" or key[1] % 2 == 0, hit=key[0] == "mirror") for key in keys
    ]
    return write_evaluation(tmp_path_factory.mktemp("evaluations") / "blind", config, results)
