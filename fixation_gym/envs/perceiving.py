"""The perception that an environment with its own uses."""

from __future__ import annotations

from fixation_gym.envs.config import Scenario
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.detection.box_tracker import BoxTracker
from fixation_gym.perception.pipeline import Perception
from fixation_gym.robots import ROBOT


def perception_for(scenario: Scenario, intrinsics: Intrinsics) -> Perception:
    """Perception that knows the table; where targets have any colour it follows what the first box shows."""
    detector = BoxTracker(intrinsics) if scenario.any_colour else None
    return Perception(intrinsics, support_height_m=ROBOT.workspace.table_height, detector=detector)
