"""From recorded frames to percepts, with what is true of each frame beside."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.percept import Percept
from fixation_gym.perception.pipeline import Perception
from fixation_gym.perception.rectification import Rectification, in_colour
from fixation_gym.perception.scratch import Float32Array
from fixation_gym.recordings.pictures import depth_over
from fixation_gym.recordings.recording import RecordedFrame
from fixation_gym.replay.target import Target
from fixation_gym.types import FloatArray, ImageArray, MaskArray, Observation


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """What is true of one frame, as the pinhole sees it."""

    rgb: ImageArray
    """Its picture, shape (H, W, 3)."""
    distance_m: float | None
    """Depth of the target: as the recording says it, or the median of its depth over its mask, or over what the
    detector found."""
    depth: Float32Array | None
    """Shape (H, W), m; NaN where there is none."""
    mask: MaskArray | None
    """Pixels of the target, shape (H, W)."""
    target: MaskArray
    """The same, or else what the detector found, shape (H, W)."""


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """One frame, what perception says after it, and what is true."""

    name: str
    rgb: ImageArray
    """As the pinhole sees it, shape (H, W, 3)."""
    camera_pose: FloatArray
    """Shape (7,)."""
    percept: Percept
    truth: Truth
    map_truth: Truth | None
    """Of the frame that flow and map belong to, which is the one before; None for the first frame."""
    perception_s: float
    """Time that perception took, s."""


class Straightener:
    """Takes the lens out of all that a camera records."""

    def __init__(self, camera: Intrinsics) -> None:
        """Compute the maps, if the camera has a lens."""
        self._rectification = None if camera.lens is None else Rectification(camera)

    def image(self, image: ImageArray) -> ImageArray:
        """A picture as the pinhole sees it, shape (H, W, 3)."""
        image = in_colour(image)
        return image if self._rectification is None else self._rectification.image(image)

    def mask(self, frame: RecordedFrame) -> MaskArray | None:
        """A frame's mask, shape (H, W)."""
        if frame.mask is None:
            return None
        return frame.mask() if self._rectification is None else self._rectification.mask(frame.mask())

    def depth(self, frame: RecordedFrame) -> Float32Array | None:
        """A frame's depth, shape (H, W), m."""
        if frame.depth is None:
            return None
        return frame.depth() if self._rectification is None else self._rectification.depth(frame.depth())

    def box(self, box: FloatArray | None) -> FloatArray | None:
        """A box, shape (4,), px."""
        return box if box is None or self._rectification is None else self._rectification.box(box)

    def unseen(self) -> MaskArray | None:
        """Where the pinhole sees nothing, shape (H, W); None: nowhere."""
        return None if self._rectification is None else self._rectification.unseen(None)


def looks(
    frames: Iterable[RecordedFrame],
    perception: Perception,
    target: Target,
    straightener: Straightener,
    before: Truth | None = None,
) -> Iterator[Look]:
    """Perceive frames one after the other.

    Args:
        frames: in order, each with a pose.
        perception: of the pinhole; it was reset, or has seen the frames before.
        target: whose detector it has.
        straightener: of the camera.
        before: of the frame before the first; None: there is none.

    Raises:
        UsageError: if a frame's file cannot be read.
    """
    box = straightener.box(target.box)
    for frame in frames:
        assert frame.camera_pose is not None
        rgb, mask = straightener.image(frame.image()), straightener.mask(frame)
        given = (np.zeros(rgb.shape[:2], np.bool_) if mask is None else mask) if target.masks else None
        started = time.perf_counter()
        percept = perception.update(Observation.of_camera(frame.time, rgb, frame.camera_pose, box, given))
        took = time.perf_counter() - started
        truth = _truth(frame, rgb, mask, straightener.depth(frame), percept)
        yield Look(frame.name, rgb, frame.camera_pose, percept, truth, before, took)
        before = truth


def _truth(
    frame: RecordedFrame, rgb: ImageArray, mask: MaskArray | None, depth: Float32Array | None, percept: Percept
) -> Truth:
    target = percept.segmentation.mask if mask is None else mask
    distance = frame.distance_true_m
    if distance is None and depth is not None:
        distance = depth_over(target, depth)
    return Truth(rgb, distance, depth, mask, target)
