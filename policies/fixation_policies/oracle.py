"""The privileged oracle: knows the scene, so it shows what a perfect sense of distance and obstacles could reach."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fixation_gym.control.corridor import approach_directions, free_directions
from fixation_gym.control.reach import reachable_directions
from fixation_gym.envs import config
from fixation_gym.envs.scene import SceneSpec
from fixation_gym.geometry.boxes import BoxSet, box_set, joined
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray
from fixation_policies.base import SimulatedWorld
from fixation_policies.grips import LARGEST_SLANT, grips_of, rolls, slants, widths
from fixation_policies.privileged import VIEW_DISTANCE, Choice, PrivilegedPolicy

if TYPE_CHECKING:
    from fixation_gym.envs.rehearsal import Rehearsal

_STEEP, _STEEP_TURNED = math.radians(55.0), math.radians(75.0)
"""Elevation below which an approach is avoided where possible, for round targets and for those the hand turns to."""
_MARGINS = (0.03, 0.02, 0.01, 0.0)
"""Room around the hand on a straight way, the best first, m."""
_BARRED = 100
"""Rank of ways that are not free."""
_NEARBY = np.radians(np.linspace(-12.0, 12.0, 9))
"""Angles from the scene's free way to others that are looked at, rad."""
_ALIKE = math.radians(10.0)
"""A way this near to one by which a grasp failed would fail, too, rad."""
_ROOM = 0.005
"""Least distance of the whole arm from obstacles in a rehearsal that is good enough, m ..."""
_REHEARSALS = 40
"""... and how many ways are rehearsed until one is."""


@dataclass(frozen=True, eq=False)
class _World:
    """What a policy that rehearses looks into."""

    sim: Rehearsal
    scene: SceneSpec


class OraclePolicy(PrivilegedPolicy):
    """Takes the easiest straight way that is free for hand and arm from here to the lift: it rehearses them.

    It knows where every obstacle will ever be.
    """

    def reset(self, seed: int | None = None) -> None:
        """Forget the last episode."""
        super().reset(seed)
        self._tried: list[Choice] = []

    def _begin(self, phase: str, pose: FloatArray, target: FloatArray, time: float) -> None:
        super()._begin(phase, pose, target, time)
        if phase == "grasp":
            self._tried.append((self._direction, self._grip))

    def choose(self, pose: FloatArray, target: FloatArray, time: float) -> Choice:
        """Choose the first way on which nothing comes near the arm, or else that with the most room."""
        if self._phase == "grasp":  # it backs off first, and then chooses
            return self._direction, self._grip
        best, most = None, -math.inf
        for way in self._ways(pose, target, time)[:_REHEARSALS]:
            room = _rehearsed_room(self._env, self._scene, way, time, most)
            if room > most:
                best, most = way, room
            if most > _ROOM:
                break
        assert best is not None, "some way has more room than none"
        return best

    def _ways(self, pose: FloatArray, target: FloatArray, time: float) -> list[Choice]:
        """Straight ways, best first: free for the hand, not tried before, with a grip that holds, with room, easy."""
        ways = reachable_directions(target)
        if self._scene.free_way is not None:  # more closely where all may be free
            ways = np.vstack([ways, _around(*self._scene.free_way)])
        spec, rotation = self._scene.target, self._rotation
        axes = grips_of(spec.shape)
        directions = np.repeat(ways, len(axes), axis=0)
        grips = np.resize(axes, len(directions))
        turns = rolls(directions, grips, rotation)
        present = (pose[:3, 3] - target) / np.linalg.norm(pose[:3, 3] - target)
        from_base = np.linalg.norm((target + VIEW_DISTANCE * directions)[:, :2], axis=1)
        strain = 4.0 * np.maximum(0.0, ROBOT.arm.reach.folded - from_base) + 0.3 * np.abs(turns)
        flatness = np.maximum(0.0, np.where(grips < 0, _STEEP, _STEEP_TURNED) - np.arcsin(directions[:, 2]))
        # Flat fingers touch the table, so flatness costs more than the way.
        cost = np.arccos(np.clip(directions @ present, -1.0, 1.0)) + strain + 1.5 * flatness
        boxes = self._boxes(time)
        free = sum(free_directions(target, boxes, directions, margin, turns).astype(int) for margin in _MARGINS)
        wide = widths(directions, grips, rotation, spec.box.half_extent)[:, None] > ROBOT.hand.finger_span
        slanted = slants(directions, grips, rotation) > LARGEST_SLANT
        tried = np.zeros(len(directions), bool)
        for direction, grip in self._tried:
            tried |= (directions @ direction > math.cos(_ALIKE)) & (grips == grip)
        bad = slanted.astype(int) + tried + (spec.shape == "box") * wide.sum(axis=1)
        rank = (len(_MARGINS) + 1) * bad + len(_MARGINS) - free + _BARRED * (free == 0)
        return [(directions[way], int(grips[way])) for way in np.lexsort((cost, rank))]

    def _boxes(self, time: float) -> BoxSet:
        """Boxes around all places where something will be from now on."""
        boxes = [] if self._scene.distractor is None else [box_set([self._scene.distractor.box])]
        for obstacle in self._scene.obstacles:
            over = obstacle.motion is not None and time > obstacle.motion.end_s
            boxes.append(obstacle.last_boxes if over else obstacle.boxes)
        return joined(boxes)


class _GivenWay(PrivilegedPolicy):
    """Takes a way that was chosen."""

    def __init__(self, world: SimulatedWorld, way: Choice) -> None:
        self._way = way
        super().__init__(world)

    def choose(self, pose: FloatArray, target: FloatArray, time: float) -> Choice:
        return self._way


def _around(azimuth: float, elevation: float) -> FloatArray:
    """Unit vectors from target to camera, shape (n, 3), in base, close together around one; angles in rad."""
    rows = elevation + _NEARBY
    rows = rows[(rows >= ROBOT.arm.reach.lowest) & (rows <= ROBOT.arm.reach.highest)]
    return np.vstack([approach_directions(azimuth + _NEARBY / math.cos(row), np.array([row])) for row in rows])


def _rehearsed_room(world: SimulatedWorld, scene: SceneSpec, way: Choice, time: float, enough: float) -> float:
    """Least distance of the arm from obstacles from now to the lift, m; -1 if it does not get there in time.

    Args:
        world: as it is now; it does not change.
        scene: what stands in it.
        way: to rehearse.
        time: since reset, s.
        enough: the rehearsal ends early at a distance below this, or at a touch, m.
    """
    from fixation_gym.envs.rehearsal import Rehearsal

    sim = Rehearsal(world.sim)
    policy, room, period = _GivenWay(_World(sim, scene), way), math.inf, 1.0 / config.CONTROL_FREQUENCY
    while sim.target_rise() < config.LIFT_HEIGHT:
        if time > config.EPISODE_SECONDS - config.HOLD_SECONDS:
            return -1.0
        action = policy.act({"time": [time]})
        sim.step(action[:6] * ROBOT.arm.twist_limits, float(action[6]))
        time += period
        room = min(room, sim.clearance())
        if room < max(enough, 0.0):
            break
    return room
