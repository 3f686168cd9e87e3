# pyright: reportAttributeAccessIssue=false
# (MuJoCo's functions have no type stubs.)
"""What is truly nearer than the fixated object: the map of privileged observations, from rendered depth."""

from __future__ import annotations

from typing import Any

import cv2
import mujoco
import numpy as np

from fixation_gym.envs import scene_mjcf
from fixation_gym.envs.contacts import OBSTACLE, geom_owners
from fixation_gym.envs.rendering import View
from fixation_gym.perception.zero_flow.evidence_map import CELLS
from fixation_gym.types import FloatArray, ImageArray

_AWAY = (0.0, 0.0, -100.0)


class ObstacleDepth:
    """Depth of the obstacles as the wrist camera would see them without glass, mirrors, target or table.

    A see-through thing counts as solid; of a mirror its own surface counts.
    """

    def __init__(self, view: View, model: Any) -> None:
        """Borrow a view's GL context: each context holds a copy of all meshes and textures.

        Args:
            view: of the wrist camera.
            model: compiled ``mjModel``.
        """
        self._renderer = view.renderer
        self._owners = geom_owners(model, ())
        self._option = mujoco.MjvOption()
        self._option.sitegroup[:] = 0
        self._option.geomgroup[:] = 0
        self._option.geomgroup[scene_mjcf.VISIBLE_GROUP] = 1
        self._option.flags[mujoco.mjtVisFlag.mjVIS_STATIC] = 0

    def nearer(self, data: Any, distance: float) -> ImageArray:
        """What is nearer than ``distance`` m, as ``nearer_map``, in the current state of the simulation."""
        return nearer_map(self.depth(data), distance)

    def depth(self, data: Any) -> FloatArray:
        """Depth of the nearest obstacle along the optical axis, m; far where there is none.

        Returns:
            Shape (h, w), float32: the size that the view renders at, before it averages pixels.
        """
        scene = self._renderer.scene
        mujoco.mj_camlight(self._renderer.model, data)
        self._renderer.update_scene(data, scene_mjcf.CAMERA_NAME, self._option)
        for geom in scene.geoms[: scene.ngeom]:
            if geom.objtype != mujoco.mjtObj.mjOBJ_GEOM or self._owners[geom.objid] != OBSTACLE:
                geom.pos[:] = _AWAY
        scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
        scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
        self._renderer.enable_depth_rendering()
        depth = self._renderer.render()
        self._renderer.disable_depth_rendering()
        return depth


class PictureTruth:
    """What a picture truly showed, for judging maps: depth of the obstacles, and of the target."""

    def __init__(self, view: View, model: Any) -> None:
        """Borrow the GL context of a view of the wrist camera without a lens."""
        self._obstacles = ObstacleDepth(view, model)
        self._model, self._data = model, mujoco.MjData(model)
        self._camera, self._target = model.camera(scene_mjcf.CAMERA_NAME).id, model.body("target").id

    def look(self, qpos: FloatArray) -> tuple[FloatArray, float]:
        """Depth of the nearest obstacle, shape (h, w), m, as in ``ObstacleDepth``, and of the target's centre, m."""
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, self._data)
        depth = self._obstacles.depth(self._data)
        optical_axis = -self._data.cam_xmat[self._camera].reshape(3, 3)[:, 2]
        offset = self._data.xpos[self._target] - self._data.cam_xpos[self._camera]
        return depth, float(optical_axis @ offset)


def nearer_map(depth: FloatArray, distance: float) -> ImageArray:
    """Share of each cell that shows something nearer than ``distance`` m, times 255, shape (32, 32)."""
    nearer = (depth < distance).astype(np.float32)
    return np.rint(255.0 * cv2.resize(nearer, (CELLS, CELLS), interpolation=cv2.INTER_AREA)).astype(np.uint8)
