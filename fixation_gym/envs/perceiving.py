"""The perception that an environment with its own uses."""

from __future__ import annotations

from fixation_gym.envs.config import Scenario
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.detection.box_tracker import BoxTracker
from fixation_gym.perception.pipeline import Perception
from fixation_gym.robots import ROBOT


def perception_for(scenario: Scenario, intrinsics: Intrinsics) -> Perception:
    """Perception that knows the table; where targets are not red it follows what the first box shows."""
    detector = None if scenario.red_target else BoxTracker(intrinsics)
    return Perception(intrinsics, support_height_m=ROBOT.workspace.table_height, detector=detector)
