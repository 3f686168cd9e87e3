"""The robot as policies know it: where the camera and the tool are on the hand, and how fast the camera may move.

Frames: ``hand`` is the Panda's flange frame, z along the approach axis, y along which the fingers open; ``cam`` is the
optical frame of the wrist camera.
"""

from __future__ import annotations

import math

import numpy as np

from fixation_gym.types import FloatArray

CAMERA_FOVY = math.radians(42.5)
"""Vertical field of view of a RealSense D435's colour stream at 640x480, rad."""
CAMERA_IN_HAND = (0.07, 0.0, 0.04)
"""Position of the camera in the hand frame, m. The optical axis is the hand's z axis, the approach axis."""
HAND_EYE = np.array(
    [
        [0.0, -1.0, 0.0, CAMERA_IN_HAND[0]],
        [1.0, 0.0, 0.0, CAMERA_IN_HAND[1]],
        [0.0, 0.0, 1.0, CAMERA_IN_HAND[2]],
        [0.0, 0.0, 0.0, 1.0],
    ]
)
HAND_EYE.setflags(write=False)
"""T_hand_cam: the fingers open along image x; image "down" points towards the fingers."""
TOOL_IN_HAND = (0.0, 0.0, 0.097)
"""Point between the finger pads in the hand frame, m."""

MAX_LINEAR_SPEED = 0.15
"""Camera speed along one axis at action 1, m/s."""
MAX_ANGULAR_SPEED = 0.8
"""Camera rotation rate about one axis at action 1, rad/s."""

TWIST_LIMITS: FloatArray = np.repeat([MAX_LINEAR_SPEED, MAX_ANGULAR_SPEED], 3)
"""Camera twist [v, w] at action 1, shape (6,), m/s and rad/s."""
TWIST_LIMITS.setflags(write=False)
TOOL_IN_CAMERA: FloatArray = HAND_EYE[:3, :3].T @ (np.array(TOOL_IN_HAND) - HAND_EYE[:3, 3])
"""Point between the finger pads in ``cam``, shape (3,), m: below the image centre and ahead."""
TOOL_IN_CAMERA.setflags(write=False)
