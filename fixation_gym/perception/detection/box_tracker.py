"""Follow whatever a box in the first image shows, of any colour and texture."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.detection.colour_model import confusion
from fixation_gym.perception.detection.coloured_shape import ColouredShape, first_shape
from fixation_gym.perception.detection.detector import Sighting
from fixation_gym.perception.detection.first_look import box_filled, checked_box, cut_out
from fixation_gym.perception.detection.flat_patch import FlatPatch, first_patch
from fixation_gym.perception.detection.picture import picture_of
from fixation_gym.perception.detection.shape_settings import ShapeSettings
from fixation_gym.perception.detection.tracking import Expectation
from fixation_gym.types import MaskArray, Observation


@dataclass(frozen=True, slots=True)
class BoxTrackerSettings:
    """How things are followed."""

    width: int = 320
    """Larger images are halved until they are no wider, px."""
    surroundings: float = 0.8
    """What lies within this share of the box around it is compared with what it holds."""
    confusion: float = 0.2
    """If more pixels than this share are on the wrong side by their colours, the box is followed as a flat pattern."""
    stills_s: float = 0.2
    """Images farther apart than this are stills, in which a flat pattern is found more surely than colours, s."""
    shape: ShapeSettings = field(default_factory=ShapeSettings)
    """Of what its colours tell from its surroundings."""


class BoxTracker:
    """Follows the thing that ``target_box`` of the first observation names. State: what is known of it."""

    def __init__(self, intrinsics: Intrinsics, settings: BoxTrackerSettings | None = None) -> None:
        """Prepare for the images of a camera."""
        self._full, self._settings = intrinsics, settings or BoxTrackerSettings()
        self._camera = intrinsics.halved(self._settings.width)
        self.reset()

    def reset(self) -> None:
        """Forget what the target looks like."""
        self._known: ColouredShape | FlatPatch | None = None
        self._pattern: FlatPatch | None = None  # for stills, until it is found in one

    def detect(self, observation: Observation, expected: Expectation) -> MaskArray | Sighting:
        """Pixels of the target, shape (H, W); none while it is lost.

        Raises:
            ValueError: if the first observation has no box, or one that lies outside the image or around nothing.
        """
        shape = observation.rgb.shape[:2]
        picture = picture_of(observation, self._camera)
        if self._known is None:
            box = checked_box(observation.target_box, self._full)
            if not self._resized(box_filled(shape, box)).any():
                size = f"{self._camera.width} x {self._camera.height}"
                raise ValueError(f"target_box must hold more than a pixel of the image at {size}, got {list(box)}")
            mask = cut_out(observation.rgb, box, self._settings.surroundings)
            if not self._resized(mask).any():
                mask = box_filled(shape, box)
            self._time = observation.time
            if confusion(picture.rgb, self._resized(mask)) < self._settings.confusion:
                self._known = first_shape(picture, self._resized(mask), self._settings.shape)
                self._pattern = first_patch(picture, self._resized(mask))
            else:
                mask = box_filled(shape, box)
                self._known = first_patch(picture, self._resized(mask))
            return mask
        stills = observation.time - self._time > self._settings.stills_s
        self._time = observation.time
        if self._pattern is not None and stills and isinstance(self._pattern.followed(picture)[1], Sighting):
            self._known, self._pattern = self._pattern, None
        if not stills:
            self._pattern = None
        if isinstance(self._known, FlatPatch):
            self._known, found = self._known.followed(picture)
        else:
            self._known, found = self._known.followed(picture, expected)
        if isinstance(found, Sighting):
            return replace(found, mask=_enlarged(found.mask, shape))
        return _enlarged(found, shape)

    def _resized(self, mask: MaskArray) -> MaskArray:
        size = (self._camera.width, self._camera.height)
        if mask.shape[::-1] == size:
            return mask
        return cv2.resize(mask.view(np.uint8) * 255, size, interpolation=cv2.INTER_AREA) > 127


def _enlarged(mask: MaskArray, shape: tuple[int, int]) -> MaskArray:
    return mask if mask.shape == shape else cv2.resize(mask.view(np.uint8) * 255, shape[::-1]) > 127
