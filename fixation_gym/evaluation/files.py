"""Files that have their old or their new content, but never half of it."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

UNFINISHED = ".unfinished"
"""How the names of files end that are being written, or were when their process was killed."""


def unfinished_file(path: Path) -> Path:
    """Where this process writes a file before it gets its name; what a kill leaves is removed by the next run."""
    return path.with_name(f".{path.name}.{os.getpid()}{UNFINISHED}")


def write_file(path: Path, data: bytes) -> None:
    """Write a file, completely or not at all; it is on the disk when this returns.

    Raises:
        OSError: if it cannot be written.
    """
    temporary = unfinished_file(path)
    try:
        with temporary.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def write_json(path: Path, value: Any) -> None:
    """Write a JSON-able value without NaN or infinity.

    Raises:
        OSError: if it cannot be written.
        ValueError: for NaN or infinity.
    """
    write_file(path, f"{json.dumps(value, indent=2, allow_nan=False)}\n".encode())


def write_csv(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write a table whose columns are the keys of all rows; lists have blanks between their items.

    Raises:
        OSError: if it cannot be written.
    """
    text = io.StringIO()
    writer = csv.DictWriter(text, list(dict.fromkeys(name for row in rows for name in row)), lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({k: " ".join(map(str, v)) if isinstance(v, (list, tuple)) else v for k, v in row.items()})
    write_file(path, text.getvalue().encode())
