"""Decisions: how long an action is held, what a grasp is to the learner."""

import numpy as np
import pytest
from rl_fakes import TERMS, FakeZFC

from fixation_gym.envs.info import reward_terms
from fixation_policies.rl.agent import Decider
from fixation_policies.rl.config import CONFIGS
from fixation_policies.rl.decisions import PERIODS, DecisionEnv, FixedEpisodes, env_action
from fixation_policies.rl.inputs import input_space

GO, GRASP = np.array([0.3, 0, 0, 0], np.float32), np.array([0, 0, 0, 1], np.float32)


@pytest.fixture
def inner():
    return FakeZFC()


@pytest.fixture
def env(inner):
    env = DecisionEnv(inner)
    env.reset(seed=0)
    return env


def test_an_action_is_held_and_rewards_are_summed(env, inner):
    inputs, reward, terminated, truncated, info = env.step(GO)
    assert len(inner.actions) == PERIODS == info["periods"]
    assert all(action[0] == np.float32(0.3) for action in inner.actions)
    assert reward == PERIODS
    assert reward_terms(info) == {term: value * PERIODS for term, value in TERMS.items()}
    assert sum(reward_terms(info).values()) == reward
    assert not terminated
    assert not truncated
    assert input_space(CONFIGS["zfc"]).contains(inputs)


def test_a_whole_grasp_is_one_step_and_ends_when_the_next_action_counts(env, inner):
    _, reward, *_, info = env.step(GRASP)
    assert info["periods"] == reward == 13  # the trigger, and 12 steps until it is over
    env.step(GO)
    assert inner.actions[13][0] == np.float32(0.3)


def test_the_camera_rests_in_a_grasp_until_the_recovery(env, inner):
    env.step(GRASP)
    env.step(GO)
    # In the step after "recover" was seen it looks again, long before the next decision.
    assert inner.cameras == [True] + 9 * [False] + 3 * [True] + PERIODS * [True]


def test_an_episode_ends_amid_a_decision_and_amid_a_grasp():
    for length, action, periods in ((3, GO, 3), (6, GRASP, 6)):
        env = DecisionEnv(FakeZFC(length))
        env.reset(seed=0)
        *_, truncated, info = env.step(action)
        assert truncated
        assert info["periods"] == periods


def test_few_random_actions_trigger():
    random = np.random.default_rng(0).uniform(-1, 1, (2000, 4)).astype(np.float32)
    assert np.mean([env_action(action)[3] > 0 for action in random]) == pytest.approx(0.1, abs=0.02)
    np.testing.assert_array_equal(env_action(random[0])[:3], random[0, :3])
    np.testing.assert_array_equal(env_action(random[0, :2]), random[0, :2])  # a residual has no trigger


def test_evaluations_meet_the_same_seeds_and_training_does_not(inner):
    env = FixedEpisodes(inner, [7, 8])
    env.reset(seed=1)
    for _ in range(2):
        env.rewind()
        for _ in range(3):
            env.reset()
    env.release(99)
    env.reset()
    assert inner.seeds == [1, 7, 8, 7, 7, 8, 7, 99, None]


class MadeUpNetwork:
    """Acts on all that it sees, and triggers every seventh time."""

    def __init__(self):
        self.calls = 0

    def __call__(self, inputs):
        self.calls += 1
        trigger = 1.0 if self.calls % 7 == 0 else -1.0
        level = inputs["view"].mean(axis=(1, 2)) / 255.0
        return np.array([*level, inputs["vector"].mean() / 10.0, trigger], np.float32)


def test_an_agent_acts_at_the_control_rate_as_the_learner_did_by_decisions():
    trained, used = FakeZFC(), FakeZFC()
    env, network = DecisionEnv(trained), MadeUpNetwork()
    inputs, _ = env.reset(seed=0)
    for _ in range(20):
        inputs, *_ = env.step(network(inputs))

    decider = Decider(MadeUpNetwork(), 4, CONFIGS["zfc"])
    obs, _ = used.reset(seed=0)
    held = env_action(decider.act(obs))
    while len(used.actions) < len(trained.actions):
        obs, *_ = used.step(held)
        held = env_action(decider.act(obs))
    counts = [action[3] > 0 for action in trained.actions]
    assert any(counts)
    # While a manoeuvre goes on the agent holds its action, which nobody looks at.
    np.testing.assert_array_equal(used.actions, trained.actions)
