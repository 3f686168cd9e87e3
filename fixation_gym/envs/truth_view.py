# pyright: reportAttributeAccessIssue=false
# (MuJoCo's functions have no type stubs.)
"""What the simulator knows about every pixel of the wrist camera: depth, which thing it shows, what mirrors show.

For experiments that score perception. See-through things count as surfaces; a second depth leaves them out. A mirror
counts as a surface, too; what it reflects is found by following the reflected rays through the model.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from fixation_gym.envs import scene_mjcf
from fixation_gym.envs.offscreen import Offscreen
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.types import FloatArray, MaskArray

GeomArray = NDArray[np.int32]
NOTHING = -1


@dataclass(frozen=True, eq=False)
class Truth:
    """One frame; every array has shape (h, w). Depths are along the optical axis, m."""

    depth: FloatArray
    """Of the nearest surface, see-through or mirror included."""
    geom: GeomArray
    """Index of its geom in the model, ``NOTHING`` for none."""
    depth_behind_glass: FloatArray
    """The same without see-through things."""
    image_depth: FloatArray
    """On a mirror's face, depth of the virtual image: path of the ray by way of the mirror; NaN elsewhere."""
    image_geom: GeomArray
    """What is reflected there; ``NOTHING`` elsewhere."""


class TruthView:
    """Renders the truth of the wrist camera at a fixed size. Create lazily: it owns a GL context."""

    def __init__(self, model: Any, intrinsics: Intrinsics, mirror_material: str = "mirror_glass") -> None:
        """Open a GL context.

        Args:
            model: compiled ``mjModel``.
            intrinsics: of the pixels; the field of view must be that of the wrist camera.
            mirror_material: name of the reflecting material.
        """
        height, width = intrinsics.height, intrinsics.width
        model.vis.global_.offheight, model.vis.global_.offwidth = height, width
        model.vis.quality.offsamples = 0
        self._renderer = Offscreen(model, height, width)
        self._model, self._data = model, mujoco.MjData(model)
        self._camera = model.camera(scene_mjcf.CAMERA_NAME).id
        self._option = mujoco.MjvOption()
        self._option.sitegroup[:] = 0
        self._option.geomgroup[:] = 0
        self._option.geomgroup[scene_mjcf.VISIBLE_GROUP] = 1
        self._mirror_material = model.mat(mirror_material).id
        x, y = intrinsics.grid
        self._rays = np.stack([x, -y, -np.ones_like(x)], axis=-1)  # MuJoCo's cameras look along -z, y up

    def look(self, qpos: FloatArray) -> Truth:
        """Truth of a configuration."""
        model, data = self._model, self._data
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        mujoco.mj_camlight(model, data)
        visible = model.geom_group == scene_mjcf.VISIBLE_GROUP
        glass = np.flatnonzero(visible & (model.geom_rgba[:, 3] < 1.0))
        geom = self._segment()
        depth = self._depth()
        behind = depth
        if glass.size:
            model.geom_group[glass] = scene_mjcf.HIDDEN_GROUP
            behind = self._depth()
            model.geom_group[glass] = scene_mjcf.VISIBLE_GROUP
        mirrors = np.flatnonzero(model.geom_matid == self._mirror_material)  # a scene decides which parts they are
        image_depth, image_geom = self._reflected(geom, mirrors)
        return Truth(depth, geom, behind, image_depth, image_geom)

    def _update(self) -> None:
        self._renderer.update_scene(self._data, self._camera, self._option)
        scene = self._renderer.scene
        for index in range(scene.ngeom):
            scene.geoms[index].rgba[3] = 1.0  # what is see-through is blended and has no depth of its own
            scene.geoms[index].reflectance = 0.0

    def _depth(self) -> FloatArray:
        self._renderer.enable_depth_rendering()
        self._update()
        depth = self._renderer.render().astype(np.float64)
        self._renderer.disable_depth_rendering()
        return depth

    def _segment(self) -> GeomArray:
        self._renderer.enable_segmentation_rendering()
        self._update()
        found = self._renderer.render()
        self._renderer.disable_segmentation_rendering()
        is_geom = found[..., 1] == int(mujoco.mjtObj.mjOBJ_GEOM)
        return np.where(is_geom, found[..., 0], NOTHING).astype(np.int32)

    def _reflected(self, geom: GeomArray, mirrors: NDArray[np.intp]) -> tuple[FloatArray, GeomArray]:
        """Depth and geom of what mirrors show, by following rays; also sees the robot's stand-in, as images do."""
        depth, shown = np.full(geom.shape, np.nan), np.full(geom.shape, NOTHING, np.int32)
        mirror_pixels: MaskArray = np.isin(geom, mirrors)
        if not mirror_pixels.any():
            return depth, shown
        data, groups = self._data, np.zeros(mujoco.mjNGROUP, np.uint8)
        groups[[scene_mjcf.VISIBLE_GROUP, scene_mjcf.STAND_IN_GROUP]] = 1
        rotation, eye = data.cam_xmat[self._camera].reshape(3, 3), data.cam_xpos[self._camera]
        hit = np.zeros(1, np.int32)
        for row, column in np.argwhere(mirror_pixels):
            mirror = geom[row, column]
            normal = data.geom_xmat[mirror].reshape(3, 3)[:, 2]  # MuJoCo reflects on a box's local +z face
            face = data.geom_xpos[mirror] + normal * self._model.geom_size[mirror, 2]
            ray = rotation @ self._rays[row, column]
            if ray @ normal >= 0.0:
                continue
            there = float((face - eye) @ normal / (ray @ normal))  # in units of depth
            reflected = ray - 2.0 * (ray @ normal) * normal
            start = eye + there * ray + 1e-4 * normal
            length = mujoco.mj_ray(self._model, data, start, reflected, groups, 1, -1, hit)
            if length > 0.0:
                depth[row, column], shown[row, column] = there + length, hit[0]
        return depth, shown

    def close(self) -> None:
        """Free the GL context; may be called twice."""
        self._renderer.close()
