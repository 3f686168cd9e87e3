"""Planned motions as functions of time."""

import math

import pytest

from fixation_gym.envs.motion import Motion, places, planned


def test_a_push_goes_straight_at_its_speed_and_stays():
    push = Motion(start_s=2.0, displacement=(0.03, -0.04), speed=0.1)
    assert planned(push, 1.9) == ((0.0, 0.0), (0.0, 0.0))
    offset, velocity = planned(push, 2.25)
    assert offset == pytest.approx((0.015, -0.02))
    assert velocity == pytest.approx((0.06, -0.08))
    assert push.end_s == pytest.approx(2.5)
    assert planned(push, 2.6) == ((0.03, -0.04), (0.0, 0.0))


def test_what_is_driven_turns_at_both_ends_for_ever():
    drive = Motion(start_s=0.0, displacement=(0.1, 0.0), speed=0.05, to_and_fro=True)
    for time, x in ((1.0, 0.05), (2.0, 0.1), (3.0, 0.05), (4.0, 0.0), (5.0, 0.05), (102.0, 0.1)):
        assert planned(drive, time)[0] == pytest.approx((x, 0.0)), time
    assert planned(drive, 1.0)[1] == pytest.approx((0.05, 0.0))
    assert planned(drive, 3.0)[1] == pytest.approx((-0.05, 0.0))
    assert drive.end_s == math.inf


def test_places_lie_close_on_the_whole_way():
    offsets = places(Motion(0.0, (0.0, 0.09), 0.1))
    assert offsets[0] == pytest.approx([0.0, 0.0, 0.0])
    assert offsets[-1] == pytest.approx([0.0, 0.09, 0.0])
    assert 0.0 < offsets[1, 1] <= 0.02
    assert places(None).tolist() == [[0.0, 0.0, 0.0]]


@pytest.mark.parametrize(("start", "speed"), [(-1.0, 0.1), (0.0, 0.0)])
def test_a_motion_without_time_or_speed_is_refused(start, speed):
    with pytest.raises(ValueError, match="speed > 0"):
        Motion(start, (0.1, 0.0), speed)
