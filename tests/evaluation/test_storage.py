"""Resuming: nothing finished is lost or repeated, nothing is half-written."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from evaluation_fakes import FakeEnv, FakePolicy

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.files import unfinished_file, write_json
from fixation_gym.evaluation.rollout import run_episode
from fixation_gym.evaluation.storage import (
    EPISODES_FILE,
    RUN_FILE,
    SUMMARY_FILE,
    EpisodeStore,
    folder_lock,
    make_folder,
)

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


def test_a_folder_in_use_is_not_judged_before_it_is_free(tmp_path: Path) -> None:
    with EpisodeStore(tmp_path, RUN), pytest.raises(UsageError, match="in use"):
        EpisodeStore(tmp_path, {**RUN, "policy": "blind"})


def test_a_lock_leaves_no_file_and_ends_with_an_error(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), folder_lock(tmp_path):
        raise KeyboardInterrupt
    with folder_lock(tmp_path):
        assert list(tmp_path.iterdir()) == []


def test_a_refused_run_frees_the_folder_and_leaves_it_as_it_was(tmp_path: Path) -> None:
    write_json(tmp_path / RUN_FILE, {**RUN, "policy": "blind"})
    for _ in range(2):
        with pytest.raises(UsageError, match="another run, with policy"):
            EpisodeStore(tmp_path, RUN)
    assert [path.name for path in tmp_path.iterdir()] == [RUN_FILE]


@pytest.mark.parametrize("name", [RUN_FILE, EPISODES_FILE, SUMMARY_FILE])
def test_a_folder_in_the_place_of_a_file_is_an_error(tmp_path: Path, name: str) -> None:
    (tmp_path / name).mkdir()
    with pytest.raises(UsageError, match=f"{name} is a folder where a file is needed; choose another --out"):
        EpisodeStore(tmp_path, RUN)
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_episodes_that_cannot_be_opened_are_an_error(tmp_path: Path) -> None:
    fill(tmp_path, range(1))
    (tmp_path / EPISODES_FILE).unlink()
    (tmp_path / EPISODES_FILE).symlink_to(tmp_path / "nowhere" / "file")
    with pytest.raises(UsageError, match=r"cannot use the results in .*No such file.*; choose another --out"):
        EpisodeStore(tmp_path, RUN)


@pytest.mark.parametrize("name", [RUN_FILE, EPISODES_FILE])
def test_a_file_without_permission_is_an_error(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    fill(tmp_path, range(1))
    real_open = Path.open

    def refuse(path: Path, *args: Any, **kwargs: Any) -> Any:  # root is refused nothing by a file's mode
        if path.name == name:
            raise PermissionError(13, "Permission denied", str(path))
        return real_open(path, *args, **kwargs)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", refuse)
        with pytest.raises(UsageError, match=rf"{name}.*; choose another --out"):
            EpisodeStore(tmp_path, RUN)
    assert stored_seeds(tmp_path) == [0]


def test_a_folder_that_cannot_be_made_is_an_error_and_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(UsageError, match="cannot write to the output folder"):
        make_folder(tmp_path / "file" / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_what_a_kill_left_half_written_is_removed_by_the_next_run_and_nothing_else(tmp_path: Path) -> None:
    fill(tmp_path, range(1))
    (tmp_path / "videos" / "deep").mkdir(parents=True)
    fill(tmp_path / "another", range(1))
    torn = unfinished_file(tmp_path / SUMMARY_FILE)
    below = unfinished_file(tmp_path / "videos" / "deep" / "a.mp4")
    others = unfinished_file(tmp_path / "another" / SUMMARY_FILE)
    mine = tmp_path / ".notes.tmp"
    for path in (torn, below, others, mine):
        path.write_bytes(b"half")
    assert stored_seeds(tmp_path) == [0]
    assert [path.exists() for path in (torn, below, others, mine)] == [False, False, True, True]


def test_a_folder_without_a_run_is_not_searched(tmp_path: Path) -> None:
    (tmp_path / "photos").mkdir()
    foreign = unfinished_file(tmp_path / "photos" / "a.jpg")
    foreign.write_bytes(b"half")
    with folder_lock(tmp_path):
        assert foreign.exists()
