"""Tables of numbers in text files; what is wrong with one is said in a sentence that names file, line and column."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fixation_gym.errors import UsageError


@dataclass(frozen=True, slots=True)
class Row:
    """One line of a table."""

    place: str
    """File and line, for messages."""
    cells: Mapping[str, str]
    """Text by the name of the column."""

    def number(self, column: str) -> float:
        """A finite number.

        Raises:
            UsageError: if there is none.
        """
        text = self.cells[column]
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise UsageError(f"{self.place}, column '{column}': '{text}' is not a number")
        return value

    def numbers(self, columns: Sequence[str]) -> list[float] | None:
        """Finite numbers; None if all cells are empty.

        Raises:
            UsageError: if some are no numbers.
        """
        if not any(self.cells[column] for column in columns):
            return None
        return [self.number(column) for column in columns]


def read_table(path: Path, needed: Sequence[str]) -> list[Row]:
    """Read a CSV file whose first line names the columns.

    Args:
        path: of the file.
        needed: columns that it must have.

    Raises:
        UsageError: if it cannot be read, is empty, or lacks a column.
    """
    lines = _lines(path)
    table = csv.reader(lines)
    header = [name.strip() for name in next(table, [])]
    missing = [name for name in needed if name not in header]
    if missing:
        raise UsageError(f"{path} has no column '{missing[0]}'; it needs {', '.join(needed)}")
    rows = []
    for cells in table:
        place = f"{path}, line {table.line_num}"
        if not cells:
            continue
        if len(cells) != len(header):
            raise UsageError(f"{place} has {len(cells)} cells, but there are {len(header)} columns")
        rows.append(Row(place, dict(zip(header, (cell.strip() for cell in cells), strict=True))))
    if not rows:
        raise UsageError(f"{path} has no rows")
    return rows


def read_plain(path: Path, columns: Sequence[str]) -> list[Row]:
    """Read lines of words between blanks or commas, without a header; those that begin with # are comments.

    Raises:
        UsageError: if it cannot be read, is empty, or a line has too few words.
    """
    rows = []
    for number, line in enumerate(_lines(path), start=1):
        words = line.replace(",", " ").split()
        if not words or words[0].startswith("#"):
            continue
        place = f"{path}, line {number}"
        if len(words) < len(columns):
            raise UsageError(f"{place} lacks '{columns[len(words)]}'; it needs {' '.join(columns)}")
        rows.append(Row(place, dict(zip(columns, words, strict=False))))
    if not rows:
        raise UsageError(f"{path} has no rows")
    return rows


def has_header(path: Path) -> bool:
    """Whether the first line of a file names columns: its first word is no number.

    Raises:
        UsageError: if the file cannot be read.
    """
    words = next((line for line in _lines(path) if line.strip()), "0").replace(",", " ").split()
    try:
        float(words[0])
    except ValueError:
        return not words[0].startswith("#")
    return False


def _lines(path: Path) -> list[str]:
    try:
        return path.read_text(encoding="utf-8-sig").splitlines()
    except FileNotFoundError:
        raise UsageError(f"{path} is missing") from None
    except (OSError, ValueError) as error:
        raise UsageError(f"{path} cannot be read: {error}") from error
