"""How scenes look where they do not look as usual: colours and textures alone, from a generator of their own.

Nothing else of a scene depends on them: with equal seeds the same things stand in the same places.
"""

from __future__ import annotations

import colorsys
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from fixation_gym.envs.placement import OBSTACLE_TEXTURES
from fixation_gym.envs.scene import ROOM, RoomSurface, SceneSpec, TargetSpec

if TYPE_CHECKING:
    from fixation_gym.envs.config import Scenario

Rgba = tuple[float, float, float, float]

PLAIN_TEXTURE = "wood_plain"
"""Shows one colour."""
TABLE_TEXTURES = ("table_wood", "table_plank", "table_felt")
_POSTER_TEXTURES = ("poster_metal", "poster_earth", "poster_bricks", "poster_tiles")
_TARGET_TEXTURES = ("bricks", "wood_light", "metal")
"""Textures of targets of any colour."""
_HUES = (1.0 / 8.0, 7.0 / 8.0)
"""Range of hues, 0..1: anything but the target's red."""
_TINTS = (1.0 / 6.0, 2.0 / 3.0)
"""The same of tints, from yellow to blue: they have no more red than green, so no texture gets redder than it is."""
_SATURATION = {"tinted": (0.2, 0.5), "coloured": (0.6, 1.0), "plain": (0.6, 1.0)}
"""Range of the saturation of colours, by look; equal seeds draw the same hues for each."""
_BRIGHTNESS = (0.4, 1.0)
_TABLE_BRIGHTNESS = 0.7
"""A white table saturates the image."""


def dressed(scenario: Scenario, scene: SceneSpec, rng: np.random.Generator) -> SceneSpec:
    """The scene in the colours and textures of its scenario; ``rng`` is only asked for generators of their own."""
    if scenario.coloured_frames:
        scene = _with_coloured_frames(scene, rng.spawn(1)[0])
    elif scenario.any_colour:
        scene = _with_any_colours(scene, rng.spawn(1)[0])
    if scenario.obstacle_looks != "usual":
        scene = _with_obstacle_looks(scene, scenario.obstacle_looks, rng.spawn(1)[0])
    if scenario.room_looks != "usual":
        scene = _with_room_looks(scene, scenario.room_looks, rng.spawn(1)[0])
    if scenario.target_hue_deg:
        scene = _with_target_hue(scene, scenario.target_hue_deg, rng.spawn(1)[0])
    return scene


def _with_obstacle_looks(scene: SceneSpec, looks: str, rng: np.random.Generator) -> SceneSpec:
    """Obstacles and their frames in drawn colours; "coloured" and "plain" ones have other textures, too."""
    obstacles = []
    for obstacle in scene.obstacles:
        tint, frame = _colour(looks, rng), _colour(looks, rng)
        texture = str(rng.choice(OBSTACLE_TEXTURES))
        texture = {"tinted": obstacle.texture, "coloured": texture, "plain": PLAIN_TEXTURE}[looks]
        obstacles.append(replace(obstacle, tint=tint, frame_rgba=frame, texture=texture))
    return replace(scene, obstacles=tuple(obstacles))


def _with_room_looks(scene: SceneSpec, looks: str, rng: np.random.Generator) -> SceneSpec:
    """Table, sheets, boards, floor and walls in drawn colours; "coloured" and "plain" ones have other textures, too."""
    surfaces = []
    for name in ROOM:
        table = name == ROOM[0]
        red, green, blue, _ = _colour(looks, rng)
        factor = _TABLE_BRIGHTNESS if table else 1.0
        texture = str(rng.choice(TABLE_TEXTURES if table else _POSTER_TEXTURES))
        texture = {"tinted": scene.table_texture if table else None, "coloured": texture, "plain": PLAIN_TEXTURE}[looks]
        surfaces.append(RoomSurface(name, (factor * red, factor * green, factor * blue, 1.0), texture))
    return replace(scene, room=tuple(surfaces))


def _with_target_hue(scene: SceneSpec, degrees: float, rng: np.random.Generator) -> SceneSpec:
    """Target and distractor with their hue turned, to either side."""
    turn = degrees / 360.0 * float(rng.choice((-1.0, 1.0)))
    distractor = None if scene.distractor is None else _turned(scene.distractor, turn)
    return replace(scene, target=_turned(scene.target, turn), distractor=distractor)


def _turned(spec: TargetSpec, turn: float) -> TargetSpec:
    hue, saturation, value = colorsys.rgb_to_hsv(*spec.rgba[:3])
    red, green, blue = colorsys.hsv_to_rgb((hue + turn) % 1.0, saturation, value)
    return replace(spec, rgba=(red, green, blue, spec.rgba[3]))


def _colour(looks: str, rng: np.random.Generator) -> Rgba:
    low, high = _SATURATION[looks]
    hue, saturation = float(rng.uniform(*_TINTS)), low + (high - low) * float(rng.uniform())
    red, green, blue = colorsys.hsv_to_rgb(hue, saturation, float(rng.uniform(*_BRIGHTNESS)))
    return red, green, blue, 1.0


def _with_coloured_frames(scene: SceneSpec, rng: np.random.Generator) -> SceneSpec:
    obstacles = []
    for obstacle in scene.obstacles:
        red, green, blue = colorsys.hsv_to_rgb(rng.uniform(*_HUES), rng.uniform(0.0, 1.0), rng.uniform(0.1, 1.0))
        obstacles.append(replace(obstacle, frame_rgba=(red, green, blue, 1.0)))
    return replace(scene, obstacles=tuple(obstacles))


def _with_any_colours(scene: SceneSpec, rng: np.random.Generator) -> SceneSpec:
    """Targets and obstacles of any colour, half of them textured; a distractor does not look like the target."""
    hue = float(rng.uniform(0.0, 1.0))
    target, distractor = _any_look(scene.target, hue, rng), scene.distractor
    if distractor is not None:
        distractor = _any_look(distractor, (hue + float(rng.uniform(0.2, 0.8))) % 1.0, rng)
    obstacles = tuple(
        replace(
            obstacle,
            tint=_any_colour(float(rng.uniform(0.0, 1.0)), rng),
            frame_rgba=_any_colour(float(rng.uniform(0.0, 1.0)), rng),
        )
        for obstacle in scene.obstacles
    )
    return replace(scene, target=target, distractor=distractor, obstacles=obstacles)


def _any_look(spec: TargetSpec, hue: float, rng: np.random.Generator) -> TargetSpec:
    texture = str(rng.choice(_TARGET_TEXTURES)) if rng.random() < 0.5 else None
    return replace(spec, rgba=_any_colour(hue, rng), texture=texture)


def _any_colour(hue: float, rng: np.random.Generator) -> Rgba:
    red, green, blue = colorsys.hsv_to_rgb(hue, rng.uniform(0.4, 1.0), rng.uniform(0.3, 1.0))
    return red, green, blue, 1.0
