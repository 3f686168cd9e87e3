"""Files that are written completely or not at all."""

import csv
import json
import os
from pathlib import Path

import pytest

from fixation_gym.evaluation.files import write_csv, write_file, write_json


def test_a_failed_write_keeps_the_old_file_and_leaves_no_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "summary.json"
    write_json(path, {"a": 1})
    with pytest.raises(ValueError, match="JSON"):
        write_json(path, {"a": float("nan")})

    def fail(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(OSError, match="No space left"):
        write_file(path, b"new")
    assert json.loads(path.read_text()) == {"a": 1}
    assert list(tmp_path.iterdir()) == [path]


def test_a_table_has_the_columns_of_all_rows_and_blanks_in_lists(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    write_csv(path, [{"a": 1, "b": [1, 2]}, {"a": 2.5, "c": None}])
    assert path.read_text() == "a,b,c\n1,1 2,\n2.5,,\n"
    with path.open() as file:
        assert [row["a"] for row in csv.DictReader(file)] == ["1", "2.5"]
    write_csv(path, [])
    assert path.read_text().strip() == ""
