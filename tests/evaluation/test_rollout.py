"""What one episode is measured to be."""

from __future__ import annotations

import json

import numpy as np
import pytest
from evaluation_fakes import FakeEnv, FakePolicy, SilentPolicy

from fixation_gym.evaluation.rollout import EpisodeResult, Step, error_at_grasp, run_episode


def test_an_episode_has_the_measurements_of_its_steps() -> None:
    result = run_episode(FakeEnv(), FakePolicy(), seed=2, scenario="clear", policy_name="servo")
    assert (result.scenario, result.policy, result.seed) == ("clear", "servo", 2)
    assert (result.success, result.collision, result.collision_free_success) == (True, False, True)
    assert (result.steps, result.return_, result.final_phase) == (5, 5.0, "lift")
    assert result.time_s == pytest.approx(0.2)
    assert result.reward_terms == {"progress": 3.75, "time": 0.0, "success": 1.25, "collision": 0.0}
    assert result.min_clearance_m == pytest.approx(0.0)


def test_an_estimate_is_compared_with_the_truth_of_its_own_observation() -> None:
    result = run_episode(FakeEnv(), FakePolicy(), seed=2)
    # Decisions at 1.0, 0.9, 0.8, 0.7 and 0.6 m; the estimate is 0.85 m; the approach ends at 0.8 m.
    assert result.distance_error_at_grasp_m == pytest.approx(0.05)
    assert result.distance_mae_m == pytest.approx(
        np.mean([0.05, 0.05])
    )  # only while the gaze is held: at 0.9 and 0.8 m


def test_fixation_error_counts_only_while_the_gaze_is_held() -> None:
    result = run_episode(FakeEnv(), FakePolicy(), seed=2)
    assert result.fixation_rms_px == pytest.approx(np.sqrt((3.0**2 + 4.0**2) / 2))  # the two approach steps


def test_a_policy_without_estimate_has_no_distance_error() -> None:
    result = run_episode(FakeEnv(), SilentPolicy(), seed=2)
    assert result.distance_error_at_grasp_m is None
    assert result.distance_mae_m is None
    assert result.final_phase is None
    assert result.fixation_rms_px is not None


@pytest.mark.parametrize(
    ("seed", "success", "collision", "both"), [(1, False, False, False), (2, True, False, True), (4, True, True, False)]
)
def test_a_success_with_a_collision_is_not_collision_free(
    seed: int, success: bool, collision: bool, both: bool
) -> None:
    result = run_episode(FakeEnv(), FakePolicy(), seed)
    assert (result.success, result.collision, result.collision_free_success) == (success, collision, both)


def test_the_error_at_grasp_is_that_of_the_last_approach_that_led_to_one() -> None:
    def step(phase: str, estimate: float) -> Step:
        return Step(phase, estimate, distance_true_m=0.2, fixation_error_px=0.0)

    retry = [step("approach", 0.3), step("grasp", 0.2), step("recover", 0.2), step("approach", 0.21)]
    assert error_at_grasp([*retry, step("grasp", 0.5)]) == pytest.approx(0.01)
    assert error_at_grasp(retry) == pytest.approx(0.1)
    assert error_at_grasp([step("approach", 0.3), step("recover", 0.2)]) is None
    assert error_at_grasp([step("approach", float("nan")), step("grasp", 0.2)]) is None
    assert error_at_grasp([]) is None


def test_results_survive_json() -> None:
    result = run_episode(FakeEnv(), SilentPolicy(), seed=3, scenario="clear", policy_name="random")
    assert EpisodeResult.from_json(json.loads(json.dumps(result.to_json(), allow_nan=False))) == result


def test_every_decision_and_the_end_are_filmed() -> None:
    frames: list[np.ndarray] = []
    run_episode(FakeEnv(), FakePolicy(), seed=2, on_frame=frames.append)
    assert [int(frame[0, 0, 0]) for frame in frames] == [0, 40, 80, 120, 160, 200]


def test_only_the_wanted_decisions_are_filmed_and_still_the_end() -> None:
    frames: list[np.ndarray] = []
    run_episode(FakeEnv(), FakePolicy(), seed=2, on_frame=frames.append, filmed=lambda step: step % 3 == 0)
    assert [int(frame[0, 0, 0]) for frame in frames] == [0, 120, 200]


def test_filming_an_environment_without_frames_is_an_error() -> None:
    class Blind(FakeEnv):
        def render(self):
            return None

    with pytest.raises(TypeError, match="render_mode='rgb_array'"):
        run_episode(Blind(), FakePolicy(), seed=2, on_frame=lambda frame: None)
