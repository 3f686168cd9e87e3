"""``ServoPolicy``: from observations to camera twists by fixation alone, on the robot or in simulation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from fixation_gym.control import gaze, open_loop, servo_laws
from fixation_gym.control.corridor import near_hand
from fixation_gym.control.obstacle_term import ObstacleTerm, obstacle_term
from fixation_gym.control.open_loop import Manoeuvre, Stage, Target
from fixation_gym.geometry.rigid import inverse, pose_to_matrix, transform
from fixation_gym.geometry.twist import exp_twist
from fixation_gym.perception.body.grasp_axis import narrow_axis
from fixation_gym.perception.percept import Percept
from fixation_gym.perception.pipeline import Perception
from fixation_gym.perception.zero_flow.obstacle_memory import (
    MemorySettings,
    ObstacleMemory,
    believed_points,
    remember,
)
from fixation_gym.robot import TOOL_IN_CAMERA, TWIST_LIMITS
from fixation_gym.types import Command, FloatArray, Observation
from policies.base import Action, Estimate
from policies.servo.gains import ServoGains
from policies.servo.phases import Phase, Situation, next_phase
from policies.servo.way_search import Obstacles, WaySearch

_FAR_OFF = 0.5
"""Offset from the image centre beyond which the direction to the target is all that counts, normalised coordinates."""

_OWN_RADIUS = 0.05
"""Points so near to the fixated point are the target's own, m."""
_INNER = 0.34
"""Nearer to the target than this the hand is among what stands around it, m."""
_BACKING_OFF = 0.05
"""The camera goes around more slowly the farther it is within its distance for that, not at all from here on, m."""
_ROLL = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
"""Twist of a camera that turns about its optical axis, rad/s."""


