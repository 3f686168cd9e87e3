"""What is remembered around the target, and when it is forgotten."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.detection.segmentation import segmentation_of
from fixation_gym.perception.distance.pose_filter import Fixation
from fixation_gym.perception.flow.optic_flow import invalid_flow
from fixation_gym.perception.hand_eye.hand_eye_filter import HandEyeSettings, HandEyeState, first_state
from fixation_gym.perception.percept import Percept
from fixation_gym.perception.zero_flow.zero_flow import unknown_zero_flow
from fixation_gym.surroundings import Surroundings

CAMERA = Intrinsics(64, 48, 60.0, 60.0, 32.0, 24.0)
T_BASE_CAM = np.array([[1.0, 0, 0, 0], [0, -1.0, 0, 0], [0, 0, -1.0, 0.5], [0, 0, 0, 1.0]])
TARGET = np.array([0.0, 0.0, 0.1])


def percept(time: float, hand_eye: HandEyeState | None) -> Percept:
    """All of the picture is surely in front of the target, 0.25 m away."""
    flow = replace(invalid_flow(time, CAMERA.scaled(96, 128)), valid=True, intrinsics=CAMERA)
    zero_flow = unknown_zero_flow(CAMERA.height, CAMERA.width)
    zero_flow.p_nearer[...], zero_flow.supported[...] = 1.0, True
    zero_flow.inverse_depth[...], zero_flow.inverse_depth_std[...] = 4.0, 0.01
    zero_flow = replace(zero_flow, fixated_inverse_depth=2.5)
    fixation = Fixation(True, np.zeros(2), TARGET, 0.4, 1e-3, 0.0, True)
    return Percept(
        time,
        segmentation_of(np.zeros((48, 64), np.bool_), CAMERA),
        flow,
        zero_flow,
        fixation,
        T_BASE_CAM,
        hand_eye=hand_eye,
    )


def points_after(states: Sequence[HandEyeState]) -> int:
    """Points that are believed after one picture with each of the states."""
    surroundings = Surroundings()
    for k, state in enumerate(states):
        surroundings.look(percept(0.04 * k, state), support_height_m=None)
    return len(surroundings.obstacles(TARGET).points)


def test_what_was_seen_before_a_hand_eye_error_was_proven_is_forgotten():
    learning = first_state(HandEyeSettings())
    proven = replace(learning, proven=True)
    assert points_after([learning] * 8) > 50
    assert points_after([learning] * 8 + [proven]) == 0
    assert points_after([learning] * 8 + [proven] * 8) > 50  # once, and not with every picture
