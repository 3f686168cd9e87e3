"""The paper's own algorithm (Battaje & Brock 2022), Eqs. 6-8 with corrected signs and nothing else; and steps beyond.

Every control period: the target's centroid by its colour; Z_f from an extended Kalman filter on camera velocity and
flow under the fixation constraint; what is in front by the sign of flow times lateral velocity. Then

    w_XY = -lambda_XY B_xy^-1 e                                                 (Eq. 6: gaze)
    v_Z  = lambda_Z log(Z_f / Z_d)                                              (Eq. 7: approach)
    v_XY = lambda_dist (Z_f - Z_d + k std) + cyclic term - lambda_obs obs_xy    (Eq. 8: lateral motion)

and at Z_d the hand goes forward to the target, closes and lifts. obs_xy is the centre of mass of all pixels in front,
the table's included. There is no feed-forward, roll, body, memory, tracking or second try.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fixation_gym.control import servo_laws
from fixation_gym.control.gaze import GazeGains
from fixation_gym.fixator import Fixator, FixatorGains, action_of
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.detection.colour import ColourDetector
from fixation_gym.perception.distance.estimator import DistanceEstimator, FlowEstimator
from fixation_gym.perception.percept import Percept
from fixation_gym.perception.pipeline import Perception
from fixation_gym.perception.settings import PerceptionSettings
from fixation_gym.perception.zero_flow.evidence_map import ZeroFlowSettings
from fixation_gym.perception.zero_flow.front_rule import FrontRule, dot_product_rule, exact_rule
from fixation_gym.types import Command, FloatArray, Observation
from fixation_policies.base import Action, Estimate

_IN_FRONT = 0.5
"""Probability from which on a pixel is in front."""


@dataclass(frozen=True)
class PaperGains:
    """Gains of Eqs. 6-8; velocities are of the camera.

    The best of 48 drawn at random, after 397 episodes of ``clear``, ``opaque``, ``shelf`` and ``screen`` (seeds 9310000
    to 9310007): it picked in 24 of its 32.
    """

    gaze_gain: float = 14.2
    """lambda_XY of Eq. 6, 1/s."""
    approach_gain: float = 0.044
    """lambda_Z of Eq. 7, m/s."""
    desired_distance: float = 0.16
    """Z_d, m: from here the grasp is open loop."""
    distance_gain: tuple[float, float] = (0.0, -0.126)
    """lambda_dist of Eq. 8 along x and y of the camera, 1/s: far from the target it climbs."""
    uncertainty: float = 2.85
    """k: standard deviations of Z_f that count as distance."""
    cycle_amplitude: float = 0.019
    """Radius of the circle of Eq. 8, m."""
    cycle_rate: float = 1.6
    """Its angular rate, rad/s."""
    obstacle_gain: float = 0.14
    """lambda_obs of Eq. 8, m/s per unit of normalised image coordinates."""
    grasp_tolerance: float = 1.085
    """The grasp starts below this multiple of Z_d ..."""
    grasp_relative_std: float = 0.25
    """... if the distance is known to this share."""


@dataclass(frozen=True)
class PaperVariant:
    """The paper's algorithm, or with some of its parts replaced."""

    name: str
    summary: str
    gains: PaperGains = field(default_factory=PaperGains)
    feed_forward: bool = False
    """Whether the camera's own motion is fed forward to the gaze."""
    estimator: Callable[[], DistanceEstimator] | None = FlowEstimator
    """Makes what tells the distance; None: poses and centroids."""
    follow: bool = False
    """Whether the target is looked for where it was last seen."""
    rule: FrontRule = dot_product_rule
    """What tells front from behind."""
    knows_table: bool = False
    """Whether the table's height is known: it is no obstacle then, and the fingers keep off it."""
    body: bool = False
    """Whether the grasp goes for the middle of the body that fits the outlines, not of the surface in view."""
    limits: bool = False
    """Whether the camera keeps within the arm's reach, and the hand level or across the target."""

    def policy(self, intrinsics: Intrinsics, table_height: float) -> PaperPolicy:
        """The policy for a camera; ``table_height`` in base, m."""
        settings = PerceptionSettings(zero_flow=ZeroFlowSettings(rule=self.rule), hand_eye=None)
        if not self.body:
            settings = replace(settings, centre=None)
        perception = Perception(
            intrinsics,
            settings,
            support_height_m=table_height if self.knows_table else None,
            detector=ColourDetector(intrinsics, follow=self.follow),
            estimator=None if self.estimator is None else self.estimator(),
        )
        gaze = GazeGains(gaze_gain=self.gains.gaze_gain, feed_forward=self.feed_forward)
        return PaperPolicy(Fixator(perception, FixatorGains(gaze, limit_reach=self.limits)), self.gains, self.limits)


