"""The only file that knows robosuite: its arm, gripper and table as MJCF, and its own task as the benchmark's peer.

Of robosuite only the models are used. Its environments, controllers and bindings would build a second model of the
robot, take ten times as long, and do not run with MuJoCo 3.10 or newer.
"""

from __future__ import annotations

import logging
from typing import Any

from fixation_gym.robots import ROBOT
from fixation_gym.types import Vector

# On import robosuite warns of optional parts (other robots, whole-body IK) that are not used here.
_disabled_before = logging.root.manager.disable
logging.disable(logging.WARNING)
from robosuite.models.arenas import TableArena  # noqa: E402
from robosuite.models.bases import robot_base_factory  # noqa: E402
from robosuite.models.grippers import gripper_factory  # noqa: E402
from robosuite.models.robots.robot_model import create_robot  # noqa: E402
from robosuite.models.tasks import ManipulationTask  # noqa: E402
from robosuite.utils.log_utils import ROBOSUITE_DEFAULT_LOGGER  # noqa: E402

logging.disable(_disabled_before)
ROBOSUITE_DEFAULT_LOGGER.setLevel(logging.ERROR)


def robot_at_table(table_size: Vector, table_top: Vector) -> str:
    """MJCF of the robot at its table, with absolute paths of meshes and textures.

    Args:
        table_size: full size of the table's board, m.
        table_top: middle of its upper face in MuJoCo's world, m.
    """
    arena = TableArena(table_full_size=table_size, table_offset=table_top)
    arena.set_origin([0, 0, 0])
    return ManipulationTask(mujoco_arena=arena, mujoco_robots=[_robot(table_size[0])]).get_xml()


def _robot(table_length: float) -> Any:
    """The arm on its base at the table, with its gripper."""
    robot = create_robot(ROBOT.simulated.robot, idn=0)
    robot.add_base(base=robot_base_factory(robot.default_base, idn=0))
    robot.update_joints()
    robot.update_actuators()
    gripper = gripper_factory(ROBOT.simulated.gripper, idn="0_right")  # pyright: ignore[reportArgumentType]
    robot.add_gripper(gripper, arm_name=robot.eef_name["right"])
    robot.set_base_xpos(robot.base_xpos_offset["table"](table_length))
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
