"""What the depth camera says of the first pictures of episodes, by material: holes, the surface, something else.

python scripts/depth_camera_stills.py --renderer mitsuba --episodes 4 --picture docs/images/depth_camera.jpg

Truth is the first surface that the simulator renders, glass and mirrors too. Prints a table with 95 % intervals.
"""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import gymnasium
import numpy as np
import tyro
from measure_front_rules import MATERIALS, in_words, materials

import fixation_gym  # noqa: F401  # registers the environments
from fixation_gym.envs.truth_view import TruthView
from fixation_gym.evaluation.config import episode_seeds
from fixation_gym.evaluation.workers import prepare_process
from fixation_gym.experiments.scenarios.statistics import bootstrap_ratio
from fixation_gym.types import FloatArray, ImageArray

ANSWERS = ("hole", "its surface", "behind it", "before it")
_NEAR, _FAR = 0.2, 1.0
"""Depths at the ends of the colours in the picture, m."""
_SAME = 0.05
"""A depth is that of the surface if it is off by less than this share."""


@dataclass(frozen=True)
class Config:
    """What to look at."""

    renderer: str = "mujoco"
    scenarios: tuple[str, ...] = ("translucent", "mirror", "glass", "chrome", "two_mirrors")
    episodes: int = 10
    seed: int = 22022
    picture: Path | None = None
    """File for a picture of the last scene of every scenario: camera, true depth, measured depth."""


def main(config: Config) -> None:
    """Measure, print and draw."""
    prepare_process()
    totals: dict[tuple[str, str], list[tuple[float, float]]] = {}
    drawn: list[ImageArray] = []
    seeds = episode_seeds(config.seed, config.episodes)
    for scenario in config.scenarios:
        env = gymnasium.make("FixationPick-v0", scenario=scenario, renderer=config.renderer, depth_camera=True)
        base: Any = env.unwrapped
        for seed in seeds:
            seen = env.reset(seed=seed)[0]
            with closing(TruthView(base.model, base.intrinsics)) as view:
                truth = view.look(base.picture_qpos)
            kinds, depth = materials(truth, base.model), seen["depth"]
            for kind in (*MATERIALS, "free"):
                for answer, mask in zip(ANSWERS, _answers(depth, truth.depth), strict=True):
                    pair = int(np.count_nonzero(kinds[kind] & mask)), int(np.count_nonzero(kinds[kind]))
                    totals.setdefault((kind, answer), []).append(pair)
            if seed == seeds[-1]:
                drawn.append(np.hstack([seen["rgb"], coloured(truth.depth), coloured(depth)]))
        env.close()
    print("| surface | pixels | " + " | ".join(ANSWERS) + " |")
    print("|---" * (2 + len(ANSWERS)) + "|")
    for kind in (*MATERIALS, "free"):
        shares = " | ".join(in_words(*bootstrap_ratio(totals[kind, answer])) for answer in ANSWERS)
        print(f"| {kind} | {sum(whole for _, whole in totals[kind, ANSWERS[0]])} | {shares} |")
    if config.picture is not None:
        cv2.imwrite(str(config.picture), np.vstack(drawn)[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 85])


def _answers(depth: FloatArray, surface: FloatArray) -> tuple[np.ndarray, ...]:
    """Pixels with each of ``ANSWERS``."""
    known = depth > 0
    off = np.where(known, depth, surface) / surface - 1.0
    return ~known, known & (np.abs(off) <= _SAME), off > _SAME, off < -_SAME


def coloured(depth: FloatArray) -> ImageArray:
    """Depth as colours, shape (h, w, 3), RGB: red is near, blue far, black a hole."""
    level = np.clip((_FAR - depth) / (_FAR - _NEAR), 0.0, 1.0)
    colours = cv2.applyColorMap((255.0 * level).astype(np.uint8), cv2.COLORMAP_TURBO)[..., ::-1]
    return np.where((depth > 0)[..., None], colours, 0).astype(np.uint8)


if __name__ == "__main__":
    main(tyro.cli(Config, description=__doc__))
