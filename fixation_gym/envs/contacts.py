# pyright: reportAttributeAccessIssue=false
# (MuJoCo's functions have no type stubs.)
"""Whether the robot hits an obstacle or the table, and how near it came."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from fixation_gym.compiled import compiled
from fixation_gym.envs.config import COLLISION_FORCE, TABLE_FORCE
from fixation_gym.types import FloatArray

OTHER, ROBOT, OBSTACLE, TABLE = 0, 1, 2, 3
"""Owners of geoms. The whole arm is the robot; a red object that is not the target is an obstacle, too."""
_TABLE_BODY = "table"
LARGEST_CLEARANCE = 0.5
"""Distances are not measured beyond this, m; it is also the clearance of a scene without obstacles."""

Owners = NDArray[np.int64]


def geom_owners(model: Any, robot_bodies: tuple[str, ...]) -> Owners:
    """Owner of every geom of the model, shape (ngeom,); ``robot_bodies`` are beginnings of body names."""
    owners = np.full(model.ngeom, OTHER, dtype=np.int64)
    for geom in range(model.ngeom):
        body = model.body(model.geom_bodyid[geom]).name
        if body.startswith(robot_bodies):
            owners[geom] = ROBOT
        elif body.startswith(("obstacle", "distractor")):
            owners[geom] = OBSTACLE
        elif body == _TABLE_BODY:
            owners[geom] = TABLE
    return owners


def robot_hits(model: Any, data: Any, owners: Owners) -> bool:
    """Whether the robot touches an obstacle with more than ``COLLISION_FORCE``, or the table with ``TABLE_FORCE``.

    The fingers may touch the table lightly: a thing that lies flat is grasped there.
    """
    if data.ncon == 0:
        return False
    geoms = data.contact.geom
    if not _any_touch(geoms, owners):
        return False
    force = np.zeros(6)
    pairs = owners[geoms].prod(axis=1)
    for contact in np.flatnonzero((pairs == ROBOT * OBSTACLE) | (pairs == ROBOT * TABLE)):
        mujoco.mj_contactForce(model, data, int(contact), force)
        limit = COLLISION_FORCE if pairs[contact] == ROBOT * OBSTACLE else TABLE_FORCE
        if np.linalg.norm(force[:3]) > limit:
            return True
    return False


@compiled
def _any_touch(geoms: Owners, owners: Owners) -> bool:
    """Whether one of the pairs of geoms, (n, 2), is of robot and obstacle or table; asked at every physics substep."""
    for pair in range(len(geoms)):
        product = owners[geoms[pair, 0]] * owners[geoms[pair, 1]]
        if product == ROBOT * OBSTACLE or product == ROBOT * TABLE:
            return True
    return False


def colliding_geoms(model: Any, owners: Owners) -> tuple[Owners, Owners]:
    """Geoms of the robot and of the obstacles that have contacts in the present scene."""
    collides = model.geom_contype + model.geom_conaffinity > 0
    robot, obstacle = (np.flatnonzero((owners == owner) & collides) for owner in (ROBOT, OBSTACLE))
    return robot, obstacle


def clearance(model: Any, data: Any, robot: Owners, obstacle: Owners) -> float:
    """Smallest distance between geoms of the robot and of the obstacles, m; 0 or below in contact.

    It is at most ``LARGEST_CLEARANCE``.
    """
    nearest = LARGEST_CLEARANCE
    if not len(obstacle):
        return nearest
    gaps = _gaps(data.geom_xpos, model.geom_rbound, robot, obstacle)
    for flat in np.argsort(gaps, axis=None).tolist():
        i, j = divmod(flat, len(obstacle))
        if gaps[i, j] >= nearest:  # bounding spheres: all that follow are farther
            break
        nearest = min(nearest, _geom_distance(model, data, int(robot[i]), int(obstacle[j]), nearest))
    return nearest


@compiled
def _gaps(positions: FloatArray, radii: FloatArray, first: Owners, second: Owners) -> FloatArray:
    """Distances between bounding spheres of geoms, shape (len(first), len(second)), m."""
    gaps = np.empty((len(first), len(second)))
    for i, a in enumerate(first):
        for j, b in enumerate(second):
            x, y, z = positions[a] - positions[b]
            gaps[i, j] = np.sqrt(x * x + y * y + z * z) - radii[a] - radii[b]
    return gaps


def _geom_distance(model: Any, data: Any, first: int, second: int, largest: float) -> float:
    distance = mujoco.mj_geomDistance(model, data, first, second, largest, None)
    if distance == 0.0:
        # MuJoCo 3.9's own convex routine says exactly 0 for some pairs that are far apart; libccd does not.
        flags = model.opt.disableflags
        model.opt.disableflags = flags | mujoco.mjtDisableBit.mjDSBL_NATIVECCD
        distance = mujoco.mj_geomDistance(model, data, first, second, largest, None)
        model.opt.disableflags = flags
    return float(distance)
