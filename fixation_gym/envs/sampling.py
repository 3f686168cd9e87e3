"""Sampling of scenes: the free way is drawn first, then obstacles are placed until all other ways are barred.

A way is straight, level and comes from some direction of the arm's reach. The free one is drawn evenly over the reach,
so no habit can know it; a cone around it stays free with room to spare, whatever moves. Obstacles are then drawn one
by one, each to bar a way that is still open: first the one along the first line of sight, then the one from straight
above, then any. Pure: one generator in, one value out.
"""

from __future__ import annotations

import colorsys
import math
from dataclasses import dataclass, replace

import numpy as np

from fixation_gym.control.corridor import (
    BoxSet,
    approach_directions,
    box_set,
    boxes_meet,
    free_directions,
    hand_axes,
    hand_boxes,
)
from fixation_gym.envs.config import Scenario
from fixation_gym.envs.object_pool import MAX_OBSTACLES, target_shape
from fixation_gym.envs.obstacle_kinds import OBSTACLE_KINDS
from fixation_gym.envs.placement import (
    FREE_ROOM,
    OBSTACLE_GAP,
    Room,
    draw_kind,
    draw_mover,
    draw_obstacle,
    moved_out,
    sample_push,
)
from fixation_gym.envs.pool_slots import fits_pool
from fixation_gym.envs.reach import REACH_GRID, reachable_directions, sample_direction
from fixation_gym.envs.scene import TABLE_HEIGHT, TARGET_REGION, ObstacleSpec, SceneSpec, TargetSpec
from fixation_gym.envs.shapes import Vector
from fixation_gym.envs.visibility import is_seen, passes_through, visible_share
from fixation_gym.geometry.rigid import look_at
from fixation_gym.types import FloatArray, MaskArray

_PUSHED_REGION = ((0.46, 0.66), (-0.18, 0.18))
"""Ranges of x and y in which a push may leave the target, in base, m."""
_BARRED_DEPTH = 0.01
"""A way is barred if a hand smaller by this would still touch something, m."""
_CONE = math.radians(5.0)
"""Half angle of the cone of free ways, rad."""
_NEAR_FREE = math.radians(12.0)
"""Ways this near to the free one need not be barred, rad."""
_MOST_OPEN = 0.28
"""Largest share of the reach that is not barred in the end."""
_ABOVE = math.radians(75.0)
"""Ways from above are those of at least this elevation, rad."""
_MOST_ABOVE = 0.35
"""Largest share of them that is not barred, unless the free way is one of them."""
_BEYOND = (0.2, 0.9)
"""Range of the angle by which an obstacle stands beyond the way that it is to bar, seen from the free one, rad."""
_STEP_OUT = 0.02
"""An obstacle that is in the free way is moved out by this much at a time, m."""
_LEAST_VISIBLE = 0.5
"""Least share of the target that is in view at the start, through glass or past everything else."""
_LARGEST_ROLL, _LOW_ROLL = math.radians(45.0), math.radians(20.0)
"""Largest turn of the hand that a grasp may need on a steep free way and on a low one, rad."""
_DISTRACTOR_DISTANCE = (0.12, 0.22)
"""Range of the distance between target and distractor, m."""
_FRAME_HUES = (1.0 / 8.0, 7.0 / 8.0)
"""Range of the hue of coloured frames, 0..1: anything but the target's red."""
_APART = math.radians(20.0)
"""Least angle between the first line of sight and the free way: the hand is wide, and the former is to be barred."""
_ATTEMPTS, _ATTEMPTS_EACH, _BATCHES, _MOVER_TRIES = 10, 60, (40, 20), 40
"""Free ways and scenes for each that are tried, candidates for the obstacles of one scene, drawn in turns, and tries for those that move."""
_THING = OBSTACLE_KINDS[0]


def sample_scene(scenario: Scenario, rng: np.random.Generator) -> SceneSpec:
    """Draw a scene with a free way that cannot be guessed.

    Raises:
        RuntimeError: if the scenario leaves no room for such a scene.
    """
    low, high = (math.radians(angle) for angle in scenario.free_elevation_deg)
    for _ in range(_ATTEMPTS):
        free = sample_direction(rng, (low, high))
        # The same way is tried again, or those that are easily left free would come up more often.
        for _ in range(_ATTEMPTS_EACH):
            scene = _propose(scenario, free, rng)
            if scene is not None:
                return scene
    raise RuntimeError(
        f"no scene of scenario {scenario.name!r} found in {_ATTEMPTS * _ATTEMPTS_EACH} draws; allow more obstacles, more kinds of them, "
        "or another range of free_elevation_deg"
    )


