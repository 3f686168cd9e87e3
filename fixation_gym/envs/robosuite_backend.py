"""The only file that knows robosuite: its arm, gripper and table, with the object pool, as one MuJoCo model."""

from __future__ import annotations

import logging
import xml.etree.ElementTree as ET
from collections.abc import Callable
from typing import Any

from fixation_gym.envs import scene_mjcf
from fixation_gym.robots import ROBOT

# On import robosuite warns of optional parts (other robots, whole-body IK) that are not used here.
_disabled_before = logging.root.manager.disable
logging.disable(logging.WARNING)
from robosuite.models.arenas import TableArena  # noqa: E402
from robosuite.models.bases import robot_base_factory  # noqa: E402
from robosuite.models.grippers import gripper_factory  # noqa: E402
from robosuite.models.robots.robot_model import create_robot  # noqa: E402
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


def build_xml(extend: SceneExtension | None, looks: bool) -> str:
    """The robot at a table with the object pool, as MJCF.

    Of robosuite only the models are used. Its environments, controllers and bindings would build a second model of the
    robot, take ten times as long, and do not run with MuJoCo 3.10 or newer.

    Args:
        extend: adds an experiment's own things to the model.
        looks: with the meshes that only people look at; joints and contacts are the same without.
    """
    arena = TableArena(table_full_size=_TABLE_SIZE, table_offset=_TABLE_OFFSET)
    arena.set_origin([0, 0, 0])
    model = ManipulationTask(mujoco_arena=arena, mujoco_robots=[_robot()])
    scene_mjcf.add_materials(model.asset, lambda file: xml_path_completion(f"textures/{file}"))
    worldbody = model.worldbody
    hand = next(body for body in worldbody.iter("body") if body.get("name") == HAND_BODY)
    scene_mjcf.add_wrist_camera(hand)
    scene_mjcf.add_object_pool(worldbody)
    scene_mjcf.add_background(worldbody, _TABLE_OFFSET)
    if extend is not None:
        extend(model.asset, worldbody)
    scene_mjcf.draw_last(worldbody)
    if not looks:
        scene_mjcf.remove_looks(model.asset, worldbody, ROBOT_BODIES)
    ET.SubElement(model.contact, "exclude", {"body1": BASE_BODY, "body2": _FIRST_LINK})
    return model.get_xml()


def _robot() -> Any:
    """The arm on its base at the table, with its gripper."""
    robot = create_robot(ROBOT.simulated.robot, idn=0)
    robot.add_base(base=robot_base_factory(robot.default_base, idn=0))
    robot.update_joints()
    robot.update_actuators()
    gripper = gripper_factory(ROBOT.simulated.gripper, idn="0_right")  # pyright: ignore[reportArgumentType]
    robot.add_gripper(gripper, arm_name=robot.eef_name["right"])
    robot.set_base_xpos(robot.base_xpos_offset["table"](_TABLE_SIZE[0]))
    return robot


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
