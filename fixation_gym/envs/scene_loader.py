"""Writes a ``SceneSpec`` into the compiled model: shows, shapes, weighs and colours the pool parts it needs.

Every load starts from the fields as they were compiled, so a scene leaves nothing behind for the next one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from fixation_gym.envs.motion import Motion
from fixation_gym.envs.object_pool import SLOTS, TARGET_SHAPES, target_shape
from fixation_gym.envs.pool_slots import slots_for
from fixation_gym.envs.scene import ROOM, UNTINTED, ObstacleSpec, SceneSpec, TargetSpec
from fixation_gym.envs.scene_mjcf import (
    FINISH_MATERIALS,
    MIRROR_MATERIAL,
    RED_BODIES,
    UNSET_RGBA,
    VISIBLE_GROUP,
    mujoco_size,
    obstacle_part_name,
    quaternion,
    red_part_name,
)
from fixation_gym.envs.shapes import Part, Shape
from fixation_gym.types import FloatArray, Vector

_LABEL_RGBA = (0.85, 0.85, 0.25, 1.0)

_WRITTEN_FIELDS = (
    *("geom_type", "geom_size", "geom_pos", "geom_quat", "geom_rbound", "geom_aabb", "geom_group", "geom_contype"),
    *("geom_conaffinity", "geom_matid", "geom_rgba", "body_mass", "body_inertia", "body_ipos", "body_iquat"),
    *("body_gravcomp", "light_dir", "body_contype", "body_conaffinity"),
)
"""Fields of the model that a scene changes."""


@dataclass(frozen=True, eq=False)
class _PartGeom:
    """A part of the target or distractor as compiled."""

    geom: int
    size: FloatArray
    part: Part


class Placement(NamedTuple):
    """Where a body of the pool belongs."""

    position: Vector
    """Centre in base, m."""
    yaw: float
    motion: Motion | None


class SceneLoader:
    """Knows where the pool's parts are in one compiled model. ``model`` is an ``mjModel``."""

    def __init__(self, model: Any) -> None:
        """Index the pool of ``model``."""
        self._model = model
        self._red: dict[tuple[str, str], list[_PartGeom]] = {}
        for body in RED_BODIES:
            for shape in TARGET_SHAPES:
                geoms = [model.geom(red_part_name(body, shape, i)).id for i in range(len(shape.parts))]
                entries = zip(geoms, shape.parts, strict=True)
                self._red[body, shape.name] = [_PartGeom(g, model.geom_size[g].copy(), part) for g, part in entries]
        # Targets have parts of all primitives.
        red = [entry for entries in self._red.values() for entry in entries]
        self._types = {entry.part.primitive: int(model.geom_type[entry.geom]) for entry in red}
        self._slots = {
            f"obstacle{slot}": [model.geom(obstacle_part_name(f"obstacle{slot}", i)).id for i in range(parts)]
            for slot, parts in enumerate(SLOTS)
        }
        self._bodies = {name: model.body(name).id for name in [*RED_BODIES, *self._slots]}
        self._materials = {model.mat(i).name: i for i in range(model.nmat)}
        self._room = {name: model.geom(name).id for name in ROOM}
        pool = [entry.geom for entry in red]
        pool += [geom for geoms in self._slots.values() for geom in geoms]
        model.geom_contype[pool] = model.geom_conaffinity[pool] = 0
        bodies = list(self._bodies.values())
        model.body_contype[bodies] = model.body_conaffinity[bodies] = 0  # what its geoms have, together
        self._untouched = {name: getattr(model, name).copy() for name in _WRITTEN_FIELDS}

    def load(self, scene: SceneSpec) -> dict[str, Placement]:
        """Write the scene's shapes; returns where every body in use belongs, obstacles in the order of the scene."""
        model = self._model
        for name, values in self._untouched.items():
            getattr(model, name)[:] = values
        model.geom_matid[self._room["table_visual"]] = self._materials[scene.table_texture]
        for surface in scene.room:
            geom = self._room[surface.name]
            model.geom_rgba[geom] = surface.rgba
            if surface.texture is not None:
                model.geom_matid[geom] = self._materials[surface.texture]
        light = np.array(scene.light_direction)
        model.light_dir[:] = light / np.linalg.norm(light)
        placed = {"target": self._load_red("target", scene.target)}
        if scene.distractor is not None:
            placed["distractor"] = self._load_red("distractor", scene.distractor)
        for slot, obstacle in zip(slots_for(scene.obstacles), scene.obstacles, strict=True):
            self._load_obstacle(slot, obstacle)
            placed[slot] = Placement(obstacle.position, obstacle.yaw, obstacle.motion)
        return placed

    def _load_red(self, body: str, spec: TargetSpec) -> Placement:
        shape, factors = target_shape(spec.shape), np.array(spec.scale)
        for entry in self._red[body, spec.shape]:
            size = entry.size * _size_factors(entry.part, factors)
            self._show(entry.geom, entry.part, size, np.array(entry.part.pos) * factors)
            self._model.geom_rgba[entry.geom] = spec.rgba
            if spec.texture is not None:
                self._model.geom_matid[entry.geom] = self._materials[spec.texture]
        self._weigh(body, shape, factors)
        return Placement(spec.position, spec.yaw, spec.motion)

    def _load_obstacle(self, slot: str, obstacle: ObstacleSpec) -> None:
        model = self._model
        clear, paint = obstacle.rgba, (*obstacle.rgba[:3], 1.0)
        colours = {"solid": obstacle.tint, "rim": obstacle.frame_rgba, "label": _LABEL_RGBA, "lacquer": paint}
        colours |= dict.fromkeys(("glass", "cup", "water", "plastic"), clear) | dict.fromkeys(
            ("chrome", "brushed"), UNSET_RGBA
        )
        materials = {"solid": obstacle.texture, "mirror": MIRROR_MATERIAL} | {name: name for name in FINISH_MATERIALS}
        for geom, part in zip(self._slots[slot], obstacle.shape.parts, strict=False):
            model.geom_type[geom] = self._types[part.primitive]
            model.geom_quat[geom] = quaternion(part)
            size = np.zeros(3)
            size[: len(mujoco_size(part))] = mujoco_size(part)
            self._show(geom, part, size, np.array(part.pos))
            material = materials.get(part.finish)
            model.geom_matid[geom] = -1 if material is None else self._materials[material]
            model.geom_rgba[geom] = colours.get(part.finish, UNTINTED)
        self._weigh(slot, obstacle.shape, np.ones(3))

    def _show(self, geom: int, part: Part, size: FloatArray, position: FloatArray) -> None:
        model = self._model
        model.geom_group[geom] = VISIBLE_GROUP
        model.geom_contype[geom] = model.geom_conaffinity[geom] = 1
        model.geom_size[geom] = size
        model.geom_pos[geom] = position
        half = _half_extent(part, size)
        model.geom_rbound[geom] = _bounding_radius(part, half)
        model.geom_aabb[geom] = [0.0, 0.0, 0.0, *half]

    def _weigh(self, body: str, shape: Shape, factors: FloatArray) -> None:
        model, body_id = self._model, self._bodies[body]
        mass = shape.mass * float(np.prod(factors))
        centre, moments = _mass_moments(shape)
        moments = moments * factors**2
        model.body_mass[body_id] = mass
        model.body_ipos[body_id] = centre * factors
        model.body_iquat[body_id] = [1.0, 0.0, 0.0, 0.0]
        model.body_inertia[body_id] = mass * (moments.sum() - moments)
        model.body_gravcomp[body_id] = 0.0
        model.body_contype[body_id] = model.body_conaffinity[body_id] = 1


