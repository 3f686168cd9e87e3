"""Detectors by name, for the command line."""

from __future__ import annotations

from collections.abc import Callable

from fixation_gym.errors import UsageError
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.detection.box_tracker import BoxTracker
from fixation_gym.perception.detection.colour import ColourDetector
from fixation_gym.perception.detection.detector import Detector
from fixation_gym.perception.detection.mean_shift import MeanShiftDetector
from fixation_gym.strangers import is_class_name, load_class

DETECTORS: dict[str, Callable[[Intrinsics], Detector]] = {
    "colour": ColourDetector,
    "mean_shift": MeanShiftDetector,
    "box": BoxTracker,
}
"""What has the target's colour, the same followed in the image, and what the first box shows."""
DETECTOR_METHODS = ("reset", "detect")


def detector_named(name: str) -> Callable[[Intrinsics], Detector]:
    """What makes the detector of that name, one of ``DETECTORS`` or ``module:Class``, for a camera.

    Raises:
        UsageError: if there is none; the message says what is allowed.
    """
    if name in DETECTORS:
        return DETECTORS[name]
    if not is_class_name(name):
        raise UsageError(f"unknown detector '{name}'; choose one of {', '.join(DETECTORS)}, or module:Class")
    return load_class(name, "--detector", DETECTOR_METHODS)