class ServoPolicy:
    """The scripted baseline: gaze, approach and lateral laws (Eqs. 6-8), then an open-loop grasp.

    State: perception, obstacle memory, the search for a way, phase, and the open-loop manoeuvre if there is one.
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
        self.percept: Percept | None = None
        self.estimate: Estimate | None = None
        self._avoid_obstacles = avoid_obstacles
        self._perception = perception
        self._memory_settings = memory or MemorySettings()
        self.reset()

    def reset(self, seed: int | None = None) -> None:
        """Forget the last episode. The behaviour is deterministic; ``seed`` is not used."""
        self._perception.reset()
        self._memory = ObstacleMemory.empty()
        self._phase = Phase.SEARCH
        self._phase_start = 0.0
        self._last_seen = -math.inf
        self._manoeuvre: Manoeuvre | None = None
        self._grasps = 0
        self._search = WaySearch(self.gains)
        self.percept = self.estimate = None

    def act(self, obs: Mapping[str, Any]) -> Action:
        """Action of ``FixationPick-v0``, shape (7,), for its observation."""
        command = self.respond(Observation.from_dict(obs))
        action = np.concatenate([command.camera_twist / TWIST_LIMITS, [command.gripper]])
        return action.astype(np.float32)

    def respond(self, observation: Observation, looking: bool = True) -> Command:
        """Command for the next control period.

        Args:
            observation: of the robot, now.
            looking: whether its image is new; if not, what was last perceived stands.
        """
        if looking or self.percept is None:
            self.percept = self._perception.update(observation)
        manoeuvring = self._manoeuvre is not None
        command = self.command(self.percept, observation)
        if manoeuvring and self._manoeuvre is None:
            self._perception.forget_place()  # the target was pushed or dropped
        return command

    def command(self, percept: Percept, observation: Observation) -> Command:
        """Command for the next control period, for a robot loop that updates its own perception."""
        T_base_cam = pose_to_matrix(observation.camera_pose)
        self._remember_obstacles(percept)
        obstacles = self._obstacles(percept)
        obstacle = self._obstacle_term(percept, T_base_cam, obstacles)
        self._advance(percept, observation, T_base_cam, obstacle)
        fixation = percept.fixation
        phase = self._phase if self._manoeuvre is None else self._manoeuvre.stage
        distance = (fixation.distance_m, fixation.distance_std_m)
        if percept.body is not None:
            distance = percept.body.depth(T_base_cam)
        elif not fixation.initialised:
            distance = (math.nan, fixation.distance_std_m)
        self.estimate = Estimate(*distance, phase.value)
        twist = self._twist(percept, T_base_cam, obstacles, obstacle)
        return Command(twist, open_loop.gripper_command(self._manoeuvre))

    # -- obstacles -----------------------------------------------------------------------------------------------

    def _remember_obstacles(self, percept: Percept) -> None:
        """Add the zero-flow test to the memory."""
        # While the gaze still swings to the target, small errors of the time stamps look like motion.
        centred = float(np.linalg.norm(percept.fixation.centroid)) < self.gains.grasp_centred
        looking = centred and self._manoeuvre is None and self._phase is not Phase.SEARCH
        if looking and percept.flow.valid:
            self._memory = remember(
                self._memory,
                percept.zfc,
                percept.flow.intrinsics,
                percept.T_base_flow,
                percept.flow.time,
                self._memory_settings,
                self._perception.support_height_m,
            )
            self._search.look(percept)

    def _obstacles(self, percept: Percept) -> Obstacles:
        """What is believed to stand there, without the target's own points."""
        points, evidence = believed_points(self._memory, self._memory_settings)
        others = np.linalg.norm(points - percept.fixation.point_base, axis=1) > _OWN_RADIUS
        others &= self._avoid_obstacles
        return Obstacles(points[others], evidence[others])

    def _obstacle_term(self, percept: Percept, T_base_cam: FloatArray, obstacles: Obstacles) -> ObstacleTerm:
        in_camera = transform(inverse(T_base_cam), obstacles.points)
        depth = percept.fixation.distance_m
        return obstacle_term(in_camera, obstacles.evidence, depth, TOOL_IN_CAMERA[2], self.gains.obstacle_margin)

    def _is_close(self, percept: Percept, T_base_cam: FloatArray, obstacles: Obstacles) -> bool:
        """Whether something is next to the hand, while it goes around; on its way in, the corridor says more."""
        if percept.fixation.distance_m < _INNER:
            return False
        beside = near_hand(transform(inverse(T_base_cam), obstacles.points), self.gains.hand_room)
        return bool(obstacles.evidence[beside].sum() > 0.5 * self.gains.obstacle_evidence)

    # -- phases --------------------------------------------------------------------------------------------------

    def _advance(
        self, percept: Percept, observation: Observation, T_base_cam: FloatArray, obstacle: ObstacleTerm
    ) -> None:
        fixation, time = percept.fixation, observation.time
        if fixation.visible:
            self._last_seen = percept.time
        unseen = time - self._last_seen
        if self._manoeuvre is not None:
            width = observation.gripper_width
            if percept.body is not None:
                target = self._target(percept, T_base_cam)
                self._manoeuvre = open_loop.reaimed(self._manoeuvre, T_base_cam, target, self.gains.open_loop)
            self._manoeuvre = open_loop.advance(self._manoeuvre, T_base_cam, width, time, self.gains.open_loop)
            if self._manoeuvre is None:
                self._phase, self._phase_start = Phase.FIXATE, time
                if unseen > self.gains.lost_seconds:
                    self._phase = Phase.SEARCH
            return
        situation = Situation(
            phase_seconds=time - self._phase_start,
            unseen_seconds=unseen,
            distance=fixation.distance_m,
            distance_std=fixation.distance_std_m,
            offset=float(np.linalg.norm(fixation.centroid)),
            blocked=obstacle.evidence > self.gains.obstacle_evidence,
            grasps=self._grasps,
        )
        phase = next_phase(self._phase, situation, self.gains)
        if isinstance(phase, Stage):
            target = self._target(percept, T_base_cam)
            self._manoeuvre = open_loop.begin_grasp(T_base_cam, target, time, self.gains.open_loop)
            self._grasps += 1
        elif phase is not self._phase:
            self._phase, self._phase_start = phase, time

    def _target(self, percept: Percept, T_base_cam: FloatArray) -> Target:
        support = self._perception.support_height_m
        return Target(percept.centre_base, percept.reach_towards(T_base_cam), support)

    # -- laws ----------------------------------------------------------------------------------------------------

    def _twist(
        self, percept: Percept, T_base_cam: FloatArray, obstacles: Obstacles, obstacle: ObstacleTerm
    ) -> FloatArray:
        if self._manoeuvre is not None:
            twist = open_loop.manoeuvre_twist(self._manoeuvre, T_base_cam, self.gains.open_loop)
        elif self._phase is Phase.SEARCH:
            twist = self._searching_twist(percept, T_base_cam, obstacles)
        else:
            twist = self._fixating_twist(percept, T_base_cam, obstacles, obstacle)
        return gaze.within_speed(twist)

    def _searching_twist(self, percept: Percept, T_base_cam: FloatArray, obstacles: Obstacles) -> FloatArray:
        """Back off and go on around to the chosen way, gaze on the expected place. Then look around."""
        gains, fixation = self.gains, percept.fixation
        seconds = percept.time - self._phase_start
        if seconds > gains.search_seconds:
            return gaze.searching_twist(seconds - gains.search_seconds, gains.gaze)
        support, distance = self._perception.support_height_m, fixation.distance_m
        if not fixation.initialised and support is not None:  # the target is somewhere on the table
            distance = (T_base_cam[2, 3] - support) / max(math.sin(gaze.elevation(T_base_cam)), 0.1)
        lateral = np.zeros(2)
        if not self._search.has_way:
            lateral = np.array([0.0, -gains.search_climb])
        elif fixation.initialised:
            direction, angle = self._search.choose(percept, T_base_cam, obstacles, blocked=False)
            lateral = direction * min(gains.turn_gain * distance * angle, gains.turn_speed)
        if fixation.initialised:
            lateral = gaze.within_reach(lateral, T_base_cam, fixation.point_base, gains.gaze)
        back = -gains.search_retreat_speed if distance < gains.search_distance else 0.0
        expected = np.clip(fixation.centroid, -_FAR_OFF, _FAR_OFF) if fixation.initialised else np.zeros(2)
        level = gaze.levelling(T_base_cam, gains.gaze)
        return gaze.fixating_twist(np.array([*lateral, back]), expected, fixation.distance_m, level, gains.gaze)

    def _fixating_twist(
        self, percept: Percept, T_base_cam: FloatArray, obstacles: Obstacles, obstacle: ObstacleTerm
    ) -> FloatArray:
        """Eqs. 6-8 together."""
        gains, fixation = self.gains, percept.fixation
        certainty = min(1.0, obstacle.evidence / gains.obstacle_evidence)
        direction, angle = np.zeros(2), 0.0
        if self._avoid_obstacles and self._phase is Phase.APPROACH:
            direction, angle = self._search.choose(percept, T_base_cam, obstacles, certainty == 1.0)
        speed = min(gains.turn_gain * fixation.distance_m * angle, gains.turn_speed)
        if angle > gains.on_way:  # farther in, the hand must not swing into what stands beside its way
            far = 1.0 - (gains.orbit_distance - fixation.distance_m) / _BACKING_OFF
            speed *= min(1.0, max(0.05, far))
        close = self._is_close(percept, T_base_cam, obstacles)
        if close:
            speed *= 0.3
        cycle = servo_laws.cyclic_velocity(percept.time, gains.cycle_amplitude, gains.cycle_rate)
        lateral = cycle + speed * direction
        if self._phase is Phase.FIXATE and percept.time - self._phase_start > gains.fixate_patience:
            # Something hides part of the target; from farther up less does.
            lateral = cycle + np.array([0.0, -gains.search_climb])
        lateral = gaze.within_reach(lateral, T_base_cam, fixation.point_base, gains.gaze)
        forward = self._forward_speed(percept, obstacle, certainty, angle)
        v = np.array([*lateral, -gains.retreat_speed if close else forward])
        roll_error = self._roll_error(percept, T_base_cam, obstacles, certainty)
        return gaze.fixating_twist(v, fixation.centroid, fixation.distance_m, roll_error, gains.gaze)

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

    def _roll_error(self, percept: Percept, T_base_cam: FloatArray, obstacles: Obstacles, certainty: float) -> float:
        """Angle to turn about the optical axis, rad: level from afar, or if that frees the way of the hand.

        Otherwise across the target's narrow axis.
        """
        gains, roll = self.gains.gaze, gaze.roll(T_base_cam)
        near = percept.fixation.distance_m < gains.align_distance and percept.segmentation.whole
        if not near or certainty == 1.0:
            return gaze.levelling(T_base_cam, gains)
        turn = narrow_axis(percept.segmentation.mask, roll, gains.max_roll)
        turned = self._obstacle_term(percept, T_base_cam @ exp_twist(_ROLL, turn), obstacles)
        blocked = turned.evidence > self.gains.obstacle_evidence
        return gaze.levelling(T_base_cam, gains) if blocked else turn
