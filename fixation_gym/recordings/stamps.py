"""Which frames of a recording can be used in order, and what is wrong with the times of the others."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from fixation_gym.errors import UsageError
from fixation_gym.recordings.recording import RecordedFrame


@dataclass(frozen=True, slots=True, eq=False)
class OrderedFrames:
    """Frames whose times increase, each with a pose."""

    frames: list[RecordedFrame]
    duplicates: int
    """Frames that were left out: their time is that of another ..."""
    backwards: int
    """... or it is out of order ..."""
    without_pose: int
    """... or their pose is not known."""

    def gaps(self, longest_s: float) -> list[float]:
        """Times between neighbours that are longer than ``longest_s``, s."""
        steps = (b.time - a.time for a, b in zip(self.frames, self.frames[1:], strict=False))
        return [step for step in steps if step > longest_s]


def in_order(frames: Iterable[RecordedFrame], name: str) -> OrderedFrames:
    """Leave out as few frames as possible, so that all have a pose and times increase.

    Args:
        frames: as they were recorded.
        name: of the recording, for the message.

    Raises:
        UsageError: if no frame has a pose.
    """
    frames = list(frames)
    posed = [frame for frame in frames if frame.camera_pose is not None]
    if not posed:
        raise UsageError(f"{name}: none of its {len(frames)} frames has a camera pose")
    kept = [posed[index] for index in _longest_increasing([frame.time for frame in posed])]
    times = {frame.time for frame in kept}
    again = sum(frame.time in times for frame in posed) - len(kept)
    return OrderedFrames(kept, again, len(posed) - len(kept) - again, len(frames) - len(posed))


def _longest_increasing(times: Sequence[float]) -> list[int]:
    """Indices of a longest strictly increasing subsequence, so that one wrong time costs one frame (patience sorting).

    Of equal times the first stays.
    """
    ends: list[float] = []  # smallest last time of a subsequence of each length
    last: list[int] = []  # and its index
    before: list[int] = []
    for index, time in enumerate(times):
        length = bisect_left(ends, time)
        before.append(last[length - 1] if length else -1)
        if length == len(ends):
            ends.append(time)
            last.append(index)
        elif time < ends[length]:
            ends[length], last[length] = time, index
    chain = []
    index = last[-1]
    while index >= 0:
        chain.append(index)
        index = before[index]
    return chain[::-1]
