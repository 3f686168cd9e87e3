"""What an environment shows of itself: pictures for the observation and for people, and MuJoCo's window."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fixation_gym.envs.lens import through_lens, wide_pinhole
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.drawing import draw_overlay
from fixation_gym.perception.percept import Percept
from fixation_gym.types import FloatArray, ImageArray

if TYPE_CHECKING:
    from fixation_gym.envs.photoreal.view import PhotorealView
    from fixation_gym.envs.pick_sim import PickSim
    from fixation_gym.envs.rendering import View, Window
    from fixation_gym.envs.scene import SceneSpec

_FRONT_SIZE = (360, 480)


class Views:
    """Views "observation", "wide", "wrist" and "front" and a window on a simulation, each opened at first use.

    "wide" is what the wrist camera's lens sees, which may be more than its pinhole. All are MuJoCo's; only what is
    observed may be another renderer's.
    """

    def __init__(self, camera: Intrinsics, renderer: str = "mujoco") -> None:
        """Note the wrist camera and who makes what it sees; opens nothing."""
        self._camera, self._renderer = camera, renderer
        self._photoreal: PhotorealView | None = None
        self._shown: SceneSpec | None = None
        self._views: dict[str, View] = {}
        self._window: Window | None = None

    def view(self, name: str, sim: PickSim) -> View:
        """One of the views."""
        if name not in self._views:
            from fixation_gym.envs.rendering import View

            pinhole = wide_pinhole(self._camera) if name == "wide" else self._camera
            size = _FRONT_SIZE if name == "front" else (pinhole.height, pinhole.width)
            camera = "front" if name == "front" else "wrist"
            for_people = name in ("wrist", "front")
            model = sim.display_model if for_people else sim.model
            fovy = pinhole.fovy if name == "wide" else None
            self._views[name] = View(model, camera, *size, full_quality=for_people, fovy=fovy)
        return self._views[name]

    def image(self, name: str, sim: PickSim, qpos: FloatArray) -> ImageArray:
        """What one of the views shows of a configuration."""
        return self.view(name, sim).render(qpos, with_reflections=sim.has_mirror)

    def light(self, sim: PickSim, rng: np.random.Generator, qpos: FloatArray) -> ImageArray:
        """What the wrist camera would see of a configuration at rest, through its lens, shape (H, W, 3).

        Rays that are followed at random get a seed from ``rng``.
        """
        if self._renderer == "mitsuba":
            seen = self._traced(sim).render(qpos, seed=int(rng.integers(2**32)))
        else:
            seen = self.image("observation" if self._camera.lens is None else "wide", sim, qpos)
        return seen if self._camera.lens is None else through_lens(seen, self._camera)

    def _traced(self, sim: PickSim) -> PhotorealView:
        """Mitsuba's view of the present scene."""
        if self._photoreal is None:
            from fixation_gym.envs.photoreal.view import PhotorealView

            pinhole = self._camera if self._camera.lens is None else wide_pinhole(self._camera)
            self._photoreal = PhotorealView(sim.model, pinhole)
        if self._shown is not sim.scene:
            self._photoreal.load()
            self._shown = sim.scene
        return self._photoreal

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
        self._views, self._photoreal = {}, None
        if self._window is not None:
            self._window.close()
            self._window = None


def overlay(rgb: ImageArray, percept: Percept | None, front: ImageArray) -> ImageArray:
    """The wrist image with what was perceived in it, as high as the front view, beside that."""
    wrist = draw_overlay(rgb, percept, scale=_FRONT_SIZE[0] / rgb.shape[0])
    return np.ascontiguousarray(np.hstack([wrist, front]))
