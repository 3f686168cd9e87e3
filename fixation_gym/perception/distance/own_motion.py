"""The watch that the motion of the target's own pixels keeps on the distance from its centroid."""

from __future__ import annotations

import math
from collections import deque

from fixation_gym.geometry.twist import mean_twist
from fixation_gym.perception.distance.following import Frame
from fixation_gym.perception.distance.target_motion import InverseDepth, contradiction, target_inverse_depth
from fixation_gym.perception.flow.optic_flow import Flow
from fixation_gym.perception.zero_flow.zero_flow import widened_on_grid

MAX_GAP_S = 0.15
"""Frames farther apart than this say nothing together, s."""
_OWN_DEPTHS = 5
"""Frames over which the motion of the target's own pixels is believed."""
_COVERED_S = 1.0
"""For this time after something covered or uncovered the target its centroid is not to be trusted, s."""


class OwnMotion:
    """Remembers what the target's pixels said of its depth in the last frames, and when something covered it."""

    def __init__(self) -> None:
        """Start without a memory."""
        self._depths: deque[InverseDepth | None] = deque(maxlen=_OWN_DEPTHS)
        self._covered_time = -math.inf

    def note_frame(self, before: Frame | None, now: Frame, covering: bool) -> None:
        """Take in a frame, the one before, and whether something covers or uncovers the target."""
        if not now.segmentation.visible or (before is not None and now.time - before.time > MAX_GAP_S):
            self._depths.clear()
        self._covered_time = now.time if covering else self._covered_time

    def contradiction(
        self, believed: InverseDepth, flow: Flow, frames: tuple[Frame, Frame, Frame]
    ) -> InverseDepth | None:
        """Inverse depth by the target's own motion, if that contradicts what is believed, or is much surer; else None.

        Args:
            believed: inverse depth of the target in the middle frame, by its centroid.
            flow: at the middle frame.
            frames: the last three.
        """
        first, middle, last = frames
        twist = mean_twist(first.T_base_cam, last.T_base_cam, last.time - first.time)
        target = widened_on_grid(middle.segmentation.mask, flow.overlap.shape, 0)
        # None takes a place, too: what the motion said long ago is about another distance.
        self._depths.append(target_inverse_depth(flow, twist, target))
        recent = [own for own in self._depths if own is not None]
        own = contradiction(believed, recent, last.time - self._covered_time < _COVERED_S)
        if own is not None:
            self._depths.clear()
        return own
