"""The paper's four hard scenes (Fig. 4) as random instances. Knows no simulator: one generator in, one value out.

Distances are chosen relative to the fixated object, so that what stands in front is clearly nearer, what stands behind
clearly farther: but for what is reflected and the stand under the target, no obstacle lies within 12 % of Z_f. Place in
the image and height of the table do not tell the sides (``things.py``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fixation_gym.envs.scene import ObstacleSpec, SceneSpec
from fixation_gym.experiments.scenarios.forms import stand_shape
from fixation_gym.experiments.scenarios.things import (
    PLAIN_TEXTURE,
    TEXTURES,
    Wish,
    changed,
    draw,
    find_thing,
    fulfils,
    has_room,
    hides,
)
from fixation_gym.experiments.scenarios.view import MARGIN, SceneView, sample_view
from fixation_gym.experiments.scenarios.wishes import WISHES
from fixation_gym.geometry.boxes import BoxSet, box_set
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray

SCENES = ("opaque", "see_through", "mirror", "reflection")
"""Things in front and behind; a see-through thing across the line of sight; a mirror in front; an object whose
reflection appears in front."""
MATERIAL_SCENES = ("glass", "chrome")
"""The second with real glass, and the first with curved mirrors in front: for physically based pictures."""
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
_SPEED = (0.02, 0.10)
"""Of the moving obstacle, m/s."""
_PLANS, _ATTEMPTS, _TURNS = 40, 50, 12
_STAND_HEIGHT = (0.05, 0.15)
"""Of the stand under the target, m."""
_RAISED = 0.8
"""Share of the instances in which the target is on a stand."""
_VELOCITIES = 20
"""Velocities that are tried for what moves."""


@dataclass(frozen=True)
class Instance:
    """One scene to look at, and how the camera moves there."""

    scene: SceneSpec
    """Mirrors come first among its obstacles, the stand under the target last."""
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
    stand: int | None = None
    """Index of the stand under the target among the obstacles."""

    def velocity_at(self, time: float) -> FloatArray:
        """Velocity of the camera in ``cam``, shape (3,), m/s: a circle, and forward as fast if it approaches.

        In a long run, forward turns into to and fro.
        """
        speed = CIRCLE_RADIUS * CIRCLE_RATE * min(1.0, time / _ONSET_S)
        angle = self.phase + self.sense * CIRCLE_RATE * time
        forward = 1.0 if self.duration_s <= DURATION_S else math.cos(_TO_AND_FRO_RATE * time)
        return speed * np.array([math.cos(angle), math.sin(angle), forward if self.approach else 0.0])


def sample_instance(scene: str, variant: str, rng: np.random.Generator) -> Instance:
    """Draw an instance of one of ``SCENES``, ``MATERIAL_SCENES`` or ``CLEAR`` in one of ``VARIANTS``.

    Raises:
        RuntimeError: if none is found.
    """
    for _ in range(_PLANS):
        rise = float(rng.uniform(*_STAND_HEIGHT)) if scene != CLEAR and rng.random() < _RAISED else 0.0
        # Drawn once: were they drawn again with every view, those that are easily found would come up more often.
        wishes = [] if scene == CLEAR else WISHES[scene](variant, rise, rng)
        for _ in range(_ATTEMPTS):
            instance = _propose(scene, variant, wishes, rise, rng)
            if instance is not None:
                return instance
    raise RuntimeError(f"no instance of scene {scene!r}, variant {variant!r} found in {_PLANS * _ATTEMPTS} draws")


def _propose(scene: str, variant: str, wishes: list[Wish], rise: float, rng: np.random.Generator) -> Instance | None:
    view = sample_view(rng, rise, CIRCLE_RADIUS * CIRCLE_RATE * DURATION_S if variant == "approach" else 0.0)
    stand = _stand(view, variant, rng)
    reds = [box_set([view.target.box]), *(item.boxes for item in stand)]
    find = _reflection if scene == "reflection" else _found
    obstacles = find(view, wishes, reds, rng)
    if obstacles is None:
        return None
    mover, velocity = None, np.zeros(3)
    if variant == "moving" and obstacles:
        mover = 1 if scene == "reflection" else 0  # there, what is reflected
        velocity = _sample_velocity(view, obstacles[mover], rng)
        if velocity is None:
            return None
    return Instance(
        scene=_scene(view, (*obstacles, *stand), rng),
        approach=variant == "approach",
        phase=float(rng.uniform(0.0, 2.0 * math.pi)),
        sense=int(rng.choice((-1, 1))),
        duration_s=CLEAR_DURATION_S if scene == CLEAR else DURATION_S,
        bare=variant == "plain" and scene == "see_through",
        mover=mover,
        velocity=(float(velocity[0]), float(velocity[1]), 0.0),
        stand=len(obstacles) if stand else None,
    )


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


def _found(
    view: SceneView, wishes: list[Wish], reds: list[BoxSet], rng: np.random.Generator
) -> list[ObstacleSpec] | None:
    """A thing for every wish, or None if there is none for one of them; ``reds``: target and stand."""
    found: list[ObstacleSpec] = []
    for wish in wishes:
        thing = find_thing(view, wish, reds, found, rng)
        if thing is None:
            return None
        found.append(thing)
    return found


def _reflection(
    view: SceneView, wishes: list[Wish], reds: list[BoxSet], rng: np.random.Generator
) -> list[ObstacleSpec] | None:
    """A mirror that shows a thing whose image lies behind the target; None if none is found."""
    mirror, solid = (draw(view, wish, rng) for wish in wishes)
    if mirror is None or solid is None:
        return None
    for _ in range(_TURNS):
        found = _reflected(view, mirror, solid, rng)
        if found is None or not has_room(view, found[0], reds):
            continue
        if has_room(view, found[1], [*reds, found[0].boxes]) and fulfils(view, wishes[0], found[0]):
            return found
    return None


def _reflected(
    view: SceneView, mirror: ObstacleSpec, solid: ObstacleSpec, rng: np.random.Generator
) -> list[ObstacleSpec] | None:
    """Turn a mirror and put a thing where its image appears in it and lies behind the target; None if it does not."""
    turn = float(rng.choice((-1.0, 1.0))) * math.radians(rng.uniform(15.0, 45.0))
    mirror = changed(mirror, np.array(mirror.position), mirror.yaw + turn)
    centre, eye = np.array(mirror.position), view.T_base_cam[:3, 3]
    normal = np.array([math.cos(mirror.yaw), math.sin(mirror.yaw), 0.0])
    half = np.array(mirror.shape.half_extent)
    # The image lies on the ray from the eye through some point of the mirror, where it stands on the table.
    across = np.array([-normal[1], normal[0], 0.0]) * half[1] * rng.uniform(-0.5, 0.5)
    through = centre + across + [0.0, 0.0, half[2] * rng.uniform(0.4, 0.9)]
    image = eye + (through - eye) * (solid.position[2] - eye[2]) / (through[2] - eye[2])
    place = image - 2.0 * ((image - centre) @ normal) * normal
    room = float(np.linalg.norm((place - eye)[:2]))  # for the arm
    fits = through[2] < eye[2] and (image - centre) @ normal < 0.0 and room > 0.22
    far = (image - eye) @ view.T_base_cam[:3, 2] > (1.0 + MARGIN) * view.depth
    return [mirror, changed(solid, place, 2.0 * mirror.yaw - solid.yaw)] if fits and far else None


def _stand(view: SceneView, variant: str, rng: np.random.Generator) -> list[ObstacleSpec]:
    """What the target stands on, if it is not the table."""
    if not view.rise:
        return []
    x, y, _ = view.target.position
    texture = PLAIN_TEXTURE if variant == "plain" else str(rng.choice(TEXTURES))
    shape = stand_shape(float(rng.uniform(0.035, 0.05)), view.rise)
    place = (x, y, ROBOT.workspace.table_height + 0.5 * view.rise)
    return [ObstacleSpec("opaque", shape, place, view.target.yaw, (1.0, 1.0, 1.0, 1.0), texture)]


def _sample_velocity(view: SceneView, obstacle: ObstacleSpec, rng: np.random.Generator) -> FloatArray | None:
    """Horizontal velocity; what stands in front stays there and, if solid, beside the line of sight."""
    before = view.sight(obstacle)
    for _ in range(_VELOCITIES):
        speed, direction = rng.uniform(*_SPEED), rng.uniform(0.0, 2.0 * math.pi)
        velocity = speed * np.array([math.cos(direction), math.sin(direction), 0.0])
        if not before.is_clearly(True):
            return velocity
        after = view.sight(changed(obstacle, np.array(obstacle.position) + DURATION_S * velocity, obstacle.yaw))
        if not after.is_clearly(True) or after.depths.min() < 0.35:
            continue
        start_x, end_x = float(before.places[:, 0].mean()), float(after.places[:, 0].mean())
        beside = start_x * end_x > 0.0 and abs(end_x) >= abs(start_x) - 0.02 and not hides(view, after)
        if obstacle.kind == "translucent" or beside:
            return velocity
    return None