@dataclass(frozen=True)
class Way:
    """A way of the hand to the target: from where it comes."""

    azimuth: float
    """In base, rad: 0 comes from the robot's side along +x."""
    elevation: float
    """Above the table, rad."""


@dataclass(frozen=True, eq=False)
class _Start:
    """What is there before the obstacles."""

    target: TargetSpec
    distractor: TargetSpec | None
    camera: FloatArray
    gaze: FloatArray
    view: Way
    """Direction from the target to the camera."""
    free: Way

    room: Room

    @property
    def pose(self) -> FloatArray:
        """T_base_cam, shape (4, 4)."""
        return look_at(self.camera, self.gaze, np.array([0.0, 0.0, 1.0]))


def _propose(scenario: Scenario, free: tuple[float, float], rng: np.random.Generator) -> SceneSpec | None:
    start = _sample_start(scenario, free, rng)
    if start is None:
        return None
    obstacles: tuple[ObstacleSpec, ...] = ()
    if scenario.obstacle_count[1] + scenario.moving_count[1]:
        barriers = _bar_ways(scenario, start, rng)
        placed = None if barriers is None else _add_movers(scenario, start, barriers, rng)
        if placed is None or not fits_pool(placed):
            return None
        obstacles = tuple(placed)
    light = rng.uniform(-0.5, 0.5, 2)
    scene = SceneSpec(
        target=start.target,
        obstacles=obstacles,
        camera_position=_vector(start.camera),
        gaze_point=_vector(start.gaze),
        light_direction=(float(light[0]), float(light[1]), -1.0),
        table_texture=str(rng.choice(("table_wood", "table_plank", "table_felt"))),
        distractor=start.distractor,
        free_way=(start.free.azimuth, start.free.elevation) if obstacles else None,
    )
    # From a generator of their own: nothing else of the scene depends on the colours.
    return _with_coloured_frames(scene, rng.spawn(1)[0]) if scenario.coloured_frames else scene


# -- before the obstacles ----------------------------------------------------------------------------------------------


def _sample_start(scenario: Scenario, free_angles: tuple[float, float], rng: np.random.Generator) -> _Start | None:
    """Draw target and first view; ``free_angles`` are the free way's azimuth against the bearing and elevation, rad."""
    target = _sample_target(scenario, rng)
    if scenario.target_moves > 0.0 and rng.random() < scenario.target_moves:
        target = _pushed(target, scenario, rng)
    centre = np.array(target.position)
    bearing = math.atan2(centre[1], centre[0])
    free = Way(bearing + free_angles[0], free_angles[1])
    target = replace(target, yaw=_grasped_yaw(target, free, rng))
    low, high = (math.radians(angle) for angle in scenario.view_elevation_deg)
    azimuth, elevation = sample_direction(rng, (low, high))
    view = Way(bearing + azimuth, elevation)
    camera = centre + rng.uniform(0.42, 0.50) * _direction(view)
    gaze = centre + rng.uniform(-0.06, 0.06, 3) * [1.0, 1.0, 0.0]
    distractor = None
    if scenario.distractor > 0.0 and rng.random() < scenario.distractor:
        distractor = _sample_distractor(scenario, target, rng)
        if not _told_apart(target, distractor, camera, gaze):
            return None
    room = _room(target, distractor, look_at(camera, gaze, np.array([0.0, 0.0, 1.0])), free)
    if (
        distractor is not None
        and not free_directions(room.ends[-1], [distractor.box], _direction(free)[None], FREE_ROOM).all()
    ):
        return None
    return _Start(target, distractor, camera, gaze, view, free, room)


