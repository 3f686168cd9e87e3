"""One sequence of the distance experiment: the arm circles in front of a print, everything measured is kept.

The camera describes a circle in the plane across the home axis, once with the gaze servo on ("fixation"), once without
any rotation ("translation"). After the measurement the print jumps, and the circle goes on for a while.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from fixation_gym.control.servo_laws import gaze_rotation
from fixation_gym.envs import sensors
from fixation_gym.envs.sensor_noise import SensorNoise
from fixation_gym.experiments.distance.rig import PrintRig
from fixation_gym.experiments.distance.sequence import (
    AFTER_JUMP_S,
    BURN_IN_S,
    CENTROID_STD_PX,
    HOME,
    INTRINSICS,
    MEASURE_S,
    Circle,
    Condition,
    Motion,
)
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import look_at
from fixation_gym.perception.detection.colour import segment
from fixation_gym.perception.detection.segmentation import Segmentation
from fixation_gym.perception.distance.calibrating_estimator import CalibratingEstimator
from fixation_gym.perception.distance.calibrating_filter import CalibratingSettings
from fixation_gym.perception.distance.flat_target import coverage, flat_centroid
from fixation_gym.perception.distance.flow_samples import CutOut, sample_flow
from fixation_gym.perception.distance.following import Frame, RigMeasurement
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, ImageArray

_GAZE_GAIN, _POSITION_GAIN, _TURN_GAIN = 4.0, 2.0, 2.0
"""1/s."""
_ATTENTION_PX = 64
"""Images are looked at up to this far around where the target was; all of the image when it is lost."""
_NO_IMAGE = np.zeros((0, 0), np.float32)
"""No estimator looks at the image itself, and hundreds of them would take much room."""


@dataclass(frozen=True, eq=False)
class Instant:
    """One frame, as measured and as it was."""

    seen: Frame
    """What estimators get. The centroid is that of the flat target (``flat_centroid``), the mask that of the part of
    the image that was looked at."""
    T_base_cam_calibrated: FloatArray
    """Measured pose without the hand-eye error, shape (4, 4)."""
    distance_robot_m: float
    """True depth of the print in the camera frame that the robot believes in."""
    distance_lens_m: float
    """True depth of the print along the optical axis of the true camera."""
    gaze_error_px: float
    """Distance of the print's centre from the image centre, px."""


@dataclass(frozen=True, eq=False)
class Recording:
    """A sequence."""

    condition: Condition
    frames: tuple[Instant, ...]
    first_guess_m: float
    """Distance with which every estimator starts: off by up to a factor of 2, log-uniform."""

    @property
    def measured(self) -> slice:
        """Frames that count: the 225 after the burn-in."""
        first = round(BURN_IN_S / self.period)
        return slice(first + 1, first + 1 + round(MEASURE_S / self.period))

    @property
    def period(self) -> float:
        """Time from frame to frame, s."""
        return self.frames[1].seen.time - self.frames[0].seen.time


def calibrating_settings(noise: SensorNoise, first_guess_m: float) -> CalibratingSettings:
    """What estimators on poses and centroids expect of a sensor noise preset."""
    return CalibratingSettings(
        initial_distance_m=first_guess_m,
        centroid_std=CENTROID_STD_PX / INTRINSICS.fx,
        centroid_std_size=0.0,  # the centroid of a flat print of known normal has no error that grows with its size
        hand_eye_m=noise.hand_eye_m,
        hand_eye_rad=noise.hand_eye_rad,
        image_age_s=noise.image_latency_s,
    )


