"""``ServoPolicy``: from observations to camera twists by fixation alone, on the robot or in simulation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from fixation_gym.control import servo_laws
from fixation_gym.control.obstacle_term import ObstacleTerm, obstacle_term
from fixation_gym.geometry.rigid import inverse, pose_to_matrix, transform
from fixation_gym.perception.grasp_axis import narrow_axis
from fixation_gym.perception.obstacle_memory import MemorySettings, ObstacleMemory, believed_points, remember
from fixation_gym.perception.pipeline import Percept, Perception
from fixation_gym.robot import TOOL_IN_CAMERA, TWIST_LIMITS
from fixation_gym.types import Command, FloatArray, Observation
from policies.base import Action, Estimate
from policies.servo.gains import ServoGains
from policies.servo.phases import Phase, Situation, next_phase

_OPEN, _CLOSE = -1.0, 1.0


class ServoPolicy:
    """The scripted baseline: gaze, approach and lateral laws (Eqs. 6-8), then an open-loop grasp.

    State: perception, obstacle memory, phase, and the goal of an open-loop motion.
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
        self._goal: FloatArray | None = None
        self.percept = self.estimate = None

    def act(self, obs: Mapping[str, Any]) -> Action:
        """Action of ``FixationPick-v0``, shape (7,), for its observation."""
        observation = Observation.from_dict(obs)
        self.percept = self._perception.update(observation)
        command = self.command(self.percept, observation)
        action = np.concatenate([command.camera_twist / TWIST_LIMITS, [command.gripper]])
        return action.astype(np.float32)

    def command(self, percept: Percept, observation: Observation) -> Command:
        """Command for the next control period, for a robot loop that updates its own perception."""
        T_base_cam = pose_to_matrix(observation.camera_pose)
        self._remember_obstacles(percept)
        obstacle = self._obstacle_term(percept, T_base_cam)
        self._advance(percept, observation, T_base_cam, obstacle)
        fixation = percept.fixation
        self.estimate = Estimate(
            fixation.distance_m if fixation.initialised else math.nan, fixation.distance_std_m, self._phase.value
        )
        gripper = _CLOSE if self._phase in (Phase.CLOSE, Phase.LIFT) else _OPEN
        return Command(self._twist(percept, T_base_cam, obstacle), gripper)

    # -- obstacles -----------------------------------------------------------------------------------------------

    def _remember_obstacles(self, percept: Percept) -> None:
        """Add the zero-flow test to the memory."""
        # While the gaze still swings to the target, small errors of the time stamps look like motion.
        centred = float(np.linalg.norm(percept.fixation.centroid)) < self.gains.grasp_centred
        looking = centred and self._phase in (Phase.FIXATE, Phase.APPROACH)
        if looking and percept.flow.valid:
            self._memory = remember(
                self._memory,
                percept.zfc,
                percept.flow.intrinsics,
                percept.T_base_cam,
                percept.flow.time,
                self._memory_settings,
            )

    def _obstacle_term(self, percept: Percept, T_base_cam: FloatArray) -> ObstacleTerm:
        points, evidence = believed_points(self._memory, self._memory_settings)
        if not self._avoid_obstacles:
            points, evidence = points[:0], evidence[:0]
        in_camera = transform(inverse(T_base_cam), points)
        depth = percept.fixation.distance_m
        return obstacle_term(in_camera, evidence, depth, TOOL_IN_CAMERA[2], self.gains.obstacle_margin)

    # -- phases --------------------------------------------------------------------------------------------------

    def _advance(
        self, percept: Percept, observation: Observation, T_base_cam: FloatArray, obstacle: ObstacleTerm
    ) -> None:
        fixation = percept.fixation
        if fixation.visible:
            self._last_seen = percept.time
        goal = self._goal
        situation = Situation(
            phase_seconds=percept.time - self._phase_start,
            unseen_seconds=percept.time - self._last_seen,
            distance=fixation.distance_m,
            distance_std=fixation.distance_std_m,
            offset=float(np.linalg.norm(fixation.centroid)),
            blocked=obstacle.evidence > self.gains.obstacle_evidence,
            arrived=goal is not None and bool(np.linalg.norm(T_base_cam[:3, 3] - goal) < self.gains.tool_tolerance),
            gripper_width=observation.gripper_width,
        )
        phase = next_phase(self._phase, situation, self.gains)
        if phase is self._phase:
            return
        self._phase, self._phase_start = phase, percept.time
        self._goal = self._open_loop_goal(phase, percept, T_base_cam)

    def _open_loop_goal(self, phase: Phase, percept: Percept, T_base_cam: FloatArray) -> FloatArray | None:
        """Camera position, shape (3,), in base, at which an open-loop phase ends."""
        if phase is Phase.GRASP:
            point = percept.fixation.point_base.copy()
            support = self._perception.support_height_m
            if support is not None:
                point[2] = max(point[2], support + self.gains.finger_room)
            return point - T_base_cam[:3, :3] @ TOOL_IN_CAMERA
        if phase is Phase.LIFT:
            return T_base_cam[:3, 3] + [0.0, 0.0, self.gains.lift_height]
        if phase is Phase.RECOVER:
            return T_base_cam[:3, 3] - T_base_cam[:3, 2] * self.gains.recover_distance
        return None

    # -- laws ----------------------------------------------------------------------------------------------------

    def _twist(self, percept: Percept, T_base_cam: FloatArray, obstacle: ObstacleTerm) -> FloatArray:
        phase = self._phase
        if phase in (Phase.FIXATE, Phase.APPROACH):
            twist = self._fixating_twist(percept, T_base_cam, obstacle)
        elif phase is Phase.SEARCH:
            twist = self._searching_twist(percept.time)
        elif phase is Phase.CLOSE or self._goal is None:
            twist = np.zeros(6)
        elif phase is Phase.GRASP:
            twist = self._grasping_twist(T_base_cam, self._goal)
        else:
            twist = servo_laws.pose_twist(T_base_cam, self._goal, self.gains.tool_gain, self.gains.tool_speed)
        return twist / max(1.0, float(np.max(np.abs(twist) / TWIST_LIMITS)))

    def _fixating_twist(self, percept: Percept, T_base_cam: FloatArray, obstacle: ObstacleTerm) -> FloatArray:
        """Eqs. 6-8 together."""
        gains, fixation = self.gains, percept.fixation
        blocked = obstacle.evidence > gains.obstacle_evidence
        elevation = math.asin(float(np.clip(-T_base_cam[2, 2], -1.0, 1.0)))
        approaching = self._phase is Phase.APPROACH
        climb = gains.climb_gain if approaching and elevation < gains.climb_until else 0.0
        lateral = servo_laws.lateral_velocity(
            fixation.distance_m,
            gains.desired_distance,
            np.array([0.0, -climb]),
            percept.time,
            gains.cycle_amplitude,
            gains.cycle_rate,
            gains.obstacle_gain,
            self._shunned_direction(obstacle) if blocked else np.zeros(2),
        )
        lateral = self._within_reach(lateral, elevation, T_base_cam, fixation.point_base)
        forward = 0.0
        if approaching and not blocked:
            forward = servo_laws.approach_speed(fixation.distance_m, gains.desired_distance, gains.approach_gain)
        elif blocked and obstacle.gap < gains.retreat_gap:
            forward = -gains.retreat_speed
        v = np.array([*lateral, forward])
        roll = servo_laws.roll_rate(self._roll_error(percept, T_base_cam), gains.roll_gain)
        w = servo_laws.gaze_rotation(fixation.centroid, gains.gaze_gain, 1.0 / fixation.distance_m, v, roll)
        return np.array([*v, *w, roll])

    def _within_reach(
        self, lateral: FloatArray, elevation: float, T_base_cam: FloatArray, target: FloatArray
    ) -> FloatArray:
        """Lateral velocity without the part that would carry the camera out of the arm's comfortable reach."""
        gains = self.gains
        gaze = target - T_base_cam[:3, 3]
        azimuth = math.atan2(gaze[1], gaze[0]) - math.atan2(target[1], target[0])
        azimuth = (azimuth + math.pi) % (2.0 * math.pi) - math.pi
        # Moving right (+x) around the target raises the azimuth, moving up (-y) raises the elevation.
        low, high = gains.azimuth_range
        v_x = max(lateral[0], 0.0) if azimuth < low else min(lateral[0], 0.0) if azimuth > high else lateral[0]
        v_y = max(lateral[1], 0.0) if elevation > gains.highest_elevation else lateral[1]
        return np.array([v_x, v_y])

    def _shunned_direction(self, obstacle: ObstacleTerm) -> FloatArray:
        """obs_xy of unit length; what is straight ahead is passed above."""
        # Clipped, so that "up" never turns into a way down to the table.
        direction = np.clip(obstacle.centre, -1.0, 1.0) + np.array([0.0, self.gains.obstacle_up])
        return direction / max(float(np.linalg.norm(direction)), 1e-6)

    def _roll_error(self, percept: Percept, T_base_cam: FloatArray) -> float:
        """Angle to turn about the optical axis: level from afar, across the target's narrow axis when near, rad."""
        roll = -math.atan2(T_base_cam[2, 0], -T_base_cam[2, 1])
        seen = percept.segmentation
        if percept.fixation.distance_m < self.gains.align_distance and seen.visible and not seen.touches_border:
            return narrow_axis(seen.mask, roll, self.gains.max_roll)
        # Looking straight down, level is undefined; the correction fades before.
        off_vertical = float(np.hypot(T_base_cam[2, 0], T_base_cam[2, 1]))
        return -roll * min(1.0, self.gains.level_fade * off_vertical)

    def _grasping_twist(self, T_base_cam: FloatArray, goal: FloatArray) -> FloatArray:
        """Bring the tool to the target through a funnel: first in line with the approach axis, then forward."""
        gains = self.gains
        waypoint = servo_laws.funnel_waypoint(T_base_cam, goal, gains.funnel_slope, gains.funnel_length)
        return servo_laws.pose_twist(T_base_cam, waypoint, gains.tool_gain, gains.tool_speed)

    def _searching_twist(self, time: float) -> FloatArray:
        """Turn the camera on a widening spiral about where it looked first."""
        phase = self.gains.search_widening * math.sqrt(max(time - self._phase_start, 0.0))
        twist = np.zeros(6)
        twist[3:5] = self.gains.search_rate * np.array([math.cos(phase), math.sin(phase)])
        return twist
