"""Policies in the simulator, and the catalogue."""

import gymnasium as gym
import numpy as np
import pytest

import fixation_gym  # noqa: F401
from fixation_gym.evaluation.rollout import run_episode
from fixation_policies.baselines import RandomPolicy
from fixation_policies.catalogue import POLICY_NAMES, make_policy


def play(env, policy, seed):
    obs, _ = env.reset(seed=seed)
    policy.reset(seed)
    done = False
    while not done:
        action = policy.act(obs)
        assert env.action_space.contains(action)
        obs, _, terminated, truncated, info = env.step(action)
        done = terminated or truncated
    return info


@pytest.mark.sim
@pytest.mark.parametrize("scenario", ["clear", "opaque", "translucent", "mirror"])
def test_the_servo_mostly_picks_without_collision_and_knows_the_distance_of_the_centre(scenario):
    env = gym.make("FixationPick-v0", scenario=scenario)
    results = [run_episode(env, make_policy("servo", env), seed=500_000 + i) for i in range(3)]
    env.close()
    picked = [result for result in results if result.collision_free_success]
    assert len(picked) >= 2
    errors = [result.distance_error_at_grasp_m for result in picked]
    assert np.median(errors) < 0.003
    assert max(errors) < 0.010  # a duck is no body of the fitted kind: 0.2 to 6 mm in seven episodes with one


@pytest.mark.sim
@pytest.mark.parametrize("scenario", ["opaque", "moving_obstacle", "moving_target"])
def test_the_oracle_picks_without_collision(scenario):
    env = gym.make("FixationPick-v0", scenario=scenario, image_size=None)
    info = play(env, make_policy("oracle", env), seed=500_000)
    env.close()
    assert info["is_success"]
    assert not info["collision"]


def test_an_unknown_policy_lists_the_known_ones():
    with pytest.raises(ValueError, match=", ".join(POLICY_NAMES)):
        make_policy("clever", None)


def test_random_actions_repeat_with_the_seed():
    policy = RandomPolicy()
    sequences = []
    for seed in (1, 1, 2):
        policy.reset(seed)
        sequences.append(np.array([policy.act({}) for _ in range(30)]))
    np.testing.assert_array_equal(sequences[0], sequences[1])
    assert np.abs(sequences[0] - sequences[2]).max() > 0.1
