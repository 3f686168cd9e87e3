"""The paper's algorithm: its lateral law, what it sees in front, and that it comes to the target."""

from dataclasses import fields
from itertools import pairwise

import numpy as np
import pytest
from test_kinematic_loop import INTRINSICS, START, TARGET, run

from fixation_policies.catalogue import POLICY_NAMES
from fixation_policies.paper import PAPER_NAMES, PAPER_VARIANTS, PaperPolicy, centre_of_what_is_in_front, paper_variant

TABLE = -1.0


def test_each_step_changes_something_and_keeps_what_came_before():
    assert PAPER_NAMES[0] == "paper"
    assert set(PAPER_NAMES) <= set(POLICY_NAMES)
    names = [item.name for item in fields(PAPER_VARIANTS[0]) if item.name not in ("name", "summary")]
    changed = []
    for before, after in pairwise(PAPER_VARIANTS):
        now = {name for name in names if getattr(before, name) != getattr(after, name)}
        assert now
        assert not now & set(changed)
        changed += now


@pytest.mark.parametrize("name", ["paper", "paper:feed_forward", "paper:pose_filter"])
def test_it_comes_to_the_target_with_its_gaze_on_it(name):
    policy = paper_variant(name).policy(INTRINSICS, TABLE)
    assert isinstance(policy, PaperPolicy)
    trail = run(policy, START, 10.0)
    distances = [np.linalg.norm(T_base_cam[:3, 3] - TARGET) for _, _, T_base_cam, _ in trail]
    assert min(distances) < 0.25
    late = [T_base_cam for time, estimate, T_base_cam, _ in trail if time > 2.0 and estimate.phase == "approach"]
    for T_base_cam in late[:50]:
        x, y, z = T_base_cam[:3, :3].T @ (TARGET - T_base_cam[:3, 3])
        assert np.hypot(x, y) / z < 0.12  # without feed-forward the gaze lags behind


def test_the_obstacle_term_is_the_mean_place_of_the_pixels_in_front():
    policy = paper_variant("paper").policy(INTRINSICS, TABLE)
    run(policy, START, 0.6)
    percept = policy.percept
    front = percept.zfc.supported & (percept.zfc.p_nearer > 0.5)
    x, y = percept.flow.intrinsics.grid
    expected = [x[front].mean(), y[front].mean()] if front.any() else [0.0, 0.0]
    np.testing.assert_allclose(centre_of_what_is_in_front(percept), expected)
