"""What an environment shows of itself: pictures and depth for the observation, pictures for people, a window."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fixation_gym.envs import depth_camera
from fixation_gym.envs.lens import through_lens, wide_pinhole
from fixation_gym.envs.memory import return_freed_memory
from fixation_gym.envs.sensor_noise import SensorNoise
from fixation_gym.envs.sensors import measure_image
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.drawing import draw_overlay
from fixation_gym.perception.percept import Percept
from fixation_gym.perception.rectification import as_grey
from fixation_gym.perception.scratch import Float32Array
from fixation_gym.types import FloatArray, ImageArray

if TYPE_CHECKING:
    from fixation_gym.envs.photoreal.view import PhotorealView
    from fixation_gym.envs.pick_sim import PickSim
    from fixation_gym.envs.rendering import View, Window
    from fixation_gym.envs.scene import SceneSpec

_FRONT_SIZE = (360, 480)


class Views:
    """Views "observation", "wide", "infrared", "wrist", "front" and a window on a simulation, opened at first use.

    "wide" is what the wrist camera's lens sees, which may be more than its pinhole; "infrared" is what the imagers of a
    depth camera see. All are MuJoCo's; only what is observed may be another renderer's.
    """

    def __init__(self, camera: Intrinsics, renderer: str = "mujoco") -> None:
        """Note the wrist camera and who makes what it sees; opens nothing."""
        self._camera, self._renderer = camera, renderer
        self._photoreal: dict[str, PhotorealView] = {}
        self._shown: dict[str, SceneSpec | None] = {}
        self._views: dict[str, View] = {}
        self._window: Window | None = None

    def view(self, name: str, sim: PickSim) -> View:
        """One of the views."""
        if name not in self._views:
            from fixation_gym.envs.rendering import View

            pinhole = self._pinhole(name)
            size = _FRONT_SIZE if name == "front" else (pinhole.height, pinhole.width)
            camera = "front" if name == "front" else "wrist"
            for_people = name in ("wrist", "front")
            model = sim.display_model if for_people else sim.model
            fovy = pinhole.fovy if name == "wide" else None
            self._views[name] = View(model, camera, *size, full_quality=for_people, fovy=fovy)
        return self._views[name]

    def _pinhole(self, name: str) -> Intrinsics:
        """Camera of one of the wrist's views."""
        if name == "infrared":
            return depth_camera.imager(self._camera.pinhole)
        return wide_pinhole(self._camera) if name == "wide" else self._camera

    def image(self, name: str, sim: PickSim, qpos: FloatArray) -> ImageArray:
        """What one of the views shows of a configuration."""
        return self.view(name, sim).render(qpos, with_reflections=sim.has_mirror)

    def light(self, sim: PickSim, rng: np.random.Generator, qpos: FloatArray) -> ImageArray:
        """What the wrist camera would see of a configuration at rest, through its lens, shape (H, W, 3).

        Rays that are followed at random get a seed from ``rng``.
        """
        name = "observation" if self._camera.lens is None else "wide"
        if self._renderer == "mitsuba":
            seen = self._traced(name, sim).render(qpos, seed=int(rng.integers(2**32)))
        else:
            seen = self.image(name, sim, qpos)
        return seen if self._camera.lens is None else through_lens(seen, self._camera)

    def depth(
        self, sim: PickSim, noise: SensorNoise, exposure: float, rng: np.random.Generator, qpos: FloatArray
    ) -> Float32Array:
        """What a depth camera would say of a configuration, shape (H, W), m, in pixels of the pinhole; 0: nothing.

        Args:
            sim: the simulation.
            noise: of its infrared pictures, which have that of the colour picture; they see all rows at once.
            exposure: factor on their grey levels.
            rng: of the noise.
            qpos: the configuration, shape (nq,).
        """
        pictures = (self._infrared(sim, rng, qpos, right_m) for right_m in (0.0, depth_camera.BASELINE_M))
        left, right = (measure_image(picture, noise, exposure, rng) for picture in pictures)
        return depth_camera.stereo_depth(left, right, self._camera.pinhole)

    def _infrared(self, sim: PickSim, rng: np.random.Generator, qpos: FloatArray, right_m: float) -> ImageArray:
        """What an imager beside the wrist camera sees, shape (H, W); only Mitsuba has a projector of dots."""
        if self._renderer == "mitsuba":
            return self._traced("infrared", sim).infrared(qpos, int(rng.integers(2**32)), right_m)
        seen = self.view("infrared", sim).render(qpos, with_reflections=sim.has_mirror, right_m=right_m)
        return as_grey(seen)

    def _traced(self, name: str, sim: PickSim) -> PhotorealView:
        """One of Mitsuba's views, "observation", "wide" or "infrared", of the present scene."""
        if name not in self._photoreal:
            from fixation_gym.envs.photoreal.view import PhotorealView

            dots_m = depth_camera.PROJECTOR_M if name == "infrared" else None
            self._photoreal[name] = PhotorealView(sim.model, self._pinhole(name), dots_m=dots_m)
        if self._shown.get(name) is not sim.scene:
            self._photoreal[name].load()
            self._shown[name] = sim.scene
        return self._photoreal[name]

    def show(self, sim: PickSim) -> None:
        """Show the current state in the window."""
        if self._window is None:
            from fixation_gym.envs.rendering import Window

            self._window = Window(sim.display_model)
        self._window.show(sim.data.qpos)

    def close(self) -> None:
        """Free GL contexts and the window; may be called twice. They are opened again at the next use."""
        for view in self._views.values():
            view.close()
        self._views, self._photoreal, self._shown = {}, {}, {}
        if self._window is not None:
            self._window.close()
            self._window = None
        return_freed_memory()


def overlay(rgb: ImageArray, percept: Percept | None, front: ImageArray) -> ImageArray:
    """The wrist image with what was perceived in it, as high as the front view, beside that."""
    wrist = draw_overlay(rgb, percept, scale=_FRONT_SIZE[0] / rgb.shape[0])
    return np.ascontiguousarray(np.hstack([wrist, front]))
