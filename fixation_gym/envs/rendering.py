# pyright: reportAttributeAccessIssue=false
# (MuJoCo's functions have no type stubs.)
"""Pictures of the simulation: the wrist camera's image and the front view."""

from __future__ import annotations

import atexit
import os
import sys
from typing import Any

import cv2
import mujoco
import numpy as np

from fixation_gym.envs import scene_mjcf
from fixation_gym.types import FloatArray, ImageArray


class View:
    """One camera of the model, rendered off screen at a fixed size. Create lazily: it owns a GL context."""

    def __init__(
        self, model: Any, camera: str, height: int, width: int, *, full_quality: bool, supersampling: int = 2
    ) -> None:
        """Open a GL context.

        Args:
            model: compiled ``mjModel``.
            camera: name of the camera.
            height: image rows, px.
            width: image columns, px.
            full_quality: with robot and shadows, for people; otherwise what the wrist camera needs.
            supersampling: pixels rendered per pixel of the image along each side, without ``full_quality``; 1 is faster
                and enough where all edges of interest are inside textures.
        """
        # Perception needs anti-aliasing: without it static edges flicker and read as motion. In software GL, twice the
        # resolution averaged down costs less than four samples per pixel; people get both samples and shadows.
        self._size = (height, width)
        factor = 1 if full_quality else supersampling
        fine = (factor * height, factor * width)
        # The context takes these from the model; a larger buffer costs time in every frame.
        model.vis.global_.offheight, model.vis.global_.offwidth = fine
        model.vis.quality.offsamples = 4 if full_quality else 0
        model.vis.quality.shadowsize = 1024
        self._renderer = mujoco.Renderer(model, *fine)
        self._pixels = np.empty((*fine, 3), np.uint8)
        self._model = model
        # Images are taken of a copy, so that an exposure before the end of the period leaves the physics untouched.
        self._data = mujoco.MjData(model)
        self._camera = camera
        self._option = mujoco.MjvOption()
        self._option.sitegroup[:] = 0
        self._option.geomgroup[:] = 0
        self._option.geomgroup[scene_mjcf.VISIBLE_GROUP] = 1
        self._full_quality = full_quality
        # Freed before EGL shuts down, which MuJoCo registered when it made the context; later, EGL complains.
        atexit.register(self.close)

    @property
    def renderer(self) -> mujoco.Renderer:
        """Lent to other pictures of the same size: a GL context of their own would copy all meshes and textures."""
        return self._renderer

    def render(self, qpos: FloatArray, *, with_reflections: bool) -> ImageArray:
        """Image of the configuration, shape (H, W, 3), top-left origin."""
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        # The robot is behind its wrist camera; only a mirror shows it, where a coarse one does.
        self._option.geomgroup[scene_mjcf.ROBOT_GROUP] = int(self._full_quality)
        self._option.geomgroup[scene_mjcf.STAND_IN_GROUP] = int(with_reflections and not self._full_quality)
        self._renderer.update_scene(self._data, self._camera, self._option)
        flags = self._renderer.scene.flags
        flags[mujoco.mjtRndFlag.mjRND_SHADOW] = int(self._full_quality)
        flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = int(with_reflections)
        self._renderer.render(out=self._pixels)
        height, width = self._size
        if self._full_quality:
            return self._pixels.copy()
        return np.asarray(cv2.resize(self._pixels, (width, height), interpolation=cv2.INTER_AREA), np.uint8)

    def close(self) -> None:
        """Free the GL context; may be called twice."""
        atexit.unregister(self.close)
        self._renderer.close()


class Window:
    """MuJoCo's interactive viewer on a running simulation."""

    def __init__(self, model: Any, data: Any) -> None:
        """Open the window.

        Raises:
            RuntimeError: without a display.
        """
        if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
            raise RuntimeError('render_mode="human" needs a display; without one use render_mode="rgb_array"')
        import mujoco.viewer

        self._viewer = mujoco.viewer.launch_passive(model, data)
        self._viewer.opt.geomgroup[:] = 0
        self._viewer.opt.geomgroup[[scene_mjcf.VISIBLE_GROUP, scene_mjcf.ROBOT_GROUP]] = 1

    def sync(self) -> None:
        """Show the present state."""
        self._viewer.sync()

    def close(self) -> None:
        """Close the window; may be called twice."""
        self._viewer.close()
