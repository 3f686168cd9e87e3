import math
from dataclasses import replace

import pytest

from policies.servo.gains import ServoGains
from policies.servo.phases import Phase, Situation, next_phase

GAINS = ServoGains()
READY = Situation(
    phase_seconds=10.0,
    unseen_seconds=0.0,
    distance=GAINS.desired_distance,
    distance_std=0.001,
    offset=0.0,
    blocked=False,
    arrived=False,
    gripper_width=0.08,
)


@pytest.mark.parametrize(
    ("phase", "change", "expected"),
    [
        (Phase.SEARCH, {"unseen_seconds": math.inf}, Phase.SEARCH),
        (Phase.SEARCH, {}, Phase.FIXATE),
        (Phase.FIXATE, {"phase_seconds": 0.1}, Phase.FIXATE),
        (Phase.FIXATE, {"distance_std": 0.1}, Phase.FIXATE),
        (Phase.FIXATE, {}, Phase.APPROACH),
        (Phase.FIXATE, {"unseen_seconds": 2.0}, Phase.RECOVER),
        (Phase.APPROACH, {"distance": 0.4}, Phase.APPROACH),
        (Phase.APPROACH, {"blocked": True}, Phase.APPROACH),
        (Phase.APPROACH, {"offset": 0.2}, Phase.APPROACH),
        (Phase.APPROACH, {"distance_std": 0.05}, Phase.APPROACH),
        (Phase.APPROACH, {"unseen_seconds": 2.0}, Phase.RECOVER),
        (Phase.APPROACH, {}, Phase.GRASP),
        (Phase.GRASP, {"phase_seconds": 1.0}, Phase.GRASP),
        (Phase.GRASP, {"arrived": True}, Phase.CLOSE),
        (Phase.GRASP, {}, Phase.RECOVER),
        (Phase.CLOSE, {"phase_seconds": 0.2, "gripper_width": 0.0}, Phase.CLOSE),
        (Phase.CLOSE, {"gripper_width": 0.03}, Phase.LIFT),
        (Phase.CLOSE, {"gripper_width": 0.0}, Phase.RECOVER),
        (Phase.LIFT, {"gripper_width": 0.03}, Phase.LIFT),
        (Phase.LIFT, {"gripper_width": 0.0}, Phase.RECOVER),
        (Phase.RECOVER, {"phase_seconds": 0.5}, Phase.RECOVER),
        (Phase.RECOVER, {"arrived": True}, Phase.FIXATE),
        (Phase.RECOVER, {"arrived": True, "unseen_seconds": 9.0}, Phase.SEARCH),
    ],
)
def test_every_transition_has_its_condition(phase, change, expected):
    assert next_phase(phase, replace(READY, **change), GAINS) is expected
