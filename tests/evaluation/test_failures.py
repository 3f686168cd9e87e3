"""Every kind of failure, on made-up traces."""

from __future__ import annotations

from dataclasses import replace

import pytest
from evaluation_fakes import FakeEnv, FakePolicy
from made_traces import make_trace

from fixation_gym.evaluation.failures import FailureKind, classify, grasps
from fixation_gym.evaluation.rollout import run_episode
from fixation_gym.evaluation.trace import Trace

SUCCESS = run_episode(FakeEnv(), FakePolicy(), seed=2)
FAILED = replace(SUCCESS, success=False, collision_free_success=False, final_phase="approach")
LOOK = [("search", 5), ("fixate", 40), ("approach", 100)]
TRY = [("grasp", 30), ("close", 20)]


def test_a_collision_free_success_is_no_failure() -> None:
    assert classify(SUCCESS, make_trace([*LOOK, *TRY, ("lift", 40)])) is None
    assert classify(SUCCESS, None) is None


@pytest.mark.parametrize(
    ("trace", "kind", "phase", "time_s", "detail"),
    [
        (make_trace([*LOOK, *TRY], collided_from=100), "collision", "approach", 4.0, "at 4.0 s in approach"),
        (make_trace([("search", 100), ("recover", 20), ("search", 5)]), "never found", "search", 4.96, "searched for"),
        (
            make_trace([*LOOK, *TRY, ("lift", 50), ("recover", 55)], rise=(0, 0, 0, 0, 0, 0.12, 0.0, 0.0)),
            "dropped",
            "recover",
            None,
            "from 12 cm",
        ),
        (make_trace([*LOOK, ("recover", 20), ("search", 50)]), "lost target", "search", 6.6, "after 0 grasps"),
        (make_trace([*LOOK, *TRY, ("recover", 5), ("search", 50)]), "lost target", "search", 8.0, "after 1 grasp"),
        (make_trace([*LOOK, *TRY, ("fixate", 9), *TRY, ("approach", 4)]), "grasp missed", "approach", None, "2 grasps"),
        (make_trace(LOOK, distance=(0.45, 0.31)), "never approached", "approach", 5.76, "no nearer than 31 cm"),
        (make_trace(LOOK), "timed out", "approach", 5.76, "in approach since 1.8 s"),
        (make_trace([("search", 5), ("fixate", 60)]), "timed out", "fixate", 2.56, "in fixate since 0.2 s"),
        (make_trace([*LOOK, ("grasp", 10)]), "timed out", "grasp", 6.16, "in grasp since 5.8 s"),
        (make_trace([("", 80)]), "timed out", "", 3.16, "nearest 18 cm"),
    ],
)
def test_a_trace_tells_the_kind(trace: Trace, kind: str, phase: str, time_s: float | None, detail: str) -> None:
    result = replace(FAILED, collision=bool(trace.collided[-1]))
    failure = classify(result, trace)
    assert failure is not None
    assert (failure.kind.value, failure.phase) == (kind, phase)
    assert detail in failure.detail
    if time_s is not None:
        assert failure.time_s == pytest.approx(time_s)


def test_a_success_with_a_collision_is_a_collision() -> None:
    result = replace(SUCCESS, collision=True, collision_free_success=False)
    failure = classify(result, make_trace([*LOOK, *TRY, ("lift", 40)], collided_from=150))
    assert failure is not None
    assert failure.kind is FailureKind.COLLISION
    assert failure.phase == "grasp"
    assert failure.detail.endswith("picked the target all the same")


def test_a_target_still_lifted_at_the_end_was_not_dropped() -> None:
    failure = classify(FAILED, make_trace([*LOOK, *TRY, ("lift", 10)], rise=(0, 0, 0, 0, 0.05)))
    assert failure is not None
    assert (failure.kind, failure.phase) == (FailureKind.TIMED_OUT, "lift")


@pytest.mark.parametrize(
    ("collision", "final_phase", "error_m", "kind"),
    [
        (True, "lift", 0.001, FailureKind.COLLISION),
        (False, "search", None, FailureKind.LOST_TARGET),
        (False, "approach", 0.037, FailureKind.GRASP_MISSED),
        (False, "approach", None, FailureKind.BLOCKED),
        (False, "lift", 0.001, FailureKind.TIMED_OUT),
        (False, None, None, FailureKind.TIMED_OUT),
    ],
)
def test_without_a_trace_the_result_tells_what_it_can(
    collision: bool, final_phase: str | None, error_m: float | None, kind: FailureKind
) -> None:
    result = replace(FAILED, collision=collision, final_phase=final_phase, distance_error_at_grasp_m=error_m)
    failure = classify(result, None)
    assert failure is not None
    assert failure.kind is kind


def test_grasps_are_counted_by_their_beginnings() -> None:
    assert grasps(make_trace(LOOK)) == 0
    assert grasps(make_trace([*TRY, ("recover", 3), *TRY])) == 2
