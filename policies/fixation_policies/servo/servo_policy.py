"""``ServoPolicy``: from observations to camera twists by fixation alone, on the robot or in simulation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from fixation_gym.control import servo_laws
from fixation_gym.control.corridor import near_hand
from fixation_gym.control.gaze import elevation
from fixation_gym.control.obstacle_term import ObstacleTerm, obstacle_term
from fixation_gym.control.open_loop import Stage
from fixation_gym.fixator import Fixator, FixatorGains, action_of
from fixation_gym.geometry.rigid import inverse, transform
from fixation_gym.geometry.twist import exp_twist
from fixation_gym.perception.percept import Percept
from fixation_gym.perception.pipeline import Perception
from fixation_gym.perception.zero_flow.obstacle_memory import MemorySettings
from fixation_gym.robots import ROBOT
from fixation_gym.surroundings import Obstacles, Surroundings
from fixation_gym.types import Command, FloatArray, Observation
from fixation_policies.base import Action, Estimate
from fixation_policies.servo.gains import ServoGains
from fixation_policies.servo.phases import Phase, Situation, next_phase
from fixation_policies.servo.way_search import WaySearch

_INNER = 0.34
"""Nearer to the target than this the hand is among what stands around it, m."""
_BACKING_OFF = 0.05
"""The camera goes around more slowly the farther it is within its distance for that, not at all from here on, m."""
_ROLL = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
"""Twist of a camera that turns about its optical axis, rad/s."""


class ServoPolicy:
    """The scripted baseline: gaze, approach and lateral laws (Eqs. 6-8), then an open-loop grasp.

    State: the fixator, what is remembered around the target, the search for a way, and the phase.
    """

    def __init__(
        self,
        perception: Perception,
        gains: ServoGains | None = None,
        memory: MemorySettings | None = None,
        avoid_obstacles: bool = True,
    ) -> None:
        """Prepare for a robot.

        Args:
            perception: made for its wrist camera; the policy resets and updates it.
            gains: numbers of the behaviour; None for the defaults.
            memory: how obstacles are remembered; None for the defaults.
            avoid_obstacles: False leaves out the obstacle term (the "blind" baseline).
        """
        self.gains = gains or ServoGains()
        self.estimate: Estimate | None = None
        self._fixator = Fixator(perception, FixatorGains(self.gains.gaze, self.gains.open_loop))
        self._avoid_obstacles = avoid_obstacles
        self._surroundings = Surroundings(memory)
        self.reset()

    def reset(self, seed: int | None = None) -> None:
        """Forget the last episode. The behaviour is deterministic; ``seed`` is not used."""
        self._fixator.reset()
        self._surroundings.reset()
        self._phase = Phase.SEARCH
        self._phase_start = 0.0
        self._last_seen = -math.inf
        self._stage: Stage | None = None
        self._grasps = 0
        self._search = WaySearch(self.gains, self._surroundings)
        self.estimate = None
        self.percept: Percept | None = None

    def act(self, obs: Mapping[str, Any]) -> Action:
        """Action of ``FixationPick-v0``, shape (7,), for its observation."""
        return action_of(self.respond(Observation.from_dict(obs)))

    def respond(self, observation: Observation, fresh: bool = True) -> Command:
        """Command for the next control period.

        Args:
            observation: of the robot, now.
            fresh: whether its image is new; if not, what was last perceived stands.
        """
        self.percept = percept = self._fixator.look(observation, fresh)
        self._look_around(percept)
        obstacles = self._obstacles(percept)
        obstacle = self._obstacle_term(percept, self._fixator.T_base_cam, obstacles)
        self._advance(percept, observation.time, obstacle)
        command = self._command(percept, obstacles, obstacle)
        self.estimate = self._estimate(percept)
        return command

    def _estimate(self, percept: Percept) -> Estimate:
        fixation, phase = percept.fixation, self._fixator.stage or self._phase
        distance = (fixation.distance_m, fixation.distance_std_m)
        if percept.body is not None:
            distance = percept.body.depth(self._fixator.T_base_cam)
        elif not fixation.initialised:
            distance = (math.nan, fixation.distance_std_m)
        return Estimate(*distance, phase.value)

    # -- obstacles -----------------------------------------------------------------------------------------------

    def _look_around(self, percept: Percept) -> None:
        """Add the zero-flow test to what is remembered."""
        # While the gaze still swings to the target, small errors of the time stamps look like motion.
        centred = float(np.linalg.norm(percept.fixation.centroid)) < self.gains.grasp_centred
        if centred and self._stage is None and self._phase is not Phase.SEARCH:
            self._surroundings.look(percept, self._fixator.perception.support_height_m)

    def _obstacles(self, percept: Percept) -> Obstacles:
        """What is believed to stand there."""
        points, evidence = self._surroundings.obstacles(percept.fixation.point_base)
        return Obstacles(points, evidence) if self._avoid_obstacles else Obstacles(points[:0], evidence[:0])

    def _obstacle_term(self, percept: Percept, T_base_cam: FloatArray, obstacles: Obstacles) -> ObstacleTerm:
        in_camera = transform(inverse(T_base_cam), obstacles.points)
        depth = percept.fixation.distance_m
        return obstacle_term(in_camera, obstacles.evidence, depth, ROBOT.tool_in_camera[2], self.gains.obstacle_margin)

    def _is_close(self, percept: Percept, obstacles: Obstacles) -> bool:
        """Whether something is next to the hand, while it goes around; on its way in, the corridor says more."""
        if percept.fixation.distance_m < _INNER:
            return False
        beside = near_hand(transform(inverse(self._fixator.T_base_cam), obstacles.points), self.gains.hand_room)
        return bool(obstacles.evidence[beside].sum() > 0.5 * self.gains.obstacle_evidence)

    # -- phases --------------------------------------------------------------------------------------------------

    def _advance(self, percept: Percept, time: float, obstacle: ObstacleTerm) -> None:
        """Phase in which to act now; begins the grasp."""
        fixation = percept.fixation
        if fixation.visible:
            self._last_seen = percept.time
        unseen, before = time - self._last_seen, self._stage
        self._stage = self._fixator.stage
        if self._stage is not None:
            return
        if before is not None:  # the manoeuvre has just ended
            self._phase, self._phase_start = Phase.FIXATE, time
            if unseen > self.gains.lost_seconds:
                self._phase = Phase.SEARCH
            return
        situation = Situation(
            phase_seconds=time - self._phase_start,
            unseen_seconds=unseen,
            distance=fixation.distance_m,
            distance_std=self._goal_std(percept),
            offset=float(np.linalg.norm(fixation.centroid)),
            blocked=obstacle.evidence > self.gains.obstacle_evidence,
            excess_roll=self._fixator.excess_roll(),
            grasps=self._grasps,
        )
        phase = next_phase(self._phase, situation, self.gains)
        if isinstance(phase, Stage):
            self._fixator.grasp()
            self._stage = self._fixator.stage
            self._grasps += 1
        elif phase is not self._phase:
            self._phase, self._phase_start = phase, time

    def _goal_std(self, percept: Percept) -> float:
        """Standard deviation of Z_f or, if that is smaller, of the depth of the body's centre, m."""
        std = percept.fixation.distance_std_m
        return std if percept.body is None else min(std, percept.body.depth(self._fixator.T_base_cam)[1])

    # -- laws ----------------------------------------------------------------------------------------------------

    def _command(self, percept: Percept, obstacles: Obstacles, obstacle: ObstacleTerm) -> Command:
        if self._stage is not None:
            return self._fixator.steer(np.zeros(3))
        if self._phase is Phase.SEARCH:
            return self._searching(percept, obstacles)
        return self._fixating(percept, obstacles, obstacle)

    def _searching(self, percept: Percept, obstacles: Obstacles) -> Command:
        """Back off and go on around to the chosen way, gaze on the expected place. Then look around."""
        gains, fixation, T_base_cam = self.gains, percept.fixation, self._fixator.T_base_cam
        seconds = percept.time - self._phase_start
        if seconds > gains.search_seconds:
            return self._fixator.search(seconds - gains.search_seconds)
        support, distance = self._fixator.perception.support_height_m, fixation.distance_m
        if not fixation.initialised and support is not None:  # the target is somewhere on the table
            distance = (T_base_cam[2, 3] - support) / max(math.sin(elevation(T_base_cam)), 0.1)
        lateral = np.zeros(2)
        if not self._search.has_way:
            lateral = np.array([0.0, -gains.search_climb])
        elif fixation.initialised:
            direction, angle = self._search.choose(percept, T_base_cam, obstacles, blocked=False)
            lateral = direction * min(gains.turn_gain * distance * angle, gains.turn_speed)
        back = -gains.search_retreat_speed if distance < gains.search_distance else 0.0
        return self._fixator.steer(np.array([*lateral, back]), roll_error=self._fixator.levelling())

    def _fixating(self, percept: Percept, obstacles: Obstacles, obstacle: ObstacleTerm) -> Command:
        """Eqs. 6-8 together."""
        gains, fixation = self.gains, percept.fixation
        certainty = min(1.0, obstacle.evidence / gains.obstacle_evidence)
        direction, angle = np.zeros(2), 0.0
        if self._avoid_obstacles and self._phase is Phase.APPROACH:
            direction, angle = self._search.choose(percept, self._fixator.T_base_cam, obstacles, certainty == 1.0)
        speed = min(gains.turn_gain * fixation.distance_m * angle, gains.turn_speed)
        if angle > gains.on_way:  # farther in, the hand must not swing into what stands beside its way
            far = 1.0 - (gains.orbit_distance - fixation.distance_m) / _BACKING_OFF
            speed *= min(1.0, max(0.05, far))
        close = self._is_close(percept, obstacles)
        if close:
            speed *= 0.3
        cycle = servo_laws.cyclic_velocity(percept.time, gains.cycle_amplitude, gains.cycle_rate)
        lateral = cycle + speed * direction
        if self._phase is Phase.FIXATE and percept.time - self._phase_start > gains.fixate_patience:
            # Something hides part of the target; from farther up less does.
            lateral = cycle + np.array([0.0, -gains.search_climb])
        forward = -gains.retreat_speed if close else self._forward_speed(percept, obstacle, certainty, angle)
        roll_error = self._roll_error(percept, obstacles, certainty)
        return self._fixator.steer(np.array([*lateral, forward]), roll_error=roll_error)

    def _forward_speed(self, percept: Percept, obstacle: ObstacleTerm, certainty: float, angle: float) -> float:
        """v_Z, m/s: Eq. 7 on the way, the slower the surer it is that something is there; back off to go around."""
        gains, distance = self.gains, percept.fixation.distance_m
        if certainty == 1.0 and obstacle.gap < gains.retreat_gap:
            return -gains.retreat_speed
        if self._phase is not Phase.APPROACH or angle > gains.on_way or certainty == 1.0:
            return -gains.retreat_speed if distance < gains.orbit_distance else 0.0
        if self._avoid_obstacles and not self._search.may_enter(percept.time):
            return 0.0
        wanted = servo_laws.approach_speed(distance, gains.desired_distance, gains.approach_gain)
        return min(wanted, gains.approach_speed) * (1.0 - certainty)

    def _roll_error(self, percept: Percept, obstacles: Obstacles, certainty: float) -> float:
        """Angle to turn about the optical axis, rad: level from afar, or if that frees the way of the hand.

        Otherwise across the target's narrow axis.
        """
        turn = self._fixator.across()
        if turn is None or certainty == 1.0:
            return self._fixator.levelling()
        turned = self._obstacle_term(percept, self._fixator.T_base_cam @ exp_twist(_ROLL, turn), obstacles)
        blocked = turned.evidence > self.gains.obstacle_evidence
        return self._fixator.levelling() if blocked else turn
