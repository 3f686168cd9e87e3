"""The robot as one value: everything takes it from ``ROBOT``.

To bring another arm, write its numbers in a file like ``panda.py`` and name them here.
"""

from fixation_gym.robots.model import Arm, Hand, Reach, RobotModel, Simulated, WorkSpace, WristCamera
from fixation_gym.robots.panda import PANDA

ROBOT: RobotModel = PANDA
"""The robot that perception, control, policies and environments work with."""

__all__ = ["PANDA", "ROBOT", "Arm", "Hand", "Reach", "RobotModel", "Simulated", "WorkSpace", "WristCamera"]
