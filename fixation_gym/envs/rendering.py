# pyright: reportAttributeAccessIssue=false
# (MuJoCo's functions have no type stubs.)
"""Pictures of the simulation: the wrist camera's image and the front view."""

from __future__ import annotations

import math
import os
import sys
from typing import Any

import cv2
import mujoco
import numpy as np

from fixation_gym.envs import scene_mjcf
from fixation_gym.envs.offscreen import Offscreen
from fixation_gym.types import FloatArray, ImageArray

_WALL_TOP, _FARTHEST_WALL = 2.95, 5.2
"""Height of the room's walls, and how far a wall can be from a camera on the arm, m."""


class View:
    """One camera of the model, rendered off screen at a fixed size. Create lazily: it owns a GL context.

    Any thread may render, one at a time.
    """

    def __init__(
        self,
        model: Any,
        camera: str,
        height: int,
        width: int,
        *,
        full_quality: bool,
        supersampling: int = 2,
        fovy: float | None = None,
    ) -> None:
        """Open a GL context.

        Args:
            model: compiled ``mjModel``.
            camera: name of the camera.
            height: image rows, px.
            width: image columns, px.
            full_quality: with robot and shadows, for people; otherwise what the wrist camera needs.
            supersampling: pixels rendered per pixel of the image along each side; 1 is faster and enough where all
                edges of interest are inside textures.
            fovy: vertical field of view, rad; None: that of the camera in the model.

        Raises:
            RuntimeError: in a process forked from one that has rendered, where GL would wait for ever.
        """
        # Perception needs anti-aliasing: without it static edges flicker and read as motion. In software GL, twice the
        # resolution averaged down costs less than four samples per pixel.
        self._size = (height, width)
        fine = (supersampling * height, supersampling * width)
        # The context takes these from the model; a larger buffer costs time in every frame.
        model.vis.global_.offheight, model.vis.global_.offwidth = fine
        model.vis.quality.offsamples = 0
        model.vis.quality.shadowsize = 1024
        if not full_quality:  # boxes are lit at corners of so many quads along a side: more show in highlights only
            model.vis.quality.numquads = min(model.vis.quality.numquads, 2)
        self._renderer = Offscreen(model, *fine, nearest_texels=supersampling > 1)
        self._pixels = np.empty((*fine, 3), np.uint8)
        self._model = model
        # Images are taken of a copy, so that an exposure before the end of the period leaves the physics untouched.
        self._data = mujoco.MjData(model)
        self._fixed_lights = np.flatnonzero(model.light_bodyid == 0)
        self._camera = camera
        self._option = mujoco.MjvOption()
        self._option.sitegroup[:] = 0
        self._option.geomgroup[:] = 0
        self._option.geomgroup[scene_mjcf.VISIBLE_GROUP] = 1
        self._full_quality = full_quality
        self._camera_id = model.camera(camera).id
        self._fovy_deg = float(model.cam_fovy[self._camera_id]) if fovy is None else math.degrees(fovy)
        self._border = _border_rays(math.radians(self._fovy_deg), width / height)

    @property
    def renderer(self) -> Offscreen:
        """Lent to other pictures of the same size: a GL context of their own would copy all meshes and textures."""
        return self._renderer

    def render(self, qpos: FloatArray, *, with_reflections: bool, right_m: float = 0.0) -> ImageArray:
        """Image of the configuration, shape (H, W, 3), top-left origin.

        Args:
            qpos: of the model.
            with_reflections: whether mirrors show any.
            right_m: how far to the right of the camera it is taken, m.
        """
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, self._data)
        # Every scene has its own light; MuJoCo 4 computes once what does not move.
        self._data.light_xdir[self._fixed_lights] = self._model.light_dir[self._fixed_lights]
        mujoco.mj_camlight(self._model, self._data)
        rightwards = self._data.cam_xmat[self._camera_id].reshape(3, 3)[:, 0]
        self._data.cam_xpos[self._camera_id] += right_m * rightwards
        # The robot is behind its wrist camera; only a mirror shows it, where a coarse one does.
        self._option.geomgroup[scene_mjcf.ROBOT_GROUP] = int(self._full_quality)
        self._option.geomgroup[scene_mjcf.STAND_IN_GROUP] = int(with_reflections and not self._full_quality)
        own, self._model.cam_fovy[self._camera_id] = self._model.cam_fovy[self._camera_id], self._fovy_deg
        self._renderer.update_scene(self._data, self._camera, self._option)
        self._model.cam_fovy[self._camera_id] = own  # the model is shared by all views
        flags = self._renderer.scene.flags
        flags[mujoco.mjtRndFlag.mjRND_SHADOW] = int(self._full_quality)
        flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = int(with_reflections)
        # The sky costs a millisecond even where it is hidden. A mirror may show it from anywhere.
        flags[mujoco.mjtRndFlag.mjRND_SKYBOX] = int(self._full_quality or with_reflections or self._looks_up())
        self._renderer.upload_textures()
        self._renderer.render(out=self._pixels)
        height, width = self._size
        return np.asarray(cv2.resize(self._pixels, (width, height), interpolation=cv2.INTER_AREA), np.uint8)

    def _looks_up(self) -> bool:
        """Whether part of the image may show what is above the walls."""
        upwards = self._data.cam_xmat[self._camera_id].reshape(3, 3)[2]
        slope = (_WALL_TOP - self._data.cam_xpos[self._camera_id, 2]) / _FARTHEST_WALL
        return bool(np.max(self._border @ upwards) > slope / math.hypot(1.0, slope))

    def close(self) -> None:
        """Free the GL context; may be called twice."""
        self._renderer.close()


def _border_rays(fovy: float, aspect: float) -> FloatArray:
    """Unit vectors to corners and middles of the sides of the image, shape (8, 3), in MuJoCo's camera frame."""
    half = math.tan(0.5 * fovy)
    rays = [(x * aspect * half, y * half, -1.0) for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y]
    return np.array(rays) / np.linalg.norm(rays, axis=1, keepdims=True)


class Window:
    """MuJoCo's interactive viewer on a running simulation."""

    def __init__(self, model: Any) -> None:
        """Open the window on a model, an ``mjModel``.

        Raises:
            RuntimeError: without a display.
        """
        if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
            raise RuntimeError('render_mode="human" needs a display; without one use render_mode="rgb_array"')
        import mujoco.viewer

        self._model, self._data = model, mujoco.MjData(model)
        self._viewer = mujoco.viewer.launch_passive(model, self._data)
        self._viewer.opt.geomgroup[:] = 0
        self._viewer.opt.geomgroup[[scene_mjcf.VISIBLE_GROUP, scene_mjcf.ROBOT_GROUP]] = 1

    def show(self, qpos: FloatArray) -> None:
        """Show a configuration."""
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, self._data)
        self._viewer.sync()

    def close(self) -> None:
        """Close the window; may be called twice."""
        self._viewer.close()
