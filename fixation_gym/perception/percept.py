"""What perception says after an observation."""

from __future__ import annotations

from dataclasses import dataclass

from fixation_gym.perception.body.upright_body import UprightBody
from fixation_gym.perception.detection.segmentation import Segmentation
from fixation_gym.perception.distance.pose_filter import Fixation
from fixation_gym.perception.flow.optic_flow import Flow
from fixation_gym.perception.hand_eye.hand_eye_filter import HandEyeState
from fixation_gym.perception.zero_flow.zero_flow import ZeroFlow
from fixation_gym.types import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Percept:
    """All that perception says after one observation."""

    time: float
    """Time of the observation, s; ``fixation`` belongs to it."""
    segmentation: Segmentation
    """Target in the newest image, which is of ``time`` unless it came late."""
    flow: Flow
    """Optic flow at the previous frame (``flow.time``)."""
    zfc: ZeroFlow
    """Zero-flow test at the previous frame: what is nearer than the fixated object."""
    fixation: Fixation
    """Where the fixated object is now."""
    T_base_flow: FloatArray
    """Camera pose in base at the time of ``flow`` and ``zfc``, one frame ago, shape (4, 4)."""
    body: UprightBody | None = None
    """The body whose surface is fixated; None while its centre is not sure."""
    hand_eye: HandEyeState | None = None
    """What was learnt of the hand-eye error; None if it is not learnt."""

    @property
    def centre_base(self) -> FloatArray:
        """Centre of the target in base, shape (3,), m: of its body if that is known, else the fixated point."""
        return self.fixation.point_base if self.body is None else self.body.centre

    def reach_towards(self, T_base_cam: FloatArray) -> float | None:
        """How far the target's body reaches from its centre towards a camera, m; None if the body is not known."""
        return None if self.body is None else self.body.reach(-T_base_cam[:3, 2])