class PaperPolicy:
    """Eqs. 6-8 and an open-loop grasp. State: the fixator, and whether the one grasp was made."""

    def __init__(self, fixator: Fixator, gains: PaperGains | None = None, levels: bool = False) -> None:
        """Use a fixator; ``levels`` lets it turn the hand level, and near by across the target."""
        self._fixator, self._gains, self._levels = fixator, gains or PaperGains(), levels
        self.reset()

    def reset(self, seed: int | None = None) -> None:
        """Forget the last episode. The behaviour is deterministic; ``seed`` is not used."""
        self._fixator.reset()
        self._grasped = False
        self.percept: Percept | None = None
        self.estimate: Estimate | None = None

    def act(self, obs: Mapping[str, Any]) -> Action:
        """Action of ``FixationPick-v0``, shape (7,), for its observation."""
        return action_of(self.respond(Observation.from_dict(obs)))

    def respond(self, observation: Observation) -> Command:
        """Command for the next control period."""
        fixator, gains = self._fixator, self._gains
        self.percept = percept = fixator.look(observation)
        fixation = percept.fixation
        near = fixation.visible and fixation.distance_m < gains.grasp_tolerance * gains.desired_distance
        if near and fixation.distance_std_m < gains.grasp_relative_std * fixation.distance_m and not self._grasped:
            fixator.grasp()
            self._grasped = True
        phase = fixator.stage.value if fixator.stage else "approach" if fixation.initialised else "search"
        distance = fixation.distance_m if fixation.initialised else math.nan
        self.estimate = Estimate(distance, fixation.distance_std_m, phase)
        v = np.zeros(3) if self._grasped else self._velocity(percept)
        return fixator.steer(v, roll_error=None if self._levels or not fixation.initialised else 0.0)

    def _velocity(self, percept: Percept) -> FloatArray:
        """Eqs. 7 and 8: camera velocity, shape (3,), m/s."""
        gains, fixation = self._gains, percept.fixation
        if not fixation.initialised:
            return np.zeros(3)
        lateral = servo_laws.lateral_velocity(
            fixation.distance_m + gains.uncertainty * min(fixation.distance_std_m, fixation.distance_m),
            gains.desired_distance,
            np.array(gains.distance_gain),
            percept.time,
            gains.cycle_amplitude,
            gains.cycle_rate,
            gains.obstacle_gain,
            centre_of_what_is_in_front(percept),
        )
        forward = servo_laws.approach_speed(fixation.distance_m, gains.desired_distance, gains.approach_gain)
        return np.array([*lateral, forward])


def centre_of_what_is_in_front(percept: Percept) -> FloatArray:
    """obs_xy of Eq. 8: centre of mass of the pixels in front, normalised image coordinates, shape (2,), 0 without any.

    The pixels are those of the last flow.
    """
    front = percept.zfc.supported & (percept.zfc.p_nearer > _IN_FRONT)
    if not front.any():
        return np.zeros(2)
    x, y = percept.flow.intrinsics.grid
    return np.array([x[front].mean(), y[front].mean()])


_PAPER = PaperVariant("paper", "the paper's algorithm: Eqs. 6-8, filter on flow, one grasp")
_FEED_FORWARD = replace(
    _PAPER,
    name="paper:feed_forward",
    summary="gaze with feed-forward of the camera's own motion",
    feed_forward=True,
)
_POSE_FILTER = replace(
    _FEED_FORWARD,
    name="paper:pose_filter",
    summary="distance from poses and centroids, of the thing where the target was last seen",
    estimator=None,
    follow=True,
)
_EXACT_TEST = replace(
    _POSE_FILTER,
    name="paper:exact_test",
    summary="the exact zero-flow test, with the table's height",
    rule=exact_rule,
    knows_table=True,
)
_LIMITS = replace(
    _EXACT_TEST,
    name="paper:limits",
    summary="within the arm's reach, the hand level and then across the target",
    limits=True,
)
_BODY = replace(
    _LIMITS,
    name="paper:body",
    summary="the grasp goes for the middle of the body fitted to outlines",
    body=True,
)
PAPER_VARIANTS = (_PAPER, _FEED_FORWARD, _POSE_FILTER, _EXACT_TEST, _LIMITS, _BODY)
"""Each has one step more than the one before."""
PAPER_NAMES = tuple(variant.name for variant in PAPER_VARIANTS)


def paper_variant(name: str) -> PaperVariant:
    """The variant of that name."""
    return next(variant for variant in PAPER_VARIANTS if variant.name == name)
