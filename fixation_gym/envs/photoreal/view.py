# pyright: reportAttributeAccessIssue=false
# (MuJoCo's functions have no type stubs.)
"""What the wrist camera and the imagers of a depth camera see by Mitsuba, of the same state as ``rendering.View``."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from fixation_gym.envs import scene_mjcf
from fixation_gym.envs.photoreal import build, engine
from fixation_gym.envs.photoreal.materials import Material, srgb
from fixation_gym.envs.photoreal.solids import Solid, solids_of, texture_image
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.types import FloatArray, ImageArray

SAMPLES = 16
"""Rays per pixel."""
_FIRST_SAMPLES = 4
"""The same for colours and normals of the first surfaces, which keep textures and edges sharp when noise is removed."""
_INFRARED_EXPOSURE = 0.4
"""Of infrared pictures: dots come on top of the other light."""
_MITSUBA_AXES = np.diag([-1.0, 1.0, -1.0])
"""Mitsuba's camera axes (x left, y up, z forward) in MuJoCo's (x right, y up, z backward)."""


class PhotorealView:
    """Renders the wrist camera of a model at a fixed size. A scene is built once, then its things are moved."""

    def __init__(self, model: Any, pinhole: Intrinsics, samples: int = SAMPLES, dots_m: float | None = None) -> None:
        """Load Mitsuba.

        Args:
            model: compiled ``mjModel``.
            pinhole: of the pictures.
            samples: rays per pixel.
            dots_m: how far to the right of the camera its projector of dots is, m; None: there is none.

        Raises:
            MissingMitsubaError: if it is not installed.
        """
        self._mitsuba, self._denoiser = engine.load(), engine.load_denoiser()
        self._first = self._mitsuba.load_dict({"type": "aov", "aovs": "albedo:albedo,normal:sh_normal"})
        self._model, self._data = model, mujoco.MjData(model)
        self._pinhole, self._samples, self._dots_m = pinhole, samples, dots_m
        self._camera = model.camera(scene_mjcf.CAMERA_NAME).id
        self._materials: dict[Material, Any] = {}
        self._solids: list[Solid] = []
        self._poses: list[tuple[FloatArray, FloatArray]] = []
        self._scene: Any = None
        self._parameters: Any = None

    @property
    def scene(self) -> Any:
        """Mitsuba's scene as it was last rendered, for experiments that follow rays of their own."""
        return self._scene

    @property
    def bodies(self) -> list[int]:
        """Index in the model of the body that each shape "solid<i>" of the scene belongs to."""
        return [solid.body for solid in self._solids]

    def load(self) -> None:
        """Take over what the model shows. Call it after a scene has been loaded into the model."""
        self._scene = None

    def render(self, qpos: FloatArray, seed: int) -> ImageArray:
        """Image of the configuration, shape (H, W, 3), top-left origin.

        Args:
            qpos: of the model.
            seed: of the random paths of light, within 0..2^32-1; equal seeds give equal images.
        """
        self._look(qpos)
        noisy = np.array(self._mitsuba.render(self._scene, seed=seed, spp=self._samples))
        first = np.array(self._mitsuba.render(self._scene, seed=seed, spp=_FIRST_SAMPLES, integrator=self._first))
        albedo, normal = (np.ascontiguousarray(first[..., place : place + 3]) for place in (0, 3))
        clean = self._denoiser.denoise(noisy, hdr=True, albedo=albedo, normal=normal)
        return np.rint(255.0 * srgb(clean)).astype(np.uint8)

    def infrared(self, qpos: FloatArray, seed: int, right_m: float = 0.0) -> ImageArray:
        """Grey picture of the configuration, shape (H, W), as a depth camera's imager sees it.

        What rays at random leave of noise stays in it: removing that would remove dots as well.

        Args:
            qpos: of the model.
            seed: as in ``render``.
            right_m: how far to the right of the camera the imager is, m.
        """
        self._look(qpos, right_m)
        noisy = np.array(self._mitsuba.render(self._scene, seed=seed, spp=self._samples))
        return np.rint(255.0 * srgb(_INFRARED_EXPOSURE * noisy.mean(axis=-1))).astype(np.uint8)

    def _look(self, qpos: FloatArray, right_m: float = 0.0) -> None:
        """Bring the scene to a configuration, and the camera to some place beside the wrist's."""
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        if self._scene is None:
            self._build()
        self._move(right_m)

    def _build(self) -> None:
        model, mitsuba = self._model, self._mitsuba
        self._solids = solids_of(model)
        self._poses = [self._pose(solid) for solid in self._solids]
        # Textures are large: those of the last scene are kept as far as this one shows them.
        used = {solid.material for solid in self._solids}
        self._materials = {kind: self._materials.get(kind) or self._material(kind) for kind in used}
        shapes = {
            f"solid{i}": build.shape(mitsuba, solid.mesh.placed(*pose), self._materials[solid.material])
            for i, (solid, pose) in enumerate(zip(self._solids, self._poses, strict=True))
        }
        size = (self._pinhole.height, self._pinhole.width)
        sensor = build.camera(mitsuba, self._camera_pose(), self._pinhole.fovy, size, self._samples)
        projector = None
        if self._dots_m is not None:
            projector = build.dots(mitsuba, self._camera_pose(self._dots_m), self._pinhole.fovy, size)
        table = self._data.geom_xpos[model.geom("table_visual").id]
        self._scene = build.scene(mitsuba, sensor, shapes, model.light_dir[0], table, projector)
        self._parameters = mitsuba.traverse(self._scene)

    def _move(self, right_m: float) -> None:
        moved = {}
        for index, solid in enumerate(self._solids):
            pose, before = self._pose(solid), self._poses[index]
            # Exactly: a picture must not depend on those before it. What rests sleeps, and does not change at all.
            if not all(np.array_equal(now, then) for now, then in zip(pose, before, strict=True)):
                self._poses[index] = pose
                moved[f"solid{index}."] = solid.mesh.placed(*pose)
        places = {"sensor": right_m}
        if self._dots_m is not None:
            places[build.PROJECTOR] = self._dots_m
        for name, right in places.items():
            pose = self._parameters[f"{name}.to_world"]
            self._parameters[f"{name}.to_world"] = type(pose)(self._camera_pose(right))
        build.move(self._parameters, moved)

    def _pose(self, solid: Solid) -> tuple[FloatArray, FloatArray]:
        return self._data.xmat[solid.body].reshape(3, 3).copy(), self._data.xpos[solid.body].copy()

    def _camera_pose(self, right_m: float = 0.0) -> FloatArray:
        """Pose in world of a camera so far to the right of the wrist's, in Mitsuba's axes."""
        pose = np.eye(4)
        pose[:3, :3] = self._data.cam_xmat[self._camera].reshape(3, 3) @ _MITSUBA_AXES
        pose[:3, 3] = self._data.cam_xpos[self._camera] - right_m * pose[:3, 0]
        return pose

    def _material(self, kind: Material) -> Any:
        image = texture_image(self._model, kind) if kind.texture >= 0 else None
        return build.material(self._mitsuba, kind, image)
