"""What is learnt of the hand-eye error while a robot gazes, and poses that are corrected by it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fixation_gym.geometry.rigid import inverse
from fixation_gym.geometry.twist import adjoint, mean_twist
from fixation_gym.perception.distance.following import Frame
from fixation_gym.perception.flow.optic_flow import Flow
from fixation_gym.perception.hand_eye.hand_eye_filter import (
    HandEyeSettings,
    HandEyeState,
    SurfaceView,
    first_state,
    learned,
)
from fixation_gym.types import FloatArray, MaskArray


class HandEye:
    """Learns from one picture after the other; poses stay as they are until there surely is an error."""

    def __init__(self, settings: HandEyeSettings | None) -> None:
        """Start without knowledge; without settings nothing is ever learnt."""
        self._settings = settings
        self.state: HandEyeState | None = None
        self.reset()

    def reset(self) -> None:
        """Forget what was learnt: the camera may have been mounted again."""
        self.state = None if self._settings is None else first_state(self._settings)

    def true_pose(self, T_base_cam: FloatArray) -> FloatArray:
        """A measured pose, shape (4, 4), corrected."""
        return T_base_cam @ self.state.T_believed_true if self.state is not None and self.state.proven else T_base_cam

    def true_twist(self, twist: FloatArray) -> FloatArray:
        """A measured twist, shape (6,), as one of the true camera."""
        if self.state is None or not self.state.proven:
            return twist
        return adjoint(inverse(self.state.T_believed_true)) @ twist

    def learn(
        self, frames: Sequence[Frame], flow: Flow, usable: MaskArray, height_m: float, distance_m: float
    ) -> list[Frame]:
        """Learn from how the support surface moves.

        Args:
            frames: the three that the flow is of, with poses that were corrected as ``true_pose`` does now.
            flow: at the middle one.
            usable: pixels that show neither target nor robot, shape (h, w).
            height_m: of the surface in base, m.
            distance_m: of the target, m.

        Returns:
            The frames with poses that are corrected by what is known now.
        """
        if self.state is None or self._settings is None:
            return list(frames)
        first, middle, last = frames
        duration = last.time - first.time
        believed = [frame.T_base_cam for frame in frames]
        warp_twist = twist = mean_twist(believed[0], believed[2], duration)
        if self.state.proven:
            back = inverse(self.state.T_believed_true)
            believed = [T @ back for T in believed]
            twist = mean_twist(believed[0], believed[2], duration)
        seen = SurfaceView(
            flow=flow,
            usable=usable,
            T_base_believed=believed[1],
            twist=twist,
            warp_twist=warp_twist,
            height_m=height_m,
            since_s=last.time - middle.time,
            target=middle.segmentation.centroid,
            distance_m=distance_m,
        )
        self.state = learned(self.state, seen, self._settings)
        if not self.state.proven:
            return list(frames)
        return [replace(frame, T_base_cam=self.true_pose(T)) for frame, T in zip(frames, believed, strict=True)]
