"""The paper's four hard scenes (Fig. 4) as random instances. Knows no simulator: one generator in, one value out.

Distances are chosen relative to the fixated object, so that what stands in front is clearly nearer, what stands behind
clearly farther: no obstacle lies within 12 % of Z_f. Everything stands on the table of the pick task.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fixation_gym.envs.object_pool import THINGS
from fixation_gym.envs.scene import ObstacleSpec, SceneSpec
from fixation_gym.envs.shapes import scaled, without
from fixation_gym.experiments.scenarios.view import MARGIN, SceneView, sample_view
from fixation_gym.geometry.rigid import inverse, transform
from fixation_gym.types import FloatArray

SCENES = ("opaque", "see_through", "mirror", "reflection")
"""Things in front and behind; a see-through thing across the line of sight; a mirror in front; an object whose
reflection appears in front."""
VARIANTS = ("lateral", "approach", "border", "plain", "moving")
"""Lateral motion; forward as fast as lateral; obstacles at the image border; untextured obstacles (see-through ones
without rim and label); one obstacle that moves by itself."""
CLEAR = "clear"
"""No obstacle: for false alarms."""
CIRCLE_RADIUS, CIRCLE_RATE = 0.03, 2.0
"""Lateral motion of the camera: m and rad/s."""
DURATION_S, CLEAR_DURATION_S = 2.4, 30.0
_ONSET_S = 0.2
"""Time to get to full speed."""
_TO_AND_FRO_RATE = 0.8
"""rad/s."""
_TEXTURES = ("wood_light", "wood_dark", "bricks", "metal")
_SIDE, _BORDER = (0.10, 0.26), (0.30, 0.46)
"""Horizontal image position of things, normalised; the image ends at 0.52."""
_SPEED = (0.02, 0.10)
"""Of the moving obstacle, m/s."""
_ATTEMPTS, _ATTEMPTS_EACH = 2000, 40
_TARGET_ROOM = 0.045
"""What hides nothing stays this far from the line of sight, at the target's depth, m."""


@dataclass(frozen=True)
class Instance:
    """One scene to look at, and how the camera moves there."""

    scene: SceneSpec
    """Mirrors come first among its obstacles, as in the simulation."""
    approach: bool
    phase: float
    """Of the circle, rad."""
    sense: int
    """Of the circle, 1 or -1."""
    duration_s: float
    bare: bool = False
    """See-through things have neither rim nor label."""
    mover: int | None = None
    """Index of the obstacle that moves ..."""
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """... with this velocity in base, m/s."""

    def velocity_at(self, time: float) -> FloatArray:
        """Velocity of the camera in ``cam``, shape (3,), m/s: a circle, and forward as fast if it approaches.

        In a long run, forward turns into to and fro.
        """
        speed = CIRCLE_RADIUS * CIRCLE_RATE * min(1.0, time / _ONSET_S)
        angle = self.phase + self.sense * CIRCLE_RATE * time
        forward = 1.0 if self.duration_s <= DURATION_S else math.cos(_TO_AND_FRO_RATE * time)
        return speed * np.array([math.cos(angle), math.sin(angle), forward if self.approach else 0.0])


def sample_instance(scene: str, variant: str, rng: np.random.Generator) -> Instance:
    """Draw an instance of one of ``SCENES`` or ``CLEAR`` in one of ``VARIANTS``.

    Raises:
        RuntimeError: if none is found.
    """
    for _ in range(_ATTEMPTS):
        view = sample_view(rng)
        obstacles = _OBSTACLES[scene](view, variant, rng)
        if obstacles is None or not _has_room(obstacles, np.array(view.target.position)):
            continue
        mover, velocity = None, np.zeros(3)
        if variant == "moving" and obstacles:
            mover = 1 if scene == "reflection" else 0  # there, what is reflected
            velocity = _sample_velocity(view, obstacles[mover], rng)
            if velocity is None:
                continue
        return Instance(
            scene=_scene(view, tuple(obstacles), rng),
            approach=variant == "approach",
            phase=float(rng.uniform(0.0, 2.0 * math.pi)),
            sense=int(rng.choice((-1, 1))),
            duration_s=CLEAR_DURATION_S if scene == CLEAR else DURATION_S,
            bare=variant == "plain" and scene == "see_through",
            mover=mover,
            velocity=(float(velocity[0]), float(velocity[1]), 0.0),
        )
    raise RuntimeError(f"no instance of scene {scene!r}, variant {variant!r} found in {_ATTEMPTS} draws")


