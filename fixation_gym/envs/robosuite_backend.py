"""The only file that knows robosuite: its arm, gripper and table, with the object pool, as one MuJoCo model."""

from __future__ import annotations

import gc
import logging
import xml.etree.ElementTree as ET
from collections.abc import Callable
from typing import Any

from fixation_gym.envs import scene_mjcf
from fixation_gym.robots import ROBOT

# On import robosuite warns of optional parts (other robots, whole-body IK) that are not used here.
_disabled_before = logging.root.manager.disable
logging.disable(logging.WARNING)
from robosuite.environments.manipulation.manipulation_env import ManipulationEnv  # noqa: E402
from robosuite.models.arenas import TableArena  # noqa: E402
from robosuite.models.tasks import ManipulationTask  # noqa: E402
from robosuite.utils.log_utils import ROBOSUITE_DEFAULT_LOGGER  # noqa: E402
from robosuite.utils.mjcf_utils import xml_path_completion  # noqa: E402

logging.disable(_disabled_before)
ROBOSUITE_DEFAULT_LOGGER.setLevel(logging.ERROR)

_TABLE_SIZE = (0.8, 0.8, 0.05)
_TABLE_OFFSET = (0.0, 0.0, 0.8)
ROBOT_BODIES = ("robot0_", "gripper0_", "fixed_mount0_")
"""Beginnings of the names of the robot's bodies."""
_FIRST_LINK = f"robot0_{ROBOT.simulated.first_link}"
BASE_BODY, HAND_BODY = f"robot0_{ROBOT.simulated.base}", "robot0_right_hand"
SceneExtension = Callable[[ET.Element, ET.Element], None]
"""Adds an experiment's own things to the MJCF elements ``asset`` and ``worldbody``."""


class _Scene(ManipulationTask):
    """Arena and robot as one model."""

    def generate_id_mappings(self, sim: Any) -> None:
        """Nothing here uses robosuite's segmentation, which asks for geoms that ``remove_looks`` takes out."""


class _FixationPickTask(ManipulationEnv):
    """robosuite task: the robot at a table with the object pool. Only builds the model; ``PickSim`` steps it."""

    def __init__(self, extend: SceneExtension | None, looks: bool, **options: Any) -> None:
        self._extend, self._looks = extend, looks  # the base class loads the model
        super().__init__(**options)

    def _load_model(self) -> None:
        super()._load_model()
        robot = self.robots[0].robot_model
        robot.set_base_xpos(robot.base_xpos_offset["table"](_TABLE_SIZE[0]))
        arena = TableArena(table_full_size=_TABLE_SIZE, table_offset=_TABLE_OFFSET)
        arena.set_origin([0, 0, 0])
        self.model = _Scene(mujoco_arena=arena, mujoco_robots=[robot])
        scene_mjcf.add_materials(self.model.asset, lambda file: xml_path_completion(f"textures/{file}"))
        worldbody = self.model.worldbody
        hand = next(body for body in worldbody.iter("body") if body.get("name") == HAND_BODY)
        scene_mjcf.add_wrist_camera(hand)
        scene_mjcf.add_object_pool(worldbody)
        scene_mjcf.add_background(worldbody, _TABLE_OFFSET)
        if self._extend is not None:
            self._extend(self.model.asset, worldbody)
        scene_mjcf.draw_last(worldbody)
        if not self._looks:
            scene_mjcf.remove_looks(self.model.asset, worldbody, ROBOT_BODIES)
        ET.SubElement(self.model.contact, "exclude", {"body1": BASE_BODY, "body2": _FIRST_LINK})

    def reward(self, action: Any = None) -> float:
        """Rewards are the business of the Gymnasium environment."""
        return 0.0


def build_model(control_frequency: int, extend: SceneExtension | None, looks: bool) -> tuple[Any, Any]:
    """Build and compile the task.

    Args:
        control_frequency: steps per second.
        extend: adds an experiment's own things to the model.
        looks: with the meshes that only people look at; joints and contacts are the same without.

    Returns:
        ``mjModel`` and ``mjData``.
    """
    task: Any = _FixationPickTask(
        extend,
        looks,
        robots=ROBOT.simulated.robot,
        gripper_types=ROBOT.simulated.gripper,
        has_offscreen_renderer=False,
        use_camera_obs=False,
        hard_reset=False,
        control_freq=control_frequency,
        initialization_noise=None,
    )
    model, data = task.sim.model._model, task.sim.data._data
    # robosuite's objects refer to each other in circles: until Python looks for those, they would hold this model and a
    # second one of the robot, together some 100 MB for every environment made.
    del task
    gc.collect()
    return model, data


def make_lift(control_frequency: int, image_size: int | None, hard_reset: bool = True) -> Any:
    """Robosuite's own ``Lift`` with the wrist camera's square image, or without; the benchmark's peer."""
    from robosuite.environments.manipulation.lift import Lift

    seeing = image_size is not None
    size = image_size or 1
    return Lift(
        robots="Panda",
        control_freq=control_frequency,
        horizon=10**9,
        hard_reset=hard_reset,
        has_offscreen_renderer=seeing,
        use_camera_obs=seeing,
        camera_names="robot0_eye_in_hand",
        camera_heights=size,
        camera_widths=size,
    )
