"""Ablations without a simulator: folders, pairing, resuming."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from evaluation_fakes import FakeEnv, FakePolicy, run_fake_cell

from fixation_gym.evaluation import workers
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.reporting.ablation import ablate, format_ablations

CONFIG = EvaluationConfig(scenarios=("clear",), episodes=2)
NAMES = ("servo", "servo:no_retry")


def test_variants_meet_the_same_episodes_and_a_killed_run_resumes(tmp_path: Path) -> None:
    ran: list[tuple[str, int]] = []

    def run(cell: workers.Cell) -> dict:
        if len(ran) == 3:
            raise KeyboardInterrupt
        ran.append((cell["policy"], cell["seed"]))
        return run_fake_cell(cell)

    with pytest.raises(KeyboardInterrupt):
        ablate(CONFIG, NAMES, tmp_path, 0, run=run)
    ran.insert(0, ("killed", 0))

    def run_rest(cell: workers.Cell) -> dict:
        ran.append((cell["policy"], cell["seed"]))
        return run_fake_cell(cell)

    _, summary, different = ablate(CONFIG, NAMES, tmp_path, 0, run=run_rest)
    assert ran[1:] == [(name, seed) for name in NAMES for seed in range(2)]
    assert different == []
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "report.html",
        "servo",
        "servo-no_retry",
        "summary.json",
    ]
    # Seed 1 fails for everybody, seed 0 collides.
    lines = format_ablations(summary, {"servo:no_retry": "one grasp only"}).splitlines()
    assert lines[1].split() == ["servo", "0/2", "-", "-"]
    assert lines[2].split(maxsplit=5)[:3] == ["servo:no_retry", "0/2", "+0"]
    assert lines[2].endswith("one grasp only")


def test_a_folder_with_more_episodes_counts_those_that_are_asked_for(tmp_path: Path) -> None:
    more = EvaluationConfig(scenarios=("clear", "mirror"), episodes=4)
    ablate(more, NAMES, tmp_path, 0, run=run_fake_cell)
    records, summary, _ = ablate(CONFIG, NAMES, tmp_path, 0, run=lambda cell: pytest.fail("nothing is left to do"))
    alone, expected, _ = ablate(CONFIG, NAMES, tmp_path / "alone", 0, run=run_fake_cell)
    assert [record.of(None) for record in records] == [record.of(None) for record in alone]
    for values in (*summary["policies"].values(), *expected["policies"].values()):
        del values["folder"]
    assert summary == expected


def test_only_episodes_that_are_asked_for_are_filmed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "make_env", lambda cell, render_mode: FakeEnv())
    monkeypatch.setattr(workers, "make_policy", lambda name, env, detector=None: FakePolicy())
    ablate(replace(CONFIG, episodes=4), NAMES[:1], tmp_path, 0, run=run_fake_cell)
    ablate(CONFIG, NAMES[:1], tmp_path, 0, film=True, run=run_fake_cell)
    assert sorted(path.name for path in (tmp_path / "servo" / "clips").iterdir()) == ["clear-0.jpg", "clear-1.jpg"]
