"""What a process keeps for its next cell: one thing at a time."""

from __future__ import annotations

import pytest
from evaluation_fakes import FakeEnv, FakePolicy

from fixation_gym.evaluation import workers
from fixation_gym.evaluation.config import EvaluationConfig


def test_a_world_is_kept_for_the_next_seed_and_closed_for_anything_else(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "make_env", lambda cell, render_mode: FakeEnv())
    monkeypatch.setattr(workers, "make_policy", lambda name, env, detector=None: FakePolicy())
    config = EvaluationConfig()
    env, policy = workers.world(config.cell(("clear", 0)))
    assert workers.world(config.cell(("clear", 1))) == (env, policy)
    closed: list[str] = []
    rig = workers.kept(str, "rig", close=closed.append)
    assert env.closed
    assert workers.kept(str, "rig", close=closed.append) is rig
    assert closed == []
    other, _ = workers.world(config.cell(("mirror", 0)))
    assert closed == ["rig"]
    workers.close_kept()
    assert other.closed
