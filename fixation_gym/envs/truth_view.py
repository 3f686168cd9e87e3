# pyright: reportAttributeAccessIssue=false
# (MuJoCo's functions have no type stubs.)
"""What is truly nearer than the fixated object: the map of privileged observations, from rendered depth."""

from __future__ import annotations

import atexit
from typing import Any

import cv2
import mujoco
import numpy as np

from fixation_gym.envs import scene_mjcf
from fixation_gym.envs.contacts import OBSTACLE, geom_owners
from fixation_gym.perception.evidence_map import CELLS
from fixation_gym.types import FloatArray, ImageArray

_SIDE = 4 * CELLS
"""Pixels along the shorter side of the view."""
_AWAY = (0.0, 0.0, -100.0)


class TruthView:
    """Depth of the obstacles as the wrist camera would see them without glass, mirrors, target or table.

    A see-through thing counts as solid; of a mirror its own surface counts. Create lazily: it owns a GL context.
    """

    def __init__(self, model: Any, height: int, width: int) -> None:
        """Open a GL context.

        Args:
            model: compiled ``mjModel``.
            height: rows of the wrist image, px; only the ratio to ``width`` counts.
            width: its columns, px.
        """
        scale = _SIDE / min(height, width)
        size = (round(scale * height), round(scale * width))
        model.vis.quality.offsamples = 0
        model.vis.global_.offheight, model.vis.global_.offwidth = size
        self._renderer = mujoco.Renderer(model, *size)
        self._renderer.enable_depth_rendering()
        self._owners = geom_owners(model, ())
        self._option = mujoco.MjvOption()
        self._option.sitegroup[:] = 0
        self._option.geomgroup[:] = 0
        self._option.geomgroup[scene_mjcf.VISIBLE_GROUP] = 1
        self._option.flags[mujoco.mjtVisFlag.mjVIS_STATIC] = 0
        atexit.register(self.close)  # before EGL shuts down, as in ``rendering``

    def depth(self, data: Any) -> FloatArray:
        """Depth of the nearest obstacle along the optical axis in the view of the wrist image, m; far without one.

        Returns:
            Shape (h, w), float32; the shorter side has 128 px.
        """
        scene = self._renderer.scene
        mujoco.mj_camlight(self._renderer.model, data)
        self._renderer.update_scene(data, scene_mjcf.CAMERA_NAME, self._option)
        for geom in scene.geoms[: scene.ngeom]:
            if geom.objtype != mujoco.mjtObj.mjOBJ_GEOM or self._owners[geom.objid] != OBSTACLE:
                geom.pos[:] = _AWAY
        scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
        scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
        return self._renderer.render()

    def close(self) -> None:
        """Free the GL context; may be called twice."""
        atexit.unregister(self.close)
        self._renderer.close()


def nearer_map(depth: FloatArray, distance: float) -> ImageArray:
    """Share of each cell that shows something nearer than ``distance`` m, times 255, shape (32, 32)."""
    nearer = (depth < distance).astype(np.float32)
    return np.rint(255.0 * cv2.resize(nearer, (CELLS, CELLS), interpolation=cv2.INTER_AREA)).astype(np.uint8)
