"""The code of docs/on_your_robot.md runs as it is written: calibration by a board, and a robot behind the door."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fixation_gym.geometry.rigid import inverse, look_at, pose_to_matrix
from fixation_gym.geometry.twist import exp_twist
from fixation_gym.types import Command

CORNERS, SQUARE_M, SIZE = (9, 6), 0.025, (480, 360)
K = np.array([[430.0, 0.0, 236.0], [0.0, 433.0, 182.0], [0.0, 0.0, 1.0]])
T_HAND_CAM = np.eye(4)
T_HAND_CAM[:3, :3] = Rotation.from_euler("xyz", [2.0, -3.0, 91.0], degrees=True).as_matrix()
T_HAND_CAM[:3, 3] = 0.05, -0.01, 0.06


@pytest.fixture(scope="module")
def page():
    text = (Path(__file__).parent.parent / "docs" / "on_your_robot.md").read_text()
    names = {"__name__": "on_your_robot"}
    exec(compile("\n".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL)), "on_your_robot.md", "exec"), names)
    return names


def board_picture(T_cam_board, pixels_per_square=32):
    """The board, exactly projected: a homography takes its plane to the image."""
    columns, rows = CORNERS[0] + 1, CORNERS[1] + 1
    squares = np.indices((rows, columns)).sum(axis=0) % 2
    flat = np.kron(squares, np.ones((pixels_per_square, pixels_per_square))).astype(np.uint8) * 255
    flat = cv2.copyMakeBorder(flat, *[pixels_per_square] * 4, cv2.BORDER_CONSTANT, value=255)
    # Pixel centres to metres; the origin is the first inner corner, which is 2 squares from the border.
    scale = SQUARE_M / pixels_per_square
    shift = SQUARE_M * (0.5 / pixels_per_square - 2.0)
    to_board = np.array([[scale, 0.0, shift], [0.0, scale, shift], [0.0, 0.0, 1.0]])
    homography = K @ T_cam_board[:3, [0, 1, 3]] @ to_board
    return cv2.warpPerspective(flat, homography, SIZE, flags=cv2.INTER_AREA, borderValue=128)


def test_the_board_gives_back_camera_and_hand_eye(page):
    rng = np.random.default_rng(0)
    middle = SQUARE_M * np.array([4.0, 2.5, 0.0])
    pictures, hands = [], []
    for _ in range(14):
        offset = Rotation.from_euler("xy", rng.uniform(-35.0, 35.0, 2), degrees=True).apply([0.0, 0.0, -0.4])
        up = Rotation.from_euler("z", rng.uniform(-40.0, 40.0), degrees=True).apply([0.0, -1.0, 0.0])
        T_board_cam = look_at(middle + offset * rng.uniform(0.8, 1.1), middle, up)
        pictures.append(board_picture(inverse(T_board_cam)))
        hands.append(T_board_cam @ inverse(T_HAND_CAM))  # the board's frame is the base
    found_K, _, left_px, boards, shown = page["calibrate"](pictures, CORNERS, SQUARE_M)
    assert len(shown) >= 10
    assert left_px < 0.5
    np.testing.assert_allclose(found_K, K, rtol=0.01, atol=3.0)
    found = page["hand_eye"](np.array(hands)[shown], boards)
    np.testing.assert_allclose(found[:3, 3], T_HAND_CAM[:3, 3], atol=2e-3)
    turn = Rotation.from_matrix(found[:3, :3].T @ T_HAND_CAM[:3, :3]).magnitude()
    assert turn < np.radians(0.3)


def test_hand_eye_is_exact_for_exact_poses(page):
    rng = np.random.default_rng(1)
    hands = np.array([exp_twist(rng.normal(0.0, 0.4, 6), 1.0) for _ in range(6)])
    T_base_board = exp_twist(rng.normal(0.0, 0.5, 6), 1.0)
    boards = np.array([inverse(hand @ T_HAND_CAM) @ T_base_board for hand in hands])
    np.testing.assert_allclose(page["hand_eye"](hands, boards), T_HAND_CAM, atol=1e-9)


def test_the_robot_of_the_page_reads_stamps_and_moves_the_flange_so_that_the_camera_moves_as_asked(page):
    T_base_hand = exp_twist(np.array([0.3, 0.1, 0.4, 0.2, 0.4, -0.3]), 1.0)

    class Arm:
        asked = fingers = None

        def newest(self):
            return np.zeros(6), np.zeros(6), T_base_hand, 0.07, 5.04

        def move(self, twist):
            self.asked = twist

        def move_fingers(self, gripper):
            self.fingers = gripper

    class Camera:
        def newest(self):
            return np.zeros((4, 4, 3), np.uint8), 5.0

    arm = Arm()
    robot = page["MyRobot"](arm, Camera(), T_HAND_CAM)
    observation = robot.observe()
    assert (observation.time, observation.image_time) == (5.04, 5.0)
    np.testing.assert_allclose(pose_to_matrix(observation.camera_pose), T_base_hand @ T_HAND_CAM, atol=1e-12)
    twist = np.array([0.05, -0.02, 0.1, 0.3, -0.2, 0.1])
    robot.command(Command(twist, -1.0))
    assert arm.fingers == -1.0
    moved = T_base_hand @ exp_twist(arm.asked, 0.1) @ T_HAND_CAM
    np.testing.assert_allclose(moved, T_base_hand @ T_HAND_CAM @ exp_twist(twist, 0.1), atol=1e-12)
