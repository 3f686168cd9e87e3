"""Who tells the distance in a replay, and what it expects of the poses of a recording."""

from __future__ import annotations

import math

from fixation_gym.perception.distance.calibrating_estimator import CalibratingEstimator
from fixation_gym.perception.distance.calibrating_filter import CalibratingSettings
from fixation_gym.perception.distance.estimator import DistanceEstimator, PoseEstimator
from fixation_gym.perception.distance.pose_filter import DistanceSettings
from fixation_gym.perception.hand_eye.hand_eye_filter import HandEyeSettings
from fixation_gym.replay.config import ReplayConfig

_MOMENTARY = 0.5
"""Share of the poses' error that differs from picture to picture."""
_NOISE_DOF = 4.0
"""What is said of the noise counts as two pictures."""
_IMAGE_AGE_S, _FOCAL = 0.02, 0.01
"""Offset between the stamps of pictures and poses to expect, s, and relative error of the focal length."""


def chosen_estimator(config: ReplayConfig) -> DistanceEstimator:
    """The estimator that the options ask for, with the noise that they say."""
    if config.estimator == "calibrating":
        return CalibratingEstimator(learning_settings(config))
    position, rotation = _pose_noise(config)
    return PoseEstimator(DistanceSettings(position_std_m=position, rotation_std_rad=rotation))


def learning_settings(config: ReplayConfig) -> CalibratingSettings:
    """What the calibrating estimator expects of a recording."""
    position, rotation = _pose_noise(config)
    usual = DistanceSettings()
    return CalibratingSettings(
        centroid_std=usual.centroid_std,
        centroid_std_size=usual.centroid_std_size,
        position_std_m=_MOMENTARY * position,
        rotation_std_rad=_MOMENTARY * rotation,
        noise_dof=_NOISE_DOF,
        hand_eye_m=position,
        hand_eye_rad=rotation,
        image_age_s=_IMAGE_AGE_S,
        focal=_FOCAL,
    )


def hand_eye_settings(config: ReplayConfig) -> HandEyeSettings:
    """What a table of known height may tell of the hand-eye error of a recording."""
    position, rotation = _pose_noise(config)
    return HandEyeSettings(translation_std_m=position, rotation_std_rad=rotation)


def _pose_noise(config: ReplayConfig) -> tuple[float, float]:
    """Of the options, in m and rad."""
    position_mm, rotation_deg = config.pose_noise
    return 1e-3 * position_mm, math.radians(rotation_deg)
