"""Franka's Panda with a RealSense D435 on its hand, at robosuite's table."""

from __future__ import annotations

import math

from fixation_gym.robots.model import Arm, Hand, Reach, RobotModel, Simulated, WorkSpace, WristCamera

_CAMERA = WristCamera(
    fovy=math.radians(42.5),  # of the colour stream at 640x480
    in_hand=(0.07, 0.0, 0.04),
    housing=(0.045, 0.0125, 0.0125),  # its front lies just behind the optical centre
    housing_behind=0.014,
    mass=0.07,
)

_HAND = Hand(
    tool=(0.0, 0.0, 0.097),
    solid=(  # measured on the collision meshes
        ((-0.067, -0.011, -0.044), (0.067, 0.011, 0.010)),  # fingers
        ((-0.104, -0.033, -0.123), (0.104, 0.033, -0.031)),  # hand: its front is the palm
        ((-0.046, -0.084, -0.084), (0.046, -0.057, -0.058)),  # camera
        ((-0.055, -0.045, -0.152), (0.090, 0.045, -0.097)),  # flange
    ),
    wrist=((-0.140, -0.130, -0.285), (0.075, 0.045, -0.152)),
    opening=0.08,
    finger_speed=0.10,
    finger_reach=(0.050, 0.011, 0.010),
    finger_span=(0.077, 0.082),
    grasp_widths=(0.025, 0.07),
)

# Found by moving the arm there in simulation: tests/envs/test_reach_sim.py. The camera keeps level, goes around the
# target at 0.42 m and comes straight in until the tool is at the target. Low down the arm reaches the side that its
# elbow leaves free; from steeply above it reaches nearly everything.
_REACH = Reach(
    rows_deg=(
        (40.0, 32.0, 88.0),
        (50.0, 28.0, 98.0),
        (60.0, 18.0, 112.0),
        (70.0, -45.0, 125.0),
        (85.0, -70.0, 130.0),
    ),
    orbit_deg=(38.0, 86.0),
    start_deg=(30.0, 82.0),
    folded=0.36,
)

_ARM = Arm(
    posture=(-0.3, 0.07, -0.35, -2.5, 1.1, 2.28, -1.5),
    posture_ahead=(0.0, -1.0, 0.0, -2.4, 0.0, 2.97, 0.785),
    camera_ahead=(0.295, 0.0, 0.87),
    joint_speeds=(2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61),  # Franka's limits
    linear_speed=0.15,
    angular_speed=0.8,
    position_std=1e-4,  # both as in the preset "conservative" of sensor noise
    rotation_std=2e-4,
    reach=_REACH,
)

_WORKSPACE = WorkSpace(
    table_height=-0.112,
    table=((0.24, 0.90), (-0.36, 0.36)),
    targets=((0.50, 0.62), (-0.14, 0.14)),
    pushed_targets=((0.46, 0.66), (-0.18, 0.18)),
)

PANDA = RobotModel(
    camera=_CAMERA,
    hand=_HAND,
    arm=_ARM,
    workspace=_WORKSPACE,
    simulated=Simulated(robot="Panda", gripper="PandaGripper", base="link0", first_link="link1"),
)
