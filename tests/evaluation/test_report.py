"""What a summary says about episodes with known measurements."""

from __future__ import annotations

from dataclasses import replace

import pytest
from evaluation_fakes import FakeEnv, FakePolicy

from fixation_gym.evaluation.report import summarise
from fixation_gym.evaluation.rollout import run_episode

RESULT = run_episode(FakeEnv(), FakePolicy(), seed=2, scenario="clear", policy_name="servo")


@pytest.mark.parametrize(
    ("clearances", "expected"),
    [
        ((0.5, 0.5), None),  # where the environment's measurement ends, or without obstacles
        ((0.5, 0.499), 0.499),
        ((0.03, -0.002), -0.002),
        ((None, 0.2), 0.2),
        ((None, None), None),
    ],
)
def test_a_saturated_clearance_is_no_measurement(clearances: tuple[float | None, ...], expected: float | None) -> None:
    summary = summarise([replace(RESULT, min_clearance_m=clearance) for clearance in clearances])
    assert summary["clear"]["min_clearance_m"] == expected
