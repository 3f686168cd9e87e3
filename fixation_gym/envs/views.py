"""What an environment shows of itself: pictures for the observation and for people, and MuJoCo's window."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fixation_gym.perception.drawing import draw_overlay
from fixation_gym.perception.percept import Percept
from fixation_gym.types import ImageArray

if TYPE_CHECKING:
    from fixation_gym.envs.pick_sim import PickSim
    from fixation_gym.envs.rendering import View, Window

_FRONT_SIZE = (360, 480)


class Views:
    """Views "observation", "wrist" and "front" and a window on a simulation, each opened at first use."""

    def __init__(self, size: tuple[int, int]) -> None:
        """Note the (height, width) of the wrist image, px; opens nothing."""
        self._size = size
        self._views: dict[str, View] = {}
        self._window: Window | None = None

    def view(self, name: str, sim: PickSim) -> View:
        """One of the views."""
        if name not in self._views:
            from fixation_gym.envs.rendering import View

            size = _FRONT_SIZE if name == "front" else self._size
            camera = "front" if name == "front" else "wrist"
            for_people = name != "observation"
            model = sim.display_model if for_people else sim.model
            self._views[name] = View(model, camera, *size, full_quality=for_people)
        return self._views[name]

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
        self._views = {}
        if self._window is not None:
            self._window.close()
            self._window = None


def overlay(rgb: ImageArray, percept: Percept | None, front: ImageArray) -> ImageArray:
    """The wrist image with what was perceived in it, as high as the front view, beside that."""
    wrist = draw_overlay(rgb, percept, scale=_FRONT_SIZE[0] / rgb.shape[0])
    return np.ascontiguousarray(np.hstack([wrist, front]))
