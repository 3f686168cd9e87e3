"""The file ``camera.json``: K, size and lens of a camera."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, cast

from fixation_gym.errors import UsageError
from fixation_gym.geometry.camera import LENS_MODELS, Intrinsics, Lens, LensModel

_NUMBERS = ("fx", "fy", "cx", "cy")


def read_json(path: Path) -> dict[str, Any]:
    """A JSON object.

    Raises:
        UsageError: if there is none.
    """
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise UsageError(f"{path} is missing") from None
    except (OSError, ValueError) as error:
        raise UsageError(f"{path} cannot be read: {error}") from error
    if not isinstance(value, dict):
        raise UsageError(f"{path} must hold a JSON object")
    return value


def read_camera(path: Path) -> Intrinsics:
    """The camera that a file describes; further keys are notes.

    Raises:
        UsageError: naming file and key.
    """
    values = read_json(path)
    for key in ("width", "height", *_NUMBERS):
        value = values.get(key)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
            raise UsageError(f"{path} needs a number as '{key}', got {value!r}")
    readout_s = values.get("readout_s", 0.0)
    if isinstance(readout_s, bool) or not isinstance(readout_s, (int, float)):
        raise UsageError(f"{path} needs a number as 'readout_s', got {readout_s!r}")
    lens = _lens(path, values.get("distortion", []), values.get("distortion_model", LENS_MODELS[0]))
    try:
        fx, fy, cx, cy = (float(values[key]) for key in _NUMBERS)
        return Intrinsics(int(values["width"]), int(values["height"]), fx, fy, cx, cy, lens, float(readout_s))
    except ValueError as error:
        raise UsageError(f"{path}: {error}") from error


def _lens(path: Path, coefficients: Any, model: Any) -> Lens | None:
    numbers = coefficients if isinstance(coefficients, list) else [coefficients]
    if not all(isinstance(c, (int, float)) for c in numbers):
        raise UsageError(f"{path} needs a list of numbers as 'distortion', got {coefficients!r}")
    try:
        return lens_of(numbers, model)
    except ValueError as error:
        raise UsageError(f"{path}, 'distortion': {error}") from error


def lens_of(coefficients: list[float], model: str) -> Lens | None:
    """A lens; None if none of the coefficients differs from 0.

    Raises:
        ValueError: if there is no such lens.
    """
    if model in LENS_MODELS and not any(coefficients):
        return None
    return Lens(tuple(map(float, coefficients)), cast(LensModel, model))


def camera_values(camera: Intrinsics) -> dict[str, Any]:
    """A camera as ``camera.json`` holds it; numbers keep all their digits."""
    lens = camera.lens
    return {
        "width": camera.width,
        "height": camera.height,
        **{key: getattr(camera, key) for key in _NUMBERS},
        "distortion": [] if lens is None else list(lens.coefficients),
        "distortion_model": LENS_MODELS[0] if lens is None else lens.model,
        "readout_s": camera.readout_s,
    }
