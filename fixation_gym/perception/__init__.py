"""From images and camera poses to the fixated distance and the zero-flow map: NumPy, SciPy, OpenCV, numba."""

from fixation_gym.perception.detection.colour import RED, Colour, ColourDetector, segment
from fixation_gym.perception.detection.detector import Detector, GivenMasks
from fixation_gym.perception.detection.segmentation import Segmentation
from fixation_gym.perception.detection.tracking import Expectation
from fixation_gym.perception.distance.pose_filter import DistanceSettings, Fixation
from fixation_gym.perception.drawing import draw_overlay
from fixation_gym.perception.flow.optic_flow import Flow, FlowSettings
from fixation_gym.perception.percept import Percept
from fixation_gym.perception.pipeline import Perception
from fixation_gym.perception.settings import PerceptionSettings
from fixation_gym.perception.zero_flow.zero_flow import ZeroFlow, ZeroFlowSettings, obstacle_centre

__all__ = [
    "RED",
    "Colour",
    "ColourDetector",
    "Detector",
    "DistanceSettings",
    "Expectation",
    "Fixation",
    "Flow",
    "FlowSettings",
    "GivenMasks",
    "Percept",
    "Perception",
    "PerceptionSettings",
    "Segmentation",
    "ZeroFlow",
    "ZeroFlowSettings",
    "draw_overlay",
    "obstacle_centre",
    "segment",
]
