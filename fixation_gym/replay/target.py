"""Which thing of a recording is the target, and who finds it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fixation_gym.errors import UsageError
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.detection.detector import Detector, GivenMasks
from fixation_gym.perception.detection.first_look import box_from_pixel
from fixation_gym.perception.detection.named import detector_named
from fixation_gym.perception.rectification import in_colour
from fixation_gym.recordings.recording import RecordedFrame
from fixation_gym.replay.config import ReplayConfig, parsed_target
from fixation_gym.types import FloatArray, ImageArray

_LEAST_BOX_PX = 3


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """Who finds the target in each picture."""

    detector: Detector
    found_by: str
    """In words, for the summary."""
    box: FloatArray | None
    """Around it in the first picture, shape (4,), px; None where nobody said."""
    masks: bool
    """Whether the detector takes the recording's masks."""


def choose_target(config: ReplayConfig, box: FloatArray | None, first: RecordedFrame, camera: Intrinsics) -> Target:
    """What the options ask for; without any, the recording's masks, or else its box.

    Args:
        config: with the options.
        box: of the recording itself, shape (4,), px.
        first: the first frame that is used.
        camera: of the pictures as they come.

    Raises:
        UsageError: if nothing says which thing is the target, or the box does not lie in the picture.
    """
    given = parsed_target(config.target)
    if given is not None:
        box = np.array(given if len(given) == 4 else _box_around(first.image(), given))
    if box is not None:
        _check_inside(box, camera, "--target" if given is not None else "the recording's target box")
    if config.detector is None and given is None and first.mask is not None:
        return Target(GivenMasks(), "masks of the recording", box, masks=True)
    if config.detector is None and box is None:
        raise UsageError(
            f"{config.recording} does not say which thing is the target; give --target x,y,w,h or x,y, or --detector"
        )
    name = config.detector or "box"
    return Target(detector_named(name)(camera.pinhole), name, box, masks=False)


def _check_inside(box: FloatArray, camera: Intrinsics, name: str) -> None:
    x, y, width, height = box.tolist()
    what, size = f"{name} {x:g},{y:g},{width:g},{height:g}", f"{camera.width} x {camera.height}"
    if x < 0 or y < 0 or x + width > camera.width or y + height > camera.height:
        raise UsageError(f"{what} reaches out of the first picture, which is {size} px")
    if min(width, height) < _LEAST_BOX_PX:
        raise UsageError(f"{what} must be {_LEAST_BOX_PX} x {_LEAST_BOX_PX} px at least")


def _box_around(image: ImageArray, pixel: tuple[float, ...]) -> FloatArray:
    """Box around the thing that a pixel shows."""
    x, y = pixel
    try:
        return box_from_pixel(in_colour(image), (x, y))
    except ValueError as error:
        raise UsageError(f"--target: {error}") from error
