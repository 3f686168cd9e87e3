"""What is in a result folder, without what may differ from run to run: times, paths, and how often it was resumed."""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path
from typing import Any

_MAY_DIFFER = ("wall_s", "wall_ms", "seconds", "perception_ms", "folder", "recording")
_MAY_DIFFER += ("episodes_resumed", "sequences_resumed", "runs_resumed", "pictures_resumed")
_NOT_REPEATABLE = ("tensorboard", "checkpoint-")
"""Training goes on from its last checkpoint with other scenes: what it learned differs, how far it came does not."""
_TRAINED = ("best.zip", "cells.jsonl")
"""What is in the folders of such runs."""


def content(folder: Path) -> dict[str, Any]:
    """By file, relative to the folder: values of JSON, sorted lines of JSON lines, else a digest.

    Raises:
        ValueError: if a line is there twice.
    """
    trained = any((folder / name).exists() for name in _TRAINED)
    return {
        str(path.relative_to(folder)): _content(path, trained)
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not any(part.startswith(_NOT_REPEATABLE) for part in path.relative_to(folder).parts)
    }


def differences(reference: dict[str, Any], other: dict[str, Any]) -> list[str]:
    """What another folder lacks, has in addition, or has differently."""
    lacking = [f"lacks {name}" for name in reference if name not in other]
    more = [f"has {name}" for name in other if name not in reference]
    return lacking + more + [f"other {name}" for name in reference if name in other and other[name] != reference[name]]


def _content(path: Path, trained: bool) -> Any:
    data = path.read_bytes()
    if path.suffix == ".jsonl":
        lines = data.decode().splitlines()
        if len(set(lines)) != len(lines):
            raise ValueError(f"{path} has a line twice")
        return len(lines) if trained else sorted(json.dumps(_stable(json.loads(line))) for line in lines)
    if path.suffix == ".json":
        value = json.loads(data)
        return _progress(value) if trained else _stable(value)
    if path.suffix == ".html":
        return hashlib.sha256(re.sub(rb"[\d.]+ (s|min)(, \d+ of \d+ before)?</td>", b"", data)).hexdigest()
    return len(data) > 0 if trained else hashlib.sha256(data).hexdigest()


def _stable(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _stable(item) for key, item in value.items() if key not in _MAY_DIFFER}
    return [_stable(item) for item in value] if isinstance(value, list) else value


def _progress(value: dict[str, Any]) -> dict[str, Any]:
    """Of a training run or a comparison: how far it came."""
    decisions = [entry["decisions"] for entry in value.get("curve", [])]
    return {"decisions": value.get("decisions"), "curve": decisions, "runs": len(value.get("runs", []))}