def _room(target: TargetSpec, distractor: TargetSpec | None, T_base_cam: FloatArray, free: Way) -> Room:
    """What obstacles must keep clear of: red things, the hand, a cone of free ways, its axis also for a turned hand."""
    reds = [replace(target.box, centre=place) for place in target.places]
    if distractor is not None:
        reds.append(distractor.box)
    axis = _direction(free)
    across = np.cross(axis, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    angles = np.linspace(0.0, 2.0 * math.pi, 6, endpoint=False)[:, None]
    rim = math.cos(_CONE) * axis + math.sin(_CONE) * (np.cos(angles) * across + np.sin(angles) * np.cross(axis, across))
    turns = _grasp_turns(target, free)
    ways = np.vstack([axis, rim, *[axis[None]] * len(turns)])
    rolls = np.array([0.0] * (1 + len(rim)) + turns)
    ends = target.places[[0, -1]] if target.motion else target.places[:1]
    return Room(box_set(reds), hand_boxes(T_base_cam), ends, hand_axes(ways, rolls))


def _sample_target(scenario: Scenario, rng: np.random.Generator) -> TargetSpec:
    shape = target_shape(str(rng.choice(scenario.target_shapes)))
    width = rng.uniform(*scenario.grasp_width)
    ratio = width / (2.0 * shape.half_extent[1])
    # Thin boxes and cylinders are taller than wide, so that oblique fingers reach them above the table.
    slender = shape.name in ("box", "cylinder")
    height_ratio = min(1.0, ratio * rng.uniform(1.0, 1.6)) if slender else ratio
    length_ratio = min(1.0, ratio * rng.uniform(1.0, 1.3)) if shape.name == "box" else ratio
    scale = (float(length_ratio), float(ratio), float(height_ratio))
    x, y = (rng.uniform(*bounds) for bounds in TARGET_REGION)
    z = TABLE_HEIGHT + shape.half_extent[2] * height_ratio
    return TargetSpec(shape.name, scale, (float(x), float(y), float(z)), float(rng.uniform(-math.pi, math.pi)))


def _grasped_yaw(target: TargetSpec, free: Way, rng: np.random.Generator) -> float:
    """A yaw at which the fingers can close on the target from the free way; what is round may stand as it likes.

    Flat fingers that are turned far would touch the table, so the lower the way the less the hand may turn.
    """
    if target.shape not in ("box", "duck"):
        return target.yaw
    steepness = (free.elevation - math.radians(45.0)) / math.radians(25.0)
    most = _LOW_ROLL + (_LARGEST_ROLL - _LOW_ROLL) * min(max(steepness, 0.0), 1.0)
    # The fingers open along the image's x axis, which is across the way: then the target's y axis is along it.
    quarter = math.pi / 2 * float(rng.integers(4)) if target.shape == "box" else math.pi * float(rng.integers(2))
    return float((free.azimuth + quarter + rng.uniform(-most, most) + math.pi) % (2.0 * math.pi) - math.pi)


def _pushed(target: TargetSpec, scenario: Scenario, rng: np.random.Generator) -> TargetSpec:
    """The target with a push that leaves it within reach."""
    while True:
        motion = sample_push(scenario.target_push, scenario.push_time, rng.uniform(-math.pi, math.pi), rng)
        end = np.add(target.position[:2], motion.displacement)
        if all(low < value < high for value, (low, high) in zip(end, _PUSHED_REGION, strict=True)):
            return replace(target, motion=motion)


def _sample_distractor(scenario: Scenario, target: TargetSpec, rng: np.random.Generator) -> TargetSpec:
    """Another red object, not farther from the target than the hand is wide."""
    red = _sample_target(scenario, rng)
    angle, distance = rng.uniform(-math.pi, math.pi), rng.uniform(*_DISTRACTOR_DISTANCE)
    x, y = target.position[0] + distance * math.cos(angle), target.position[1] + distance * math.sin(angle)
    return replace(red, position=(float(x), float(y), red.position[2]))


def _told_apart(target: TargetSpec, distractor: TargetSpec, camera: FloatArray, gaze: FloatArray) -> bool:
    """Whether the target is clearly the one nearer to the image centre."""
    if np.linalg.norm(target.places - distractor.position, axis=1).min() < 0.10:
        return False
    axis = (gaze - camera) / np.linalg.norm(gaze - camera)
    offsets = []
    for red in (target, distractor):
        ray = np.array(red.position) - camera
        offsets.append(float(np.linalg.norm(ray - (ray @ axis) * axis)) / float(ray @ axis))
    return offsets[1] >= 1.5 * offsets[0] + 0.05


# -- obstacles ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Candidate:
    """An obstacle that has room, if no other were there, and what it bars."""

    obstacle: ObstacleSpec
    boxes: BoxSet
    barred: MaskArray
    """Ways of the reach's grid that it bars."""
    first: bool
    """Whether it was drawn as the first one of its scene."""


def _bar_ways(scenario: Scenario, start: _Start, rng: np.random.Generator) -> list[ObstacleSpec] | None:
    """Obstacles that bar all ways but those near the free one; None if that does not come about.

    Candidates are drawn as if they were alone; then those that bar most are taken, if they have room beside the others.
    """
    ways = reachable_directions(start.room.ends[-1])
    near_free = ways @ _direction(start.free) > math.cos(_NEAR_FREE)
    first_sight = int(np.argmax(ways @ _direction(start.view)))
    if ways[first_sight] @ _direction(start.free) > math.cos(_APART):
        return None
    candidates: list[_Candidate] = []
    for batch in _BATCHES:
        for index in range(batch):
            wanted = ways[first_sight if index < batch // 4 else rng.integers(len(ways))]
            candidate = _draw_candidate(scenario, start, index < batch // 4, ways, wanted, rng)
            if candidate is not None:
                candidates.append(candidate)
        chosen = _covering(scenario, start, candidates, ways, near_free, first_sight)
        if chosen is not None:
            return chosen
    return None


def _covering(
    scenario: Scenario,
    start: _Start,
    candidates: list[_Candidate],
    ways: FloatArray,
    near_free: MaskArray,
    first_sight: int,
) -> list[ObstacleSpec] | None:
    """Obstacles out of the candidates that bar enough together; None if there are none."""
    least, most = scenario.obstacle_count
    for first in (candidate for candidate in candidates if candidate.first):
        chosen, open_ways = [first], ~first.barred
        left = [candidate for candidate in candidates if not candidate.first]
        while not (len(chosen) >= least and _is_barred(open_ways, near_free, first_sight)) and left:
            if len(chosen) == most:
                break
            left = [item for item in left if _fits(item, chosen)]
            gains = [int((item.barred & open_ways).sum()) for item in left]
            if not left or (max(gains) == 0 and len(chosen) >= least):
                break
            best = left.pop(int(np.argmax(gains)))
            chosen.append(best)
            open_ways = open_ways & ~best.barred
        obstacles = [item.obstacle for item in chosen]
        if len(chosen) >= least and _is_barred(open_ways, near_free, first_sight):
            if scenario.discovery and not _is_discovered(start, chosen, ways, near_free, first_sight):
                continue
            if visible_share(start.camera, start.target, obstacles) >= _LEAST_VISIBLE:
                return obstacles
    return None


def _fits(item: _Candidate, chosen: list[_Candidate]) -> bool:
    """Whether a candidate has room beside those that were chosen."""
    if item.obstacle.kind == "mirror" and any(other.obstacle.kind == "mirror" for other in chosen):
        return False  # MuJoCo draws one reflection only
    if any(boxes_meet(item.boxes, other.boxes, OBSTACLE_GAP) for other in chosen):
        return False
    return True


def _is_discovered(
    start: _Start, chosen: list[_Candidate], ways: FloatArray, near_free: MaskArray, first_sight: int
) -> bool:
    """Whether the nearest way that the first obstacle leaves is barred by something out of view at the start."""
    around = np.where(chosen[0].barred | near_free, -1.0, ways @ ways[first_sight])
    natural = int(np.argmax(around))
    first = [chosen[0].obstacle]
    return any(item.barred[natural] and not is_seen(item.obstacle, start.pose, first) for item in chosen[1:])


def _is_barred(open_ways: MaskArray, near_free: MaskArray, first_sight: int) -> bool:
    """Whether the first line of sight and enough of all other ways are barred, those from above in particular."""
    above = (REACH_GRID[:, 1] > _ABOVE) & ~near_free
    return bool(
        not open_ways[first_sight]
        and open_ways.mean() <= _MOST_OPEN
        and (open_ways[above].mean() <= _MOST_ABOVE if above.any() else True)
    )


def _draw_candidate(
    scenario: Scenario,
    start: _Start,
    first: bool,
    ways: FloatArray,
    way: FloatArray,
    rng: np.random.Generator,
) -> _Candidate | None:
    """An obstacle to bar ``way``, as near to the target as the free ways allow, if it is what the scenario asks for."""
    beyond = _beyond(_direction(start.free), way, rng.uniform(*_BEYOND))
    drawn = draw_kind(scenario, first, float(beyond[2]), rng)
    if drawn is None:
        return None
    kind, material = drawn
    bearing = start.free.azimuth if kind.around else math.atan2(-beyond[1], -beyond[0]) + rng.normal(0.0, 0.2)
    nearest, farthest = kind.distance
    obstacle = draw_obstacle(kind, material, start.room.ends[-1], bearing, nearest, scenario, rng)
    outward = bearing + math.pi if kind.around else bearing  # what stands around the target draws back from the way
    boxes = box_set(obstacle.boxes)
    step = -_STEP_OUT * np.array([math.cos(outward), math.sin(outward), 0.0])
    steps = start.room.first_place(boxes, step, int((farthest - nearest) / _STEP_OUT))
    if steps is None:
        return None
    boxes, obstacle = boxes.moved(steps * step), moved_out(obstacle, outward, steps * _STEP_OUT)
    if first and scenario.through_sight and not passes_through(obstacle.box, start.camera, start.room.ends[0]):
        return None
    barred = ~free_directions(start.room.ends[-1], boxes, ways, -_BARRED_DEPTH)
    return _Candidate(obstacle, boxes, barred, first)


def _beyond(free: FloatArray, way: FloatArray, angle: float) -> FloatArray:
    """The direction that lies beyond ``way``, seen from the free one, by ``angle`` rad, but above the table.

    What stands there bars the way without being in the free one: the hand is wide.
    """
    across = way - (way @ free) * free
    across /= max(float(np.linalg.norm(across)), 1e-9)
    total = math.acos(float(np.clip(way @ free, -1.0, 1.0))) + angle
    direction = math.cos(total) * free + math.sin(total) * across
    direction[2] = max(direction[2], 0.05)
    return direction / np.linalg.norm(direction)


def _add_movers(
    scenario: Scenario, start: _Start, barriers: list[ObstacleSpec], rng: np.random.Generator
) -> list[ObstacleSpec] | None:
    """The obstacles with those that move; None if there is no room for them."""
    count = int(rng.integers(scenario.moving_count[0], scenario.moving_count[1] + 1))
    obstacles = list(barriers)
    for _ in range(_MOVER_TRIES):
        if len(obstacles) == len(barriers) + count:
            return obstacles
        materials = [name for name in scenario.obstacle_materials if name != "mirror"]
        mover = draw_mover(scenario, _THING, str(rng.choice(materials)), start.room.ends[-1], rng)
        others, boxes = box_set([box for obstacle in obstacles for box in obstacle.boxes]), box_set(mover.boxes)
        if not start.room.holds(boxes) or boxes_meet(boxes, others, OBSTACLE_GAP):
            continue
        if visible_share(start.camera, start.target, [*obstacles, mover]) >= _LEAST_VISIBLE:
            obstacles.append(mover)
    return obstacles if len(obstacles) == len(barriers) + count <= MAX_OBSTACLES else None


def _grasp_turns(target: TargetSpec, free: Way) -> list[float]:
    """Turn of the hand about its axis that the grasp of a target with sides needs, rad; none for what is round."""
    if target.shape not in ("box", "duck"):
        return []
    period = math.pi / 2 if target.shape == "box" else math.pi
    return [(target.yaw - free.azimuth + period / 2) % period - period / 2]


# -- pieces ------------------------------------------------------------------------------------------------------------


def _direction(way: Way) -> FloatArray:
    """Unit vector from the target to a camera on that way, shape (3,), in base."""
    return approach_directions(np.array([way.azimuth]), np.array([way.elevation]))[0]


def _with_coloured_frames(scene: SceneSpec, rng: np.random.Generator) -> SceneSpec:
    obstacles = []
    for obstacle in scene.obstacles:
        red, green, blue = colorsys.hsv_to_rgb(rng.uniform(*_FRAME_HUES), rng.uniform(0.0, 1.0), rng.uniform(0.1, 1.0))
        obstacles.append(replace(obstacle, frame_rgba=(red, green, blue, 1.0)))
    return replace(scene, obstacles=tuple(obstacles))


def _vector(values: FloatArray) -> Vector:
    return (float(values[0]), float(values[1]), float(values[2]))
