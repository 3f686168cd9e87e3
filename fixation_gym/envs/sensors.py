"""What the robot measures of the true state: encoder, hand-eye and camera errors (presets in ``sensor_noise``)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fixation_gym.compiled import compiled
from fixation_gym.envs.sensor_noise import SensorNoise
from fixation_gym.geometry.rigid import inverse, matrix_to_pose
from fixation_gym.geometry.twist import adjoint
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, ImageArray

if TYPE_CHECKING:
    from fixation_gym.envs.pick_sim import ArmState


@dataclass(frozen=True, eq=False)
class EpisodeErrors:
    """Errors that stay the same for one episode."""

    hand_eye: FloatArray
    """Small motion [translation in m, rotation vector in rad] from the true to the believed camera frame, (6,)."""
    believed_from_true: FloatArray
    """Matrix, shape (6, 6), that turns a twist of the true camera frame into the believed one's."""
    exposure: float
    """Factor on every grey level."""
    joints: FloatArray | float = 0.0
    """Of the joint angles, shape (n,), rad."""


def draw_episode_errors(noise: SensorNoise, rng: np.random.Generator) -> EpisodeErrors:
    """Draw the calibration errors of one episode."""
    scale = np.repeat([noise.hand_eye_m, noise.hand_eye_rad], 3)
    exposure = 1.0 + noise.exposure_gain * rng.standard_normal()
    hand_eye = rng.standard_normal(6) * scale
    T_true_believed = np.eye(4)
    T_true_believed[:3, :3] = _small_rotation(hand_eye[3:])
    T_true_believed[:3, 3] = hand_eye[:3]
    joints = noise.joint_bias_rad * rng.standard_normal(ROBOT.arm.joints) if noise.joint_bias_rad else 0.0
    return EpisodeErrors(hand_eye, adjoint(inverse(T_true_believed)), float(max(0.2, exposure)), joints)


def measure_joints(
    joint_pos: FloatArray, joint_vel: FloatArray, noise: SensorNoise, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Encoder readings of joint angles and velocities, each of shape (n,), rad and rad/s."""
    return (
        joint_pos + noise.joint_pos_rad * rng.standard_normal(len(joint_pos)),
        joint_vel + noise.joint_vel_rad_s * rng.standard_normal(len(joint_vel)),
    )


def measure_camera_pose(
    T_base_cam: FloatArray, jacobian: FloatArray, joint_error: FloatArray, hand_eye: FloatArray
) -> FloatArray:
    """Camera pose that kinematics gives for erroneous joint angles, shape (4, 4).

    The joint errors are below 1e-3 rad, so their effect is taken to first order through the Jacobian, (6, n) in cam.
    """
    motion = jacobian @ joint_error + hand_eye
    pose = np.array(T_base_cam)
    pose[:3, 3] += T_base_cam[:3, :3] @ motion[:3]
    pose[:3, :3] = T_base_cam[:3, :3] @ _small_rotation(motion[3:])
    return pose


def measure_camera_twist(jacobian: FloatArray, joint_vel: FloatArray, errors: EpisodeErrors) -> FloatArray:
    """Twist [v, w], shape (6,), that kinematics gives in the camera frame as the hand-eye calibration believes it."""
    return errors.believed_from_true @ (jacobian @ joint_vel)


def measure_arm(
    arm: ArmState, noise: SensorNoise, errors: EpisodeErrors, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Joint angles and rates, rad and rad/s, and the camera's pose (4, 4) and twist (6,) that follow from them."""
    joint_pos, joint_vel = measure_joints(arm.joint_pos, arm.joint_vel, noise, rng)
    joint_pos = joint_pos + errors.joints
    pose = measure_camera_pose(arm.camera_pose, arm.jacobian, joint_pos - arm.joint_pos, errors.hand_eye)
    return joint_pos, joint_vel, pose, measure_camera_twist(arm.jacobian, joint_vel, errors)


def arm_reading(arm: ArmState, noise: SensorNoise, errors: EpisodeErrors, rng: np.random.Generator) -> dict[str, Any]:
    """What the observation says of the arm, by its keys there."""
    joint_pos, joint_vel, pose, twist = measure_arm(arm, noise, errors, rng)
    return {
        "joint_pos": joint_pos,
        "joint_vel": joint_vel,
        "gripper_width": [arm.gripper_width],
        "camera_pose": matrix_to_pose(pose),
        "camera_twist": twist,
    }


def _small_rotation(vector: FloatArray) -> FloatArray:
    """Rotation matrix of a rotation vector of some mrad, to second order."""
    x, y, z = vector.tolist()
    xx, yy, zz, xy, xz, yz = (0.5 * product for product in (x * x, y * y, z * z, x * y, x * z, y * z))
    return np.array([[1.0 - yy - zz, xy - z, xz + y], [xy + z, 1.0 - xx - zz, yz - x], [xz - y, yz + x, 1.0 - xx - yy]])


def measure_image(image: ImageArray, noise: SensorNoise, exposure: float, rng: np.random.Generator) -> ImageArray:
    """Camera image with exposure error, read noise and shot noise, shape (H, W, 3), uint8."""
    if noise.read_noise == 0.0 and noise.shot_noise == 0.0 and exposure == 1.0:
        return image
    # Mean and standard deviation depend on the grey level alone: two tables of 256 entries.
    signal = np.arange(256, dtype=np.float32) * np.float32(exposure)
    deviation = np.sqrt(np.float32(noise.read_noise**2) + np.float32(noise.shot_noise) * signal)
    bits = rng.integers(0, 2**64 - 1, -(-image.size // 4), dtype=np.uint64, endpoint=True).view(np.uint16)
    noisy = np.empty(image.shape, np.uint8)
    _add_noise(image.ravel(), bits, _normal_quantiles(), signal, deviation, noisy.ravel())
    return noisy


_QUANTILE_BITS = 12


@lru_cache(maxsize=1)
def _normal_quantiles() -> NDArray[np.float32]:
    """Equally likely values of a standard normal variable, up to 3.7 of its standard deviations; read-only."""
    levels = 1 << _QUANTILE_BITS
    standard = NormalDist()
    quantiles = np.array([standard.inv_cdf((level + 0.5) / levels) for level in range(levels)])
    table = (quantiles / quantiles.std()).astype(np.float32)
    table.setflags(write=False)
    return table


@compiled
def _add_noise(
    image: NDArray[np.uint8],
    bits: NDArray[np.uint16],
    quantiles: NDArray[np.float32],
    signal: NDArray[np.float32],
    deviation: NDArray[np.float32],
    noisy: NDArray[np.uint8],
) -> None:
    """Write signal + deviation * normal variable, rounded, of every value; compiled, as it runs in every frame.

    Looking up quantiles costs a tenth of drawing normal variables, and a camera image is whole numbers anyway.
    """
    for i in range(image.size):
        value = signal[image[i]] + deviation[image[i]] * quantiles[bits[i] >> (16 - _QUANTILE_BITS)]
        noisy[i] = np.uint8(min(max(value + np.float32(0.5), np.float32(0.0)), np.float32(255.0)))
