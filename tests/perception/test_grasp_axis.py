import cv2
import numpy as np
import pytest

from fixation_gym.perception.body.grasp_axis import narrow_axis

MAX_ROLL = np.radians(50.0)


def box_mask(angle_deg: float, length: int, width: int) -> np.ndarray:
    """A box whose narrow side points along ``angle_deg``, clockwise from the image's x axis."""
    mask = np.zeros((200, 200), np.uint8)
    corners = cv2.boxPoints(((100, 100), (width, length), angle_deg))
    cv2.fillPoly(mask, [np.round(corners).astype(np.int32)], 1)
    return mask.astype(bool)


@pytest.mark.parametrize("angle", [-40.0, -20.0, 0.0, 15.0, 35.0])
def test_the_gripper_turns_across_a_long_box(angle):
    found = np.degrees(narrow_axis(box_mask(angle, 100, 40), roll=0.0, max_roll=MAX_ROLL))
    assert found == pytest.approx(angle, abs=6.0)


def test_a_roll_already_made_counts():
    found = np.degrees(narrow_axis(box_mask(10.0, 100, 40), roll=np.radians(20.0), max_roll=MAX_ROLL))
    assert found == pytest.approx(10.0, abs=6.0)


def test_a_round_target_leaves_the_hand_level():
    mask = np.zeros((200, 200), np.uint8)
    cv2.circle(mask, (100, 100), 40, 1, -1)
    assert np.degrees(narrow_axis(mask.astype(bool), np.radians(30.0), MAX_ROLL)) == pytest.approx(-30.0, abs=6.0)


def test_no_target_asks_for_no_turn():
    assert narrow_axis(np.zeros((20, 20), bool), 0.3, MAX_ROLL) == 0.0