class _Sensors:
    """Measures frames: joints, camera pose, attention window, segmentation, flow."""

    def __init__(self, rig: PrintRig, noise: SensorNoise, rng: np.random.Generator) -> None:
        self._rig, self._noise, self._rng = rig, noise, rng
        self._errors = sensors.draw_episode_errors(noise, rng)
        self._window: tuple[int, int, int, int] | None = None
        self._cut_outs: list[CutOut] = []

    def measure(self, time: float, image: ImageArray, inverse_distance: float) -> Instant:
        noise, rng, arm = self._noise, self._rng, self._rig.arm
        joint_pos, joint_vel = sensors.measure_joints(arm.joint_pos, arm.joint_vel, noise, rng)
        error = joint_pos - arm.joint_pos
        hand_eye = self._errors.hand_eye
        believed = sensors.measure_camera_pose(arm.camera_pose, arm.jacobian, error, hand_eye)
        calibrated = sensors.measure_camera_pose(arm.camera_pose, arm.jacobian, error, np.zeros(6))
        twist = sensors.measure_camera_twist(arm.jacobian, joint_vel, self._errors)
        motions = arm.jacobian @ arm.jacobian.T
        found, cut_out = self._look(time, image, believed)
        self._cut_outs = [*self._cut_outs[-2:], cut_out]
        flow = None
        if len(self._cut_outs) == 3:
            first, middle, last = self._cut_outs
            flow = sample_flow((first, middle, last), INTRINSICS, inverse_distance, rng)
        target = self._rig.print_position
        exact = sensors.measure_camera_pose(arm.camera_pose, arm.jacobian, np.zeros_like(error), hand_eye)
        in_lens = arm.camera_pose[:3, :3].T @ (target - arm.camera_pose[:3, 3])
        gaze_error = INTRINSICS.project(in_lens) - [INTRINSICS.cx, INTRINSICS.cy]
        twist_cov = noise.joint_vel_rad_s**2 * motions + 1e-10 * np.eye(6)
        known = RigMeasurement(noise.joint_pos_rad**2 * motions, twist_cov, flow)
        return Instant(
            seen=Frame(time, _NO_IMAGE, believed, twist, found, known),
            T_base_cam_calibrated=calibrated,
            distance_robot_m=float(exact[:3, 2] @ (target - exact[:3, 3])),
            distance_lens_m=float(in_lens[2]),
            gaze_error_px=float(np.linalg.norm(gaze_error)),
        )

    def _look(self, time: float, image: ImageArray, T_base_cam: FloatArray) -> tuple[Segmentation, CutOut]:
        """The target, and the cut-out that was looked at."""
        left, top, right, bottom = self._window or (0, 0, INTRINSICS.width, INTRINSICS.height)
        seen = sensors.measure_image(image[top:bottom, left:right], self._noise, self._errors.exposure, self._rng)
        camera = Intrinsics(
            right - left, bottom - top, INTRINSICS.fx, INTRINSICS.fy, INTRINSICS.cx - left, INTRINSICS.cy - top
        )
        found = segment(seen, camera)
        grey = np.asarray(cv2.cvtColor(seen, cv2.COLOR_RGB2GRAY), np.uint8)
        cut_out = CutOut(time, grey, (left, top), found.mask, T_base_cam)
        if not found.visible:
            self._window = None
            return found, cut_out
        columns, rows = np.flatnonzero(found.mask.any(axis=0)), np.flatnonzero(found.mask.any(axis=1))
        self._window = (
            max(0, left + int(columns[0]) - _ATTENTION_PX),
            max(0, top + int(rows[0]) - _ATTENTION_PX),
            min(INTRINSICS.width, left + int(columns[-1]) + 1 + _ATTENTION_PX),
            min(INTRINSICS.height, top + int(rows[-1]) + 1 + _ATTENTION_PX),
        )
        # The print faces the middle of the circle, and the robot knows how it is turned against that view.
        normal = T_base_cam[:3, :3].T @ HOME[:3, 2]
        centroid = flat_centroid(coverage(seen, found.mask), camera, normal)
        share = camera.width * camera.height / (INTRINSICS.width * INTRINSICS.height)
        return replace(found, centroid=centroid, area_fraction=share * found.area_fraction), cut_out


def record(rig: PrintRig, condition: Condition, noise: SensorNoise, rng: np.random.Generator) -> Recording:
    """Run one sequence on the simulated arm."""
    circle = Circle(condition, rng)
    first_guess = condition.distance_m * 2.0 ** rng.uniform(-1.0, 1.0)
    estimator = CalibratingEstimator(calibrating_settings(noise, first_guess))
    target = condition.print_position()
    start = circle.at(0.0)[0]
    ahead = target if condition.motion == "fixation" else start + HOME[:3, 2]
    rig.reset(look_at(start, ahead, np.array([0.0, 0.0, 1.0])), condition.print_width_m, target)
    sensing = _Sensors(rig, noise, rng)
    jump_at = round((BURN_IN_S + MEASURE_S) / rig.dt)
    frames: list[Instant] = []
    distance, image = first_guess, rig.image()
    for step in range(jump_at + round(AFTER_JUMP_S / rig.dt) + 1):
        frame = sensing.measure(step * rig.dt, image, 1.0 / distance)
        frames.append(frame)
        estimator.add_frame(frame.seen)
        distance = estimator.fixation(frame.seen.T_base_cam, frame.seen.segmentation).distance_m
        if step == jump_at:
            rig.move_print(target + condition.jump(rng))
        twist = _command(condition.motion, circle, frame.seen, distance, frames[0].seen, rig.dt)
        image = rig.image(rig.step(twist, noise.image_latency_s))
    return Recording(condition, tuple(frames), first_guess)


def _command(motion: Motion, circle: Circle, frame: Frame, distance: float, first: Frame, dt: float) -> FloatArray:
    """Camera twist for the next period, shape (6,)."""
    position, _ = circle.at(frame.time)
    _, velocity = circle.at(frame.time + 0.5 * dt)
    pose = frame.T_base_cam
    v = pose[:3, :3].T @ (velocity + _POSITION_GAIN * (position - pose[:3, 3]))
    if motion == "translation":
        turn = Rotation.from_matrix(pose[:3, :3].T @ first.T_base_cam[:3, :3]).as_rotvec()
        return np.clip(np.concatenate([v, _TURN_GAIN * turn]), -ROBOT.arm.twist_limits, ROBOT.arm.twist_limits)
    roll = _TURN_GAIN * float(np.clip(pose[2, 0], -0.5, 0.5))  # x axis back to the horizontal
    centroid = frame.segmentation.centroid if frame.segmentation.visible else np.zeros(2)
    w = gaze_rotation(centroid, _GAZE_GAIN, 1.0 / distance, v, roll)
    return np.clip(np.array([*v, *w, roll]), -ROBOT.arm.twist_limits, ROBOT.arm.twist_limits)
