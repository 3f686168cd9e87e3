"""The door for detectors: whoever can say which pixels of an image are the target."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.detection.segmentation import Segmentation, segmentation_of
from fixation_gym.perception.detection.tracking import Expectation
from fixation_gym.strangers import whose_code
from fixation_gym.types import FloatArray, MaskArray, Observation


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """A mask, and where one and the same point of the target is, from a detector that follows one."""

    mask: MaskArray
    """Pixels of the target, shape (H, W), bool."""
    point: FloatArray
    """Normalised image coordinates of that point, shape (2,); taken in place of the mean of the mask."""
    point_std: float
    """Standard deviation of each coordinate."""


class Detector(Protocol):
    """Says which pixels of an image are the target."""

    def reset(self) -> None:
        """Forget the last episode."""
        ...

    def detect(self, observation: Observation, expected: Expectation) -> MaskArray | Sighting:
        """Find the target in one image.

        Args:
            observation: with the image ``rgb``, shape (H, W, 3), uint8, which must be left as it is.
            expected: where the target should be, by what was seen of it before and how the camera moved since.

        Returns:
            Pixels of the target, shape (H, W), bool; all False if it is not in the image. Or a ``Sighting``.
        """
        ...


class GivenMasks:
    """Takes the target's mask from the observation: somebody else has found it."""

    def reset(self) -> None:
        """Nothing is kept between images."""

    def detect(self, observation: Observation, expected: Expectation) -> MaskArray:
        """The mask of the observation.

        Raises:
            ValueError: if it has none.
        """
        if observation.mask is None:
            raise ValueError("the observation has no mask; give it one (all False while the target is not seen)")
        return observation.mask


def detected(
    detector: Detector, observation: Observation, expected: Expectation, intrinsics: Intrinsics
) -> Segmentation:
    """What a detector finds, checked and measured.

    Raises:
        ValueError: if its mask is none of the image.
        RuntimeError: from whatever the detector raised, naming whose code it was.
    """
    with whose_code("detector", detector) as name:
        found = detector.detect(observation, expected)
    mask = found.mask if isinstance(found, Sighting) else found
    expects = f"the detector {name} must return a bool array of shape {(intrinsics.height, intrinsics.width)}"
    if not isinstance(mask, np.ndarray):
        raise ValueError(f"{expects}, got {type(mask).__name__}")
    if mask.dtype != np.bool_ or mask.shape != (intrinsics.height, intrinsics.width):
        raise ValueError(f"{expects}, got {mask.dtype} of shape {mask.shape}")
    seen = segmentation_of(mask.copy(), intrinsics)  # which makes it read-only
    if not (seen.visible and isinstance(found, Sighting)):
        return seen
    point = np.array(found.point, np.float64)
    if point.shape != (2,) or not (np.isfinite(point).all() and 0.0 < found.point_std < math.inf):
        raise ValueError(
            f"the detector {name} must give a finite point and std, got {found.point} and {found.point_std}"
        )
    return replace(seen, centroid=point, centroid_std=float(found.point_std))
