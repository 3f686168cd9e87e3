"""Figure and videos of the hard scenes: camera view, flow, both rules' maps and the truth."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np

from fixation_gym.envs.config import CONTROL_FREQUENCY
from fixation_gym.evaluation.video import VideoWriter, caption
from fixation_gym.experiments.scenarios.rig import Look, ScenarioRig
from fixation_gym.experiments.scenarios.scores import PixelTruth, calls, pixel_truth
from fixation_gym.perception import draw_overlay
from fixation_gym.perception.drawing import BEHIND_RGB, FRONT_RGB, MOVING_RGB
from fixation_gym.perception.zero_flow.answering_pixels import answering_pixels
from fixation_gym.types import FloatArray, ImageArray, MaskArray

ROWS = ("camera", "flow", "paper's rule", "exact", "truth")
TITLES = {
    "opaque": "opaque, front and behind",
    "see_through": "see-through, in the line of sight",
    "mirror": "mirror in front",
    "reflection": "reflection of an obstacle",
    "glass": "what bends light, in the line of sight",
    "chrome": "curved mirrors in front",
}
_PICTURE_S = 1.3
"""Time of the pictures in the figure, s."""
_GREY = (60, 60, 60)
_FASTEST = 25.0
"""Image speed that is drawn in full colour, px of the flow grid per s."""


def film(
    rig: ScenarioRig, examples: Mapping[str, np.random.Generator], videos: Mapping[str, Path], figure: Path
) -> None:
    """Write a video of a lateral instance of every scene, and the figure.

    Args:
        rig: to look with.
        examples: generator of the instance, by scene.
        videos: file of the video, by scene.
        figure: file of the figure.
    """
    columns = {scene: _film_scene(rig, scene, rng, videos[scene]) for scene, rng in examples.items()}
    draw_figure(figure, columns)


def _film_scene(rig: ScenarioRig, scene: str, rng: np.random.Generator, path: Path) -> list[ImageArray]:
    """Write the video of an instance and return its pictures for the figure."""
    instance = rig.draw(scene, "lateral", rng)
    kept: list[ImageArray] = []
    with VideoWriter(path, CONTROL_FREQUENCY) as video:
        for look in rig.run(instance, rng):
            answers = pixel_truth(rig, instance, rig.truth(look), look.target_depth)
            pictures = panels(look, answers)
            video.add(_video_frame(look, pictures))
            if look.time <= _PICTURE_S:
                kept = pictures
    return kept


def panels(look: Look, answers: PixelTruth) -> list[ImageArray]:
    """Pictures of one look in the order of ``ROWS``, each of shape (H, W, 3)."""
    size = (look.image.shape[1], look.image.shape[0])
    called, known = calls(look), answering_pixels(look.percept.zfc, look.image)
    maps = [sides(known & called[rule], known & ~called[rule]) for rule in ("paper", "exact")]
    maps[1][look.percept.zfc.moving] = MOVING_RGB
    small = [flow_colours(look.percept.flow.flow), *maps, sides(answers.side > 0.0, answers.side < 0.0)]
    enlarged = [np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_NEAREST), np.uint8) for image in small]
    return [look.image, *enlarged]


def sides(front: MaskArray, behind: MaskArray) -> ImageArray:
    """Orange in front, blue behind, grey where nothing is said; shape (h, w, 3)."""
    image = np.full((*front.shape, 3), _GREY, np.uint8)
    image[front], image[behind] = FRONT_RGB, BEHIND_RGB
    return image


def flow_colours(flow: FloatArray) -> ImageArray:
    """Direction as hue and speed as saturation, shape (h, w, 3), of flow of shape (h, w, 2) in px/s."""
    x, y = np.nan_to_num(flow[..., 0]), np.nan_to_num(flow[..., 1])
    hue = (np.degrees(np.arctan2(y, x)) % 360.0) / 2.0
    strength = np.clip(np.hypot(x, y) / _FASTEST, 0.0, 1.0) * 255.0
    hsv = np.stack([hue, strength, np.full_like(hue, 235.0)], axis=-1).astype(np.uint8)
    return np.asarray(cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB), np.uint8)


def _video_frame(look: Look, pictures: list[ImageArray]) -> ImageArray:
    """What perception draws beside flow, maps and truth."""
    overlay = caption(draw_overlay(look.image, look.percept), f"{look.time:.2f} s")
    named = [caption(image, name) for image, name in zip(pictures[1:], ROWS[1:], strict=True)]
    blank = np.full_like(overlay, 24)
    return np.vstack([np.hstack([overlay, *named[:2]]), np.hstack([blank, named[2], named[3]])])


def draw_figure(path: Path, columns: Mapping[str, list[ImageArray]]) -> None:
    """Write the figure: a column per scene, a row per kind of picture."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.2 * len(columns), 2.4 * len(ROWS) + 0.6), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(ROWS), len(columns), squeeze=False)
    for column, (scene, pictures) in enumerate(columns.items()):
        for row, picture in enumerate(pictures):
            axis = axes[row, column]
            axis.imshow(picture)
            axis.set(xticks=[], yticks=[])
            if row == 0:
                axis.set_title(TITLES[scene])
            if column == 0:
                axis.set_ylabel(ROWS[row])
    figure.supxlabel("orange: nearer than the red object; blue: farther; magenta: moves by itself; grey: unknown")
    figure.savefig(path, dpi=100)
