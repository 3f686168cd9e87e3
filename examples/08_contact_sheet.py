"""Many scenes on one sheet, seen from the front: ``08_contact_sheet.py scenes.jpg``, or three of each that is named."""

import sys
from collections.abc import Sequence
from pathlib import Path

import cv2
import gymnasium as gym
import numpy as np

import fixation_gym  # noqa: F401

SCENARIOS = ("opaque", "translucent", "mirror", "line_of_sight", "moving_obstacle", "mixed", "screen", "shelf", "bin")
SCENARIOS += ("clutter", "discovery")
TILE = (240, 180)


def sheet(scenarios: Sequence[str], scenes: int, seed: int = 0) -> np.ndarray:
    """One row of scenes for each scenario, shape (rows, columns, 3), uint8 RGB."""
    rows = []
    for name in scenarios:
        env = gym.make("FixationPick-v0", scenario=name, render_mode="rgb_array", render_view="front")
        tiles = []
        for index in range(scenes):
            env.reset(seed=seed + index)
            picture = np.asarray(env.render())
            height, width = picture.shape[:2]
            table = picture[height // 7 : -height // 7, width // 5 : -width // 12]
            tile = cv2.resize(table, TILE, interpolation=cv2.INTER_AREA)
            cv2.putText(tile, name, (6, 18), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (255, 255, 255), 1, cv2.LINE_AA)
            tiles.append(tile)
        env.close()
        rows.append(np.hstack(tiles))
    return np.vstack(rows)


def main(path: str = "scenes.jpg", scenarios: Sequence[str] = SCENARIOS, scenes: int = 5) -> Path:
    """Write the sheet; returns its path."""
    file = Path(path)
    if file.suffix not in (".jpg", ".png") or not file.parent.is_dir():
        raise SystemExit(f"{path} cannot be written; give the name of a .jpg or .png file in a folder that exists")
    if not cv2.imwrite(path, cv2.cvtColor(sheet(scenarios, scenes), cv2.COLOR_RGB2BGR)):
        raise SystemExit(f"{path} could not be written")
    return file


if __name__ == "__main__":
    sheet_path, *names = sys.argv[1:] or ["scenes.jpg"]
    print(main(sheet_path, names, scenes=3) if names else main(sheet_path))
