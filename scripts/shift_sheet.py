"""The picture of the page on transfer: what every shift looks like. ``python scripts/shift_sheet.py``."""

from __future__ import annotations

from pathlib import Path

import cv2
import gymnasium as gym
import numpy as np

import fixation_gym  # noqa: F401
from fixation_gym.experiments.transfer.shifts import AXES, NONE, SEVERITIES, Shift, shift
from fixation_gym.types import ImageArray

_SEED = 100_001
_TILE = (160, 120)
_COLUMNS = 2


def tile(chosen: Shift) -> ImageArray:
    """The first picture of one scene under a shift, with its name above, shape (120, 160, 3)."""
    env = gym.make("FixationPick-v0", **chosen.arguments("opaque"))
    picture = env.reset(seed=_SEED)[0]["rgb"]
    env.close()
    small = np.ascontiguousarray(cv2.resize(picture, _TILE, interpolation=cv2.INTER_AREA))
    small[:14] = 0
    cv2.putText(small, chosen.name, (3, 11), cv2.FONT_HERSHEY_SIMPLEX, 0.34, (255, 255, 255), 1, cv2.LINE_AA)
    return small


def main(path: Path = Path("docs/images/shifts.jpg")) -> None:
    """Write the sheet: an axis takes four tiles, no shift and its three severities."""
    plain = tile(Shift(NONE, NONE))
    rows = [np.hstack([plain, *(tile(shift(axis, severity)) for severity in SEVERITIES)]) for axis in AXES]
    sheet = np.vstack([np.hstack(rows[start : start + _COLUMNS]) for start in range(0, len(rows), _COLUMNS)])
    cv2.imwrite(str(path), sheet[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 80])


if __name__ == "__main__":
    main()
