import math
from dataclasses import replace

import pytest

from fixation_gym.control.open_loop import Stage
from fixation_policies.servo.gains import ServoGains
from fixation_policies.servo.phases import Phase, Situation, next_phase
from fixation_policies.servo.variants import servo_variant

GAINS = ServoGains()
READY = Situation(
    phase_seconds=10.0,
    unseen_seconds=0.0,
    distance=GAINS.desired_distance,
    distance_std=0.001,
    offset=0.0,
    blocked=False,
)


@pytest.mark.parametrize(
    ("phase", "change", "expected"),
    [
        (Phase.SEARCH, {"unseen_seconds": math.inf}, Phase.SEARCH),
        (Phase.SEARCH, {}, Phase.FIXATE),
        (Phase.FIXATE, {"phase_seconds": 0.1}, Phase.FIXATE),
        (Phase.FIXATE, {"distance_std": 0.1}, Phase.FIXATE),
        (Phase.FIXATE, {}, Phase.APPROACH),
        (Phase.FIXATE, {"unseen_seconds": 2.0}, Phase.SEARCH),
        (Phase.APPROACH, {"distance": 0.4}, Phase.APPROACH),
        (Phase.APPROACH, {"blocked": True}, Phase.APPROACH),
        (Phase.APPROACH, {"offset": 0.2}, Phase.APPROACH),
        (Phase.APPROACH, {"distance_std": 0.05}, Phase.APPROACH),
        (Phase.APPROACH, {"excess_roll": 0.1}, Phase.APPROACH),
        (Phase.APPROACH, {"excess_roll": 0.1, "phase_seconds": 16.0}, Stage.GRASP),
        (Phase.APPROACH, {"unseen_seconds": 2.0}, Phase.SEARCH),
        (Phase.APPROACH, {}, Stage.GRASP),
    ],
)
def test_every_transition_has_its_condition(phase, change, expected):
    assert next_phase(phase, replace(READY, **change), GAINS) is expected


@pytest.mark.parametrize(("grasps", "expected"), [(0, Stage.GRASP), (1, Phase.APPROACH)])
def test_without_retry_the_second_grasp_does_not_begin(grasps, expected):
    gains = servo_variant("servo:no_retry").gains
    assert next_phase(Phase.APPROACH, replace(READY, grasps=grasps), gains) is expected
    assert next_phase(Phase.APPROACH, replace(READY, grasps=grasps), GAINS) is Stage.GRASP