def _size_factors(part: Part, factors: FloatArray) -> FloatArray:
    """Factors for MuJoCo's size vector. Turned parts belong to shapes that are scaled uniformly."""
    if part.primitive == "cylinder":
        return np.array([factors[0], factors[2], 1.0])
    return factors


def _half_extent(part: Part, size: FloatArray) -> FloatArray:
    """Half sizes of the part's own axis-aligned box."""
    if part.primitive == "cylinder":
        return np.array([size[0], size[0], size[1]])
    return np.full(3, size[0]) if part.primitive == "sphere" else size.copy()


def _bounding_radius(part: Part, half: FloatArray) -> float:
    if part.primitive in ("sphere", "ellipsoid"):
        return float(half.max())
    if part.primitive == "cylinder":
        return math.hypot(half[0], half[2])
    return float(np.linalg.norm(half))


_VOLUME = {"box": 8.0, "cylinder": 2.0 * math.pi, "sphere": 4.0 / 3.0 * math.pi, "ellipsoid": 4.0 / 3.0 * math.pi}
_SPREAD = {
    "box": (1 / 3, 1 / 3, 1 / 3),
    "cylinder": (1 / 4, 1 / 4, 1 / 3),
    "sphere": (1 / 5,) * 3,
    "ellipsoid": (1 / 5,) * 3,
}
"""Mean square of x, y, z over a uniform solid, in units of its half sizes squared."""


def _mass_moments(shape: Shape) -> tuple[FloatArray, FloatArray]:
    """Centre of mass (3,) in m and mean squares (3,) about it in m^2 of the shape."""
    volumes = np.array([part.density * _VOLUME[part.primitive] * math.prod(part.size) for part in shape.parts])
    weights = volumes / volumes.sum()
    positions = np.array([part.pos for part in shape.parts])
    centre = weights @ positions
    spreads = np.array([_turned_spread(part) for part in shape.parts])
    return centre, weights @ (spreads + (positions - centre) ** 2)


def _turned_spread(part: Part) -> FloatArray:
    """Mean squares of one part along the shape's axes."""
    return part.rotation**2 @ (np.array(part.size) ** 2 * _SPREAD[part.primitive])