def _scene(view: SceneView, obstacles: tuple[ObstacleSpec, ...], rng: np.random.Generator) -> SceneSpec:
    eye = view.T_base_cam[:3, 3]
    light = rng.uniform(-0.5, 0.5, 2)
    return SceneSpec(
        target=view.target,
        obstacles=obstacles,
        camera_position=(float(eye[0]), float(eye[1]), float(eye[2])),
        gaze_point=view.target.position,
        light_direction=(float(light[0]), float(light[1]), -1.0),
        table_texture=str(rng.choice(("table_wood", "table_plank", "table_felt"))),
    )


# -- obstacles of the four scenes --------------------------------------------------------------------------------


def _opaque_scene(view: SceneView, variant: str, rng: np.random.Generator) -> list[ObstacleSpec] | None:
    """Two in front, one on each side, and two behind."""
    signs = rng.permutation([-1.0, 1.0])
    obstacles = [_solid(view, variant, True, sign, rng) for sign in signs]
    obstacles += [_solid(view, variant, False, sign, rng) for sign in signs]
    return _complete(obstacles)


def _see_through_scene(view: SceneView, variant: str, rng: np.random.Generator) -> list[ObstacleSpec] | None:
    """One across the line of sight, or at the border, and something solid behind."""
    sign = float(rng.choice((-1.0, 1.0)))
    glass = None
    for _ in range(_ATTEMPTS_EACH):
        x = sign * rng.uniform(*_BORDER) if variant == "border" else rng.uniform(-0.05, 0.05)
        drawn = _standing(view, "translucent", True, float(x), rng)
        if drawn is not None and glass is None and (variant == "border" or view.is_across(drawn)):
            glass = drawn
    return _complete([glass, _solid(view, variant, False, -sign, rng)])


def _mirror_scene(view: SceneView, variant: str, rng: np.random.Generator) -> list[ObstacleSpec] | None:
    """A mirror beside the line of sight, something solid behind and, on the other side, in front."""
    sign = float(rng.choice((-1.0, 1.0)))
    x = sign * rng.uniform(*(_BORDER if variant == "border" else (0.20, 0.30)))
    mirror = _standing(view, "mirror", True, float(x), rng)
    return _complete([mirror, _solid(view, variant, True, -sign, rng), _solid(view, variant, False, -sign, rng)])


def _reflection_scene(view: SceneView, variant: str, rng: np.random.Generator) -> list[ObstacleSpec] | None:
    """A mirror in front that shows a solid thing: the image appears in front, where the mirror is, but lies behind."""
    sign = float(rng.choice((-1.0, 1.0)))
    mirror = None
    for _ in range(_ATTEMPTS_EACH):
        x = sign * rng.uniform(*((0.36, 0.46) if variant == "border" else (0.26, 0.36)))
        mirror = mirror or _standing(view, "mirror", True, float(x), rng, (0.60, 0.78), (0.9, 1.0))
    solid = _solid(view, variant, False, sign, rng, (0.4, 0.7))
    if mirror is None or solid is None:
        return None
    turn = float(rng.choice((-1.0, 1.0))) * math.radians(rng.uniform(15.0, 45.0))
    mirror = _changed(mirror, mirror.position, mirror.yaw + turn)
    centre, eye = np.array(mirror.position), view.T_base_cam[:3, 3]
    normal = np.array([math.cos(mirror.yaw), math.sin(mirror.yaw), 0.0])
    half = np.array(mirror.shape.half_extent)
    # The image lies on the ray from the eye through some point of the mirror, where it stands on the table.
    across = np.array([-normal[1], normal[0], 0.0]) * half[1] * rng.uniform(-0.5, 0.5)
    through = centre + across + [0.0, 0.0, half[2] * rng.uniform(0.4, 0.9)]
    image = eye + (through - eye) * (solid.position[2] - eye[2]) / (through[2] - eye[2])
    seen = _changed(solid, (float(image[0]), float(image[1]), float(image[2])), solid.yaw)
    place = image - 2.0 * ((image - centre) @ normal) * normal
    room = float(np.linalg.norm((place - eye)[:2]))  # for the arm
    fits = through[2] < eye[2] and (image - centre) @ normal < 0.0 and room > 0.22
    if not (fits and view.is_clearly(mirror, True) and view.depths(seen).mean() > 1.0 + MARGIN):
        return None
    there = (float(place[0]), float(place[1]), solid.position[2])
    return [mirror, _changed(solid, there, 2.0 * mirror.yaw - solid.yaw)]


