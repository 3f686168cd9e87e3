"""Writes a ``SceneSpec`` into the compiled model: shows, scales, weighs and colours the pool parts it needs.

Every load starts from the fields as they were compiled, so a scene leaves nothing behind for the next one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from fixation_gym.envs.motion import Motion
from fixation_gym.envs.object_pool import OBSTACLE_SHAPES, TARGET_SHAPES, Part, Shape, Vector, target_shape
from fixation_gym.envs.scene import ObstacleSpec, SceneSpec, TargetSpec
from fixation_gym.envs.scene_mjcf import HIDDEN_GROUP, RED_BODIES, VISIBLE_GROUP, part_name
from fixation_gym.types import FloatArray

TARGET_RGBA = (0.80, 0.06, 0.05, 1.0)
_LABEL_RGBA = (0.85, 0.85, 0.25, 1.0)
_UNTINTED = (1.0, 1.0, 1.0, 1.0)


_WRITTEN_FIELDS = (
    *("geom_size", "geom_pos", "geom_rbound", "geom_aabb", "geom_group", "geom_contype", "geom_conaffinity"),
    *("geom_matid", "geom_rgba", "body_mass", "body_inertia", "body_ipos", "body_iquat", "body_gravcomp", "light_dir"),
    *("body_contype", "body_conaffinity"),
)
"""Fields of the model that a scene changes."""


@dataclass(frozen=True, eq=False)
class _PartGeom:
    geom: int
    size: FloatArray
    pos: FloatArray
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
        obstacle_shapes = [(kind, shape) for kind, shapes in OBSTACLE_SHAPES.items() for shape in shapes]
        geom_names = {model.geom(i).name: i for i in range(model.ngeom)}
        self._parts: dict[tuple[str, str], list[_PartGeom]] = {}
        slots = sorted({model.body(i).name for i in range(model.nbody) if model.body(i).name.startswith("obstacle")})
        red = [(body, TARGET_SHAPES) for body in RED_BODIES]
        for body, shapes in [*red, *((slot, [s for _, s in obstacle_shapes]) for slot in slots)]:
            for shape in shapes:
                names = [part_name(body, shape, i) for i in range(len(shape.parts))]
                if names[0] in geom_names:
                    self._parts[body, shape.name] = [
                        _PartGeom(geom_names[name], model.geom_size[geom_names[name]].copy(), np.array(part.pos), part)
                        for name, part in zip(names, shape.parts, strict=True)
                    ]
        self._slots = slots
        self._bodies = {name: model.body(name).id for name in [*RED_BODIES, *slots]}
        self._materials = {model.mat(i).name: i for i in range(model.nmat)}
        self._mirror_slot = next(body for body, shape in self._parts if shape == "mirror")
        self._table_geom = model.geom("table_visual").id
        pool = [entry.geom for parts in self._parts.values() for entry in parts]
        model.geom_contype[pool] = model.geom_conaffinity[pool] = 0
        bodies = list(self._bodies.values())
        model.body_contype[bodies] = model.body_conaffinity[bodies] = 0  # what its geoms have, together
        self._untouched = {name: getattr(model, name).copy() for name in _WRITTEN_FIELDS}

    def load(self, scene: SceneSpec) -> dict[str, Placement]:
        """Write the scene's shapes; returns where every body in use belongs."""
        model = self._model
        for name, values in self._untouched.items():
            getattr(model, name)[:] = values
        model.geom_matid[self._table_geom] = self._materials[scene.table_texture]
        light = np.array(scene.light_direction)
        model.light_dir[:] = light / np.linalg.norm(light)
        placed = {"target": self._load_red("target", scene.target)}
        if scene.distractor is not None:
            placed["distractor"] = self._load_red("distractor", scene.distractor)
        for slot, obstacle in self._assign_slots(scene.obstacles):
            shape = next(s for s in OBSTACLE_SHAPES[obstacle.kind] if s.name == obstacle.shape)
            self._show(slot, shape, (obstacle.scale, obstacle.scale, obstacle.scale))
            self._dress(slot, obstacle)
            placed[slot] = Placement(obstacle.position, obstacle.yaw, obstacle.motion)
        return placed

    def _load_red(self, body: str, spec: TargetSpec) -> Placement:
        self._show(body, target_shape(spec.shape), spec.scale)
        for entry in self._parts[body, spec.shape]:
            self._model.geom_rgba[entry.geom] = TARGET_RGBA
        return Placement(spec.position, spec.yaw, spec.motion)

    def _assign_slots(self, obstacles: tuple[ObstacleSpec, ...]) -> list[tuple[str, ObstacleSpec]]:
        """The mirror takes the one slot that has a mirror; the others fill the slots in order."""
        free = list(self._slots)
        pairs = []
        for obstacle in sorted(obstacles, key=lambda item: item.kind != "mirror"):
            slot = self._mirror_slot if obstacle.kind == "mirror" else free[0]
            free.remove(slot)
            pairs.append((slot, obstacle))
        return pairs

    def _show(self, body: str, shape: Shape, scale: Vector) -> None:
        model, body_id = self._model, self._bodies[body]
        factors = np.array(scale)
        for entry in self._parts[body, shape.name]:
            geom = entry.geom
            model.geom_group[geom] = VISIBLE_GROUP
            model.geom_contype[geom] = model.geom_conaffinity[geom] = 1
            model.geom_size[geom] = entry.size * _size_factors(entry.part, factors)
            model.geom_pos[geom] = entry.pos * factors
            half = _half_extent(entry.part, model.geom_size[geom])
            model.geom_rbound[geom] = _bounding_radius(entry.part, half)
            model.geom_aabb[geom] = [0.0, 0.0, 0.0, *half]
        mass = shape.mass * float(np.prod(factors))
        centre, moments = _mass_moments(shape)
        moments = moments * factors**2
        model.body_mass[body_id] = mass
        model.body_ipos[body_id] = centre * factors
        model.body_iquat[body_id] = [1.0, 0.0, 0.0, 0.0]
        model.body_inertia[body_id] = mass * (moments.sum() - moments)
        model.body_gravcomp[body_id] = 0.0
        model.body_contype[body_id] = model.body_conaffinity[body_id] = 1

    def _dress(self, slot: str, obstacle: ObstacleSpec) -> None:
        model = self._model
        for entry in self._parts[slot, obstacle.shape]:
            finish = entry.part.finish
            if finish == "mirror":
                continue
            textured = finish == "solid"
            model.geom_matid[entry.geom] = self._materials[obstacle.texture] if textured else -1
            colours = {"glass": obstacle.rgba, "rim": obstacle.frame_rgba, "label": _LABEL_RGBA, "solid": _UNTINTED}
            model.geom_rgba[entry.geom] = colours[finish]
            if finish == "label" and not obstacle.has_label:
                model.geom_group[entry.geom] = HIDDEN_GROUP
                model.geom_contype[entry.geom] = model.geom_conaffinity[entry.geom] = 0


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
    """Centre of mass (3,) in m and mean squares (3,) about it in m^2 of the shape at scale 1, uniform density."""
    volumes = np.array([_VOLUME[part.primitive] * float(np.prod(part.size)) for part in shape.parts])
    weights = volumes / volumes.sum()
    positions = np.array([part.pos for part in shape.parts])
    centre = weights @ positions
    spreads = np.array([_turned_spread(part) for part in shape.parts])
    return centre, weights @ (spreads + (positions - centre) ** 2)


def _turned_spread(part: Part) -> FloatArray:
    """Mean squares of one part along the shape's axes."""
    local = np.array(part.size) ** 2 * _SPREAD[part.primitive]
    cy, sy, cp, sp = math.cos(part.yaw), math.sin(part.yaw), math.cos(part.pitch), math.sin(part.pitch)
    rotation = np.array([[cy * cp, -sy, cy * sp], [sy * cp, cy, sy * sp], [-sp, 0.0, cp]])
    return rotation**2 @ local
