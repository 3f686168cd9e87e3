# pyright: reportAttributeAccessIssue=false
# (MuJoCo's functions have no type stubs.)
"""The compiled model of the pick task, once for physics and the wrist camera, once for people."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from fixation_gym.envs import contacts, scene_mjcf
from fixation_gym.envs.task_mjcf import ROBOT_BODIES, SceneExtension, build_xml


@dataclass(frozen=True, eq=False)
class TaskModel:
    """Model, its data, and the body that every geom belongs to."""

    model: Any
    """``mjModel``."""
    data: Any
    """``mjData``."""
    owners: contacts.Owners
    """Owner of every geom, as in ``contacts``."""


def compile_model(extend: SceneExtension | None = None, *, looks: bool = False) -> TaskModel:
    """Build and compile the model.

    Args:
        extend: adds an experiment's own things to the model.
        looks: with the robot's looks, for pictures for people. Without them the robot is seen by its coarse stand-ins,
            the collision shapes, and only in a mirror; ``qpos`` means the same in both.
    """
    model = _compiled(build_xml(extend, looks))
    mirror = model.mat("mirror_glass").id
    model.mat_reflectance[np.arange(model.nmat) != mirror] = 0.0
    # Pool shapes are resized at reset, the mid-phase's bounding trees are not. Nobody reads robosuite's sensors.
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE | mujoco.mjtDisableBit.mjDSBL_SENSOR
    # Parked and resting objects sleep until something touches them. MuJoCo's contacts of a cylinder with a box rattle
    # at up to 0.5 mm/s and 10 mrad/s; with its usual tolerance of 0.1 mm/s no cylinder would ever rest.
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP
    model.opt.sleep_tolerance = 1e-3
    owners = contacts.geom_owners(model, ROBOT_BODIES)
    for geom in np.flatnonzero(owners == contacts.ROBOT):
        if model.geom_group[geom] == scene_mjcf.VISIBLE_GROUP:
            model.geom_group[geom] = scene_mjcf.ROBOT_GROUP
        else:
            model.geom_group[geom] = scene_mjcf.STAND_IN_GROUP
            model.geom_rgba[geom] = (0.85, 0.86, 0.88, 1.0)
    for leg in range(1, 5):  # under the table, from where neither wrist camera nor mirror can see them
        model.geom(f"table_leg{leg}_visual").group = scene_mjcf.ROBOT_GROUP
    return TaskModel(model, mujoco.MjData(model), owners)


def _compiled(mjcf: str) -> Any:
    """The model of a text, without what MuJoCo keeps beside it: 60 MB.

    ``MjModel.from_xml_string`` keeps what it read last, and a cache has the decoded files of textures and meshes.
    """
    model = mujoco.MjSpec.from_string(mjcf).compile()
    mujoco.mj_clearCache(mujoco.mj_getCache())
    return model
