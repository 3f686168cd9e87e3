"""What a recording is: pictures of one camera with its pose at each, and perhaps some truth. Pictures load when asked.

A reader of one's own is a class called with the path of a recording; its objects have what ``Recording`` lists.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.scratch import Float32Array
from fixation_gym.types import FloatArray, ImageArray, MaskArray

RECORDING_METHODS = ("__iter__", "__len__")
"""What a class of one's own is checked for before it is called."""


@dataclass(frozen=True, slots=True, eq=False)
class RecordedFrame:
    """One picture, and what is known of it."""

    name: str
    """Where it comes from, for messages: a file, or a place in one."""
    time: float
    """Of the exposure, s; any origin."""
    image: Callable[[], ImageArray]
    """Loads the picture as the camera took it, shape (H, W, 3) RGB or (H, W) grey, uint8."""
    camera_pose: FloatArray | None = None
    """Pose of the optical frame in a fixed base, shape (7,): position in m, unit quaternion (w, x, y, z); None: not
    known."""
    joint_pos: FloatArray | None = None
    """Joint angles of the arm that carries the camera, shape (n,), rad."""
    mask: Callable[[], MaskArray] | None = None
    """Loads which pixels are the target, shape (H, W)."""
    depth: Callable[[], Float32Array] | None = None
    """Loads depths along the optical axis, shape (H, W), m; NaN where there is none."""
    distance_true_m: float | None = None
    """True depth of the target along the optical axis, m."""


class Recording(Protocol):
    """Frames in the order in which they were taken, with the camera that took them."""

    @property
    def camera(self) -> Intrinsics:
        """Of all pictures."""
        ...

    @property
    def target_box(self) -> FloatArray | None:
        """Box x, y, width, height around the target in the first picture, shape (4,), px; None: nobody said."""
        ...

    def __len__(self) -> int:
        """Number of frames."""
        ...

    def __iter__(self) -> Iterator[RecordedFrame]:
        """All frames from the first on."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class FrameList:
    """A recording whose frames are listed in advance, as the readers here make it."""

    camera: Intrinsics
    frames: Sequence[RecordedFrame]
    target_box: FloatArray | None = None

    def __len__(self) -> int:
        return len(self.frames)

    def __iter__(self) -> Iterator[RecordedFrame]:
        return iter(self.frames)
