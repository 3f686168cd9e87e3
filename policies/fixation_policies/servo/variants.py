"""Variants of the servo for ablations: each leaves one thing out. All of them are here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

from fixation_gym.control.gaze import GazeGains
from fixation_gym.control.ways import WayCosts
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.detection.colour import ColourDetector
from fixation_gym.perception.detection.detector import Detector
from fixation_gym.perception.detection.mean_shift import MeanShiftDetector
from fixation_gym.perception.distance.estimator import DistanceEstimator, TwistEstimator
from fixation_gym.perception.settings import PerceptionSettings
from fixation_gym.perception.zero_flow.depth_rules import depth_rule, motion_stereo, plane_parallax
from fixation_gym.perception.zero_flow.evidence_map import ZeroFlowSettings
from fixation_gym.perception.zero_flow.front_rule import dot_product_rule
from fixation_gym.perception.zero_flow.obstacle_memory import MemorySettings
from fixation_policies.servo.gains import ServoGains


@dataclass(frozen=True)
class ServoVariant:
    """Settings of a servo policy."""

    name: str
    """Name of the policy."""
    summary: str
    """What is left out, in a few words."""
    gains: ServoGains = field(default_factory=ServoGains)
    perception: PerceptionSettings = field(default_factory=PerceptionSettings)
    memory: MemorySettings = field(default_factory=MemorySettings)
    detector: Callable[[Intrinsics], Detector] | None = None
    """Makes its detector; None: the default."""
    estimator: Callable[[], DistanceEstimator] | None = None
    """Makes what tells its distance; None: poses and centroids."""
    avoid_obstacles: bool = True
    """False takes its map away: it comes in along its first line of sight."""
    depth_camera: bool = False
    """Whether it needs one."""


VARIANTS: tuple[ServoVariant, ...] = (
    ServoVariant("servo", "nothing left out"),
    ServoVariant("blind", "the map: it comes in along its first line of sight", avoid_obstacles=False),
    ServoVariant(
        "blind:slow",
        "the map, as above; at most 0.04 m/s",
        gains=ServoGains(approach_gain=0.06, approach_speed=0.04),
        avoid_obstacles=False,
    ),
    ServoVariant(
        "servo:no_memory",
        "memory: only what is in view counts as an obstacle",
        memory=MemorySettings(decay_s=0.1, decay_in_view_s=0.1, min_evidence=1.0),
    ),
    ServoVariant(
        "servo:no_looking",
        "looking before going: a way that was never looked at is as good as one that was",
        gains=ServoGains(costs=WayCosts(unseen=0.0), seen_share=0.0),
    ),
    ServoVariant(
        "servo:no_feed_forward",
        "gaze without feed-forward of the camera's own motion",
        gains=ServoGains(gaze=GazeGains(feed_forward=False)),
    ),
    ServoVariant(
        "servo:dot_product",
        "the exact zero-flow test: the paper's dot-product rule tells front from behind",
        perception=PerceptionSettings(zero_flow=ZeroFlowSettings(rule=dot_product_rule)),
    ),
    ServoVariant(
        "servo:depth",
        "the zero-flow test: a stereo depth camera tells what is nearer",
        perception=PerceptionSettings(zero_flow=ZeroFlowSettings(rule=depth_rule)),
        depth_camera=True,
    ),
    ServoVariant(
        "servo:motion_stereo",
        "the zero-flow test: dense flow, triangulated with the known poses, tells what is nearer",
        perception=PerceptionSettings(zero_flow=ZeroFlowSettings(rule=motion_stereo)),
    ),
    ServoVariant(
        "servo:plane_parallax",
        "the zero-flow test: whatever moves unlike the table is in the way",
        perception=PerceptionSettings(zero_flow=ZeroFlowSettings(rule=plane_parallax)),
    ),
    ServoVariant(
        "servo:hard_filter",
        "distance from poses: the paper's fixation constraint on the measured twist gives it",
        perception=PerceptionSettings(centre=None),
        estimator=TwistEstimator,
    ),
    ServoVariant(
        "servo:no_hand_eye",
        "learning from the table where the camera truly sits on the hand",
        perception=PerceptionSettings(hand_eye=None),
    ),
    ServoVariant(
        "servo:no_tracking",
        "tracking: every image is segmented like the first",
        detector=partial(ColourDetector, follow=False),
    ),
    ServoVariant(
        "servo:opencv_tracker",
        "the camera's motion when the target is tracked: OpenCV's mean shift follows it in the image",
        detector=MeanShiftDetector,
    ),
    ServoVariant(
        "servo:no_body",
        "the body fitted to outlines: the middle of the surface in view counts as the target's centre",
        perception=PerceptionSettings(centre=None),
    ),
    ServoVariant("servo:no_retry", "a second try: one grasp only", gains=ServoGains(max_grasps=1)),
    ServoVariant(
        "servo:ways_only",
        "looking before going, and a second try",
        gains=ServoGains(costs=WayCosts(unseen=0.0), seen_share=0.0, max_grasps=1),
    ),
)
VARIANT_NAMES = tuple(variant.name for variant in VARIANTS)


def servo_variant(name: str) -> ServoVariant:
    """The variant of that name."""
    return next(variant for variant in VARIANTS if variant.name == name)
