"""Resuming: nothing finished is lost or repeated, nothing is half-written."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from evaluation_fakes import FakeEnv, FakePolicy

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.rollout import run_episode
from fixation_gym.evaluation.storage import EPISODES_FILE, RUN_FILE, EpisodeStore, make_folder, write_json

RUN = {"policy": "servo", "image_size": (240, 320)}
RESULT = run_episode(FakeEnv(), FakePolicy(), seed=0, scenario="clear", policy_name="servo")


def fill(folder: Path, seeds: range) -> None:
    with EpisodeStore(folder, RUN) as store:
        for seed in seeds:
            store.append(replace(RESULT, seed=seed))


def stored_seeds(folder: Path) -> list[int]:
    with EpisodeStore(folder, RUN) as store:
        return [seed for _, seed in store.finished]


def test_stored_episodes_are_there_after_a_restart(tmp_path: Path) -> None:
    fill(tmp_path / "a" / "b", range(3))
    with EpisodeStore(tmp_path / "a" / "b", RUN) as store:
        assert store.finished[("clear", 1)] == replace(RESULT, seed=1)
        assert len(store.finished) == 3


def test_a_torn_last_line_is_dropped_wherever_it_was_torn(tmp_path: Path) -> None:
    fill(tmp_path, range(3))
    file = tmp_path / EPISODES_FILE
    whole = file.read_bytes()
    last = whole.rindex(b"\n", 0, -1) + 1
    for end in range(last, len(whole)):
        file.write_bytes(whole[:end])
        assert stored_seeds(tmp_path) == [0, 1]
        assert file.read_bytes() == whole[:last]


def test_after_a_torn_line_the_next_episode_starts_a_new_line(tmp_path: Path) -> None:
    fill(tmp_path, range(2))
    with (tmp_path / EPISODES_FILE).open("ab") as file:
        file.write(b'{"scenario": "cle')
    fill(tmp_path, range(2, 4))
    assert stored_seeds(tmp_path) == [0, 1, 2, 3]


def test_a_damaged_line_in_the_middle_is_an_error_that_names_it(tmp_path: Path) -> None:
    fill(tmp_path, range(3))
    file = tmp_path / EPISODES_FILE
    lines = file.read_bytes().splitlines(keepends=True)
    file.write_bytes(lines[0] + b"???\n" + lines[2])
    with pytest.raises(UsageError, match="line 2 is damaged"):
        EpisodeStore(tmp_path, RUN)


def test_another_run_in_the_folder_is_an_error_that_names_the_difference(tmp_path: Path) -> None:
    fill(tmp_path, range(1))
    with pytest.raises(UsageError, match="policy servo instead of blind; choose another --out"):
        EpisodeStore(tmp_path, {**RUN, "policy": "blind"})
    assert stored_seeds(tmp_path) == [0]


def test_episodes_without_their_run_description_are_an_error(tmp_path: Path) -> None:
    fill(tmp_path, range(1))
    (tmp_path / RUN_FILE).unlink()
    with pytest.raises(UsageError, match=r"no run\.json"):
        EpisodeStore(tmp_path, RUN)


def test_a_folder_in_use_is_an_error(tmp_path: Path) -> None:
    with EpisodeStore(tmp_path, RUN), pytest.raises(UsageError, match="in use"):
        EpisodeStore(tmp_path, RUN)
    assert stored_seeds(tmp_path) == []


def test_a_folder_that_cannot_be_made_is_an_error_and_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(UsageError, match="cannot write to the output folder"):
        make_folder(tmp_path / "file" / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_failed_write_keeps_the_old_file_and_leaves_no_other(tmp_path: Path) -> None:
    path = tmp_path / "summary.json"
    write_json(path, {"a": 1})
    with pytest.raises(ValueError, match="JSON"):
        write_json(path, {"a": float("nan")})
    assert json.loads(path.read_text()) == {"a": 1}
    assert list(tmp_path.iterdir()) == [path]
