"""Settings of all stages of perception in one value."""

from __future__ import annotations

from dataclasses import dataclass, field

from fixation_gym.perception.body.target_centre import CentreSettings
from fixation_gym.perception.detection.colour import RED, Colour
from fixation_gym.perception.detection.tracking import TrackingSettings
from fixation_gym.perception.distance.pose_filter import DistanceSettings
from fixation_gym.perception.flow.gradients import FlowSettings
from fixation_gym.perception.hand_eye.hand_eye_filter import HandEyeSettings
from fixation_gym.perception.zero_flow.zero_flow import ZeroFlowSettings


@dataclass(frozen=True, slots=True)
class PerceptionSettings:
    """Settings of every stage."""

    colour: Colour = RED
    """Colour of the target, unless a detector is given."""
    tracking: TrackingSettings = field(default_factory=TrackingSettings)
    """How far off the target may be from where it was last seen."""
    flow: FlowSettings = field(default_factory=FlowSettings)
    """Resolution, windows and noise of the flow."""
    distance: DistanceSettings = field(default_factory=DistanceSettings)
    """Prior, noise and gates of the distance filter, unless an estimator is given."""
    centre: CentreSettings | None = field(default_factory=CentreSettings)
    """How the centre of the target's body is found; None: the fixated point is taken for it. Needs a support height."""
    zero_flow: ZeroFlowSettings = field(default_factory=ZeroFlowSettings)
    """Margins and gates of the zero-flow test."""
    hand_eye: HandEyeSettings | None = field(default_factory=HandEyeSettings)
    """How the hand-eye error is learnt from the support surface; None: it is not. Needs a support height."""
    max_gap_s: float = 0.15
    """Frames farther apart than this are not differentiated, s."""