def _solid(
    view: SceneView,
    variant: str,
    in_front: bool,
    sign: float,
    rng: np.random.Generator,
    scales: tuple[float, float] = (0.6, 1.0),
) -> ObstacleSpec | None:
    """A solid thing on one side of the image; at the border in that variant."""
    sides = _BORDER if variant == "border" else _SIDE
    obstacle = None
    for _ in range(_ATTEMPTS_EACH):
        x = float(sign * rng.uniform(*sides))
        obstacle = obstacle or _standing(view, "opaque", in_front, x, rng, scales=scales)
    if obstacle is None or variant != "plain":
        return obstacle
    return _changed(obstacle, obstacle.position, obstacle.yaw, "wood_plain")


def _standing(
    view: SceneView,
    kind: str,
    in_front: bool,
    x: float,
    rng: np.random.Generator,
    nearness: tuple[float, float] = (0.5, 0.78),
    scales: tuple[float, float] = (0.6, 1.0),
) -> ObstacleSpec | None:
    """A thing of some kind at an image column, or None if it is not clearly nearer or farther than the target."""
    shapes = THINGS[kind]
    shape = scaled(shapes[int(rng.integers(len(shapes)))], float(rng.uniform(*scales)))
    if rng.random() < 0.5:
        shape = without(shape, "label")
    depth = view.depth * float(rng.uniform(*(nearness if in_front else (1.2, 1.8))))
    position = view.standing(x, depth, shape.half_extent[2])
    if position is None:
        return None
    solid = kind == "opaque"
    yaw = float(rng.uniform(-math.pi, math.pi) if solid else view.facing(position) + rng.uniform(-0.35, 0.35))
    tint = rng.uniform(0.55, 0.95, 3) * [0.75, 1.0, 1.0]
    obstacle = ObstacleSpec(
        kind=kind,
        shape=shape,
        position=(float(position[0]), float(position[1]), float(position[2])),
        yaw=yaw,
        rgba=(float(tint[0]), float(tint[1]), float(tint[2]), float(rng.uniform(0.3, 0.9))),
        texture=str(rng.choice(_TEXTURES)),
    )
    half_width = math.hypot(*shape.half_extent[:2]) if solid else shape.half_extent[1]
    hides = in_front and kind != "translucent" and abs(x) * depth - half_width < _TARGET_ROOM * depth / view.depth
    return obstacle if view.is_clearly(obstacle, in_front) and not hides else None


def _sample_velocity(view: SceneView, obstacle: ObstacleSpec, rng: np.random.Generator) -> FloatArray | None:
    """Horizontal velocity; what stands in front stays there and, if solid, beside the line of sight."""
    speed, direction = rng.uniform(*_SPEED), rng.uniform(0.0, 2.0 * math.pi)
    velocity = speed * np.array([math.cos(direction), math.sin(direction), 0.0])
    if not view.is_clearly(obstacle, True):
        return velocity
    end = np.array(obstacle.position) + DURATION_S * velocity
    moved = _changed(obstacle, (float(end[0]), float(end[1]), float(end[2])), obstacle.yaw)
    start_x, end_x = (transform(inverse(view.T_base_cam), np.array(item.position))[0] for item in (obstacle, moved))
    beside = obstacle.kind == "translucent" or (start_x * end_x > 0.0 and abs(end_x) >= abs(start_x) - 0.01)
    return velocity if beside and view.is_clearly(moved, True) and view.depths(moved).min() > 0.35 else None


def _changed(
    obstacle: ObstacleSpec, position: tuple[float, float, float], yaw: float, texture: str | None = None
) -> ObstacleSpec:
    """The same obstacle elsewhere, or with another texture."""
    return replace(obstacle, position=position, yaw=yaw, texture=texture or obstacle.texture)


def _complete(obstacles: list[ObstacleSpec | None]) -> list[ObstacleSpec] | None:
    """The list, or None if something is missing."""
    found = [obstacle for obstacle in obstacles if obstacle is not None]
    return found if len(found) == len(obstacles) else None


def _has_room(obstacles: list[ObstacleSpec], target: FloatArray) -> bool:
    """Whether all footprints are on the table and apart from each other and from the target."""
    circles = [(target[:2], 0.06)]
    for obstacle in obstacles:
        centre = np.array(obstacle.position[:2])
        radius = math.hypot(*obstacle.shape.half_extent[:2])
        if not (0.20 < centre[0] < 0.92 and abs(centre[1]) < 0.37):
            return False
        if any(np.linalg.norm(centre - other) < radius + reach for other, reach in circles):
            return False
        circles.append((centre, radius))
    return True


def _clear_scene(view: SceneView, variant: str, rng: np.random.Generator) -> list[ObstacleSpec] | None:
    return []


_OBSTACLES = {
    "opaque": _opaque_scene,
    "see_through": _see_through_scene,
    "mirror": _mirror_scene,
    "reflection": _reflection_scene,
    CLEAR: _clear_scene,
}
