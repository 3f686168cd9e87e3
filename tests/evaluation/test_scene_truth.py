"""What traces know of the scene, against the environment itself."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from evaluation_fakes import FakeEnv

import fixation_gym  # noqa: F401
from fixation_gym.evaluation.rollout import run_episode
from fixation_gym.evaluation.scene_truth import scene_of
from fixation_policies.baselines import RandomPolicy


def test_other_environments_have_no_scene() -> None:
    assert scene_of(FakeEnv()) is None


@pytest.mark.sim
def test_a_trace_has_every_box_where_its_body_is() -> None:
    scenario = {"obstacle_materials": ["mirror", "opaque"], "obstacle_count": [2, 6]}
    env = gymnasium.make(
        "FixationPick-v0", scenario=scenario, image_size=(32, 32), max_episode_steps=3, disable_env_checker=True
    )
    for seed in range(2):
        trace = run_episode(env, RandomPolicy(), seed).trace
        assert trace is not None
        base = env.unwrapped
        placed = {(obstacle.kind, *np.round(obstacle.position, 4)) for obstacle in base.scene.obstacles}
        kinds = [box.name for box in trace.boxes]
        assert kinds[0] == "target"
        assert {(kind, *np.round(at, 4)) for kind, at in zip(kinds[1:], trace.things_m[0, 1:], strict=True)} == placed
        np.testing.assert_allclose(trace.things_m[0, 0], base.scene.target.position, atol=1e-6)
        np.testing.assert_allclose(trace.tool_m[-1], base.sim.tool_position())
        assert len(trace.phases) == 4
    env.close()
