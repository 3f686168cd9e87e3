"""The path of a picture as ``docs/architecture.md`` draws it is the one that it takes through the servo."""

import re
import sys
from pathlib import Path

from test_kinematic_loop import INTRINSICS, RADIUS, START, TARGET, run

from fixation_gym.perception.pipeline import Perception
from fixation_policies.servo.servo_policy import ServoPolicy

PAGE = Path(__file__).parents[2] / "docs" / "architecture.md"
STAGES = {
    "expectation": "expected_at",
    "detection": "detected",
    "distance": "add_frame",
    "flow": "estimate_flow",
    "own motion": "target_inverse_depth",
    "zero-flow map": "zero_flow_test",
    "body": "with_outline",
    "hand-eye": "learn",
    "memory": "remember",
    "looking": "with_seen",
    "obstacle term": "obstacle_term",
    "phases": "next_phase",
    "choice of way": "chosen_way",
    "laws": "cyclic_velocity",
    "gaze": "fixating_twist",
    "open loop": "gripper_command",
}
"""The function that does the work of each."""


class Traced(ServoPolicy):
    """Notes the functions that are called in its first approaching step, in their order, with the files they are in."""

    calls = None

    def respond(self, observation, fresh=True):
        if self.calls is not None or self.estimate is None or self.estimate.phase != "approach":
            return super().respond(observation, fresh)
        self.calls = {}
        sys.setprofile(self._note)
        try:
            return super().respond(observation, fresh)
        finally:
            sys.setprofile(None)

    def _note(self, frame, event, _):
        if event == "call":
            code = frame.f_code
            self.calls.setdefault((code.co_name, Path(code.co_filename).name), len(self.calls))


def drawn():
    """Stages between the picture and the twist by the drawing: name -> files."""
    drawing = re.search(r"```\n(.*?)```", PAGE.read_text(), re.DOTALL).group(1)
    rows = {}
    for line in drawing[: drawing.index("camera twist ->")].splitlines()[2:]:
        name, _, rest = line.partition("|")
        key = name.strip() or (list(rows) or [""])[-1]
        if rest:
            rows[key] = rows.get(key, []) + re.findall(r"(\w+\.py)", rest)
    return rows


def test_a_picture_passes_the_stages_in_the_order_of_the_page():
    policy = Traced(Perception(INTRINSICS, support_height_m=TARGET[2] - RADIUS))
    run(policy, START, 5.0)
    assert policy.calls is not None
    rows = drawn()
    assert list(rows) == list(STAGES)
    first = {}
    for stage, function in STAGES.items():
        found = [order for (name, file), order in policy.calls.items() if name == function and file in rows[stage]]
        assert found, f"{function} of {stage} is not called, or not in {rows[stage]}"
        first[stage] = found[0]
    assert sorted(first, key=first.__getitem__) == list(STAGES)
