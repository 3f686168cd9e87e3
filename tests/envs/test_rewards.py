"""Terms of the reward, their weights, and how both environments take them. No simulation is built."""

import itertools
import math
from dataclasses import fields

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec

from fixation_gym.envs.rewards import RewardWeights, TaskState, choose_terms, dense_terms, potential

FAR = TaskState(tool_distance=0.5, rise=0.0, success=False, collision=False)
AT_IT = TaskState(tool_distance=0.0, rise=0.0, success=False, collision=False)
LIFTED = TaskState(tool_distance=0.0, rise=0.1, success=True, collision=True)
FALLEN = TaskState(tool_distance=3.0, rise=-0.8, success=False, collision=False)
STATES = (FAR, AT_IT, LIFTED, FALLEN)
WEIGHTS = RewardWeights(
    success_bonus=3.0, collision_cost=7.0, time_cost=0.5, distance_weight=4.0, farthest_distance=2.0
)
ENVIRONMENTS = ("FixationPick-v0", "FixationPickZFC-v0")


@pytest.mark.parametrize("weights", [None, {}, RewardWeights()])
def test_the_default_rewards_are_the_documented_ones(weights):
    terms = choose_terms("dense", weights)
    assert terms(FAR, AT_IT) == {"progress": 1.0, "time": -0.004, "success": 0.0, "collision": 0.0}
    assert terms(AT_IT, LIFTED) == {"progress": 1.0, "time": -0.004, "success": 10.0, "collision": -5.0}
    assert terms(LIFTED, LIFTED) == {"progress": 0.0, "time": -0.004, "success": 0.0, "collision": 0.0}
    assert terms(AT_IT, FALLEN)["progress"] == -2.0


def test_every_term_scales_with_its_weight():
    assert dense_terms(AT_IT, LIFTED, WEIGHTS) == {"progress": 1.0, "time": -0.5, "success": 3.0, "collision": -7.0}
    assert dense_terms(FAR, AT_IT, WEIGHTS)["progress"] == 2.0
    assert dense_terms(AT_IT, FALLEN, WEIGHTS)["progress"] == -8.0


@pytest.mark.parametrize("weights", [RewardWeights(), WEIGHTS])
def test_progress_depends_on_where_a_way_begins_and_ends_alone(weights):
    for way in itertools.permutations(STATES):
        steps = sum(dense_terms(a, b, weights)["progress"] for a, b in itertools.pairwise(way))
        assert steps == pytest.approx(potential(way[-1], weights) - potential(way[0], weights))


@pytest.mark.parametrize("name", [field.name for field in fields(RewardWeights)])
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf, "2", None])
def test_a_bad_weight_is_refused_by_its_name_with_what_is_allowed(name, value):
    with pytest.raises(ValueError, match=f"^reward weight {name} must be a finite number, 0 or more, got {value!r}$"):
        gym.make("FixationPick-v0", reward_weights={name: value})


@pytest.mark.parametrize("env_id", ENVIRONMENTS)
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"reward_weights": {"speed": 1.0}}, r"unknown reward_weights \['speed'\]; choose from \['success_bonus', "),
        ({"reward_weights": 2.0}, "must be a mapping from .*'collision_cost'.* to numbers, got 2.0"),
        ({"reward": "sparse", "reward_weights": {"time_cost": 0.0}}, 'only; "sparse" gives 1 and -1'),
    ],
)
def test_weights_that_mean_nothing_are_refused_by_both_environments(env_id, arguments, message):
    with pytest.raises(ValueError, match=message):
        gym.make(env_id, **arguments)


@pytest.mark.parametrize("env_id", ENVIRONMENTS)
@pytest.mark.parametrize("weights", [{"collision_cost": np.float32(2.0)}, RewardWeights(collision_cost=2.0)])
def test_both_environments_take_weights(env_id, weights):
    env = gym.make(env_id, reward_weights=weights)
    terms = env.unwrapped._reward_terms(AT_IT, LIFTED)
    assert terms == {"progress": 1.0, "time": -0.004, "success": 10.0, "collision": -2.0}


def test_a_mapping_of_weights_survives_json():
    env = gym.make("FixationPickZFC-v0", reward_weights={"time_cost": 0.5})
    again = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped._reward_terms(AT_IT, AT_IT)["time"] == -0.5
