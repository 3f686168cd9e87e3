"""What `make soak` counts, and its table. Nothing is run but one short episode."""

import gymnasium as gym
import numpy as np
import pytest
import soak


def piece(environment, index, faults=(), rss_mb=(400.0, 400.0, 400.0)):
    cell = {"environment": environment, "scenario": "clear", "index": index, "resets": 3}
    return {**cell, "steps": 30, "faults": list(faults), "rss_mb": list(rss_mb)}


def test_rows_and_table_add_up_steps_episodes_and_faults():
    pieces = [piece("FixationPick-v0", 0), piece("FixationPick-v0", 1, ["seed 3: reward is nan"])]
    row = soak.row_of("FixationPick-v0", "clear", pieces)
    assert (row["steps"], row["episodes"], row["faults"], row["first_fault"]) == (60, 6, 1, "seed 3: reward is nan")
    table = soak.EXPERIMENT.table({"rows": [row, row]})
    assert table.splitlines()[-1] == "120 steps, 12 episodes, 2 faults"
    assert len(table.splitlines()) == 6


def test_memory_that_grows_by_a_megabyte_per_episode_grows_by_a_thousand_per_thousand():
    assert soak.slope([piece("FixationPick-v0", 0, rss_mb=(400.0, 440.0, 440.0, 441.0))]) == pytest.approx(1000.0)
    assert soak.slope([piece("FixationPick-v0", 0, rss_mb=(400.0,))]) is None


def test_lengths_of_episodes_sum_to_the_steps_asked_for():
    lengths = soak.episode_lengths(7, 20, np.random.default_rng(0))
    assert sum(lengths) == 140
    assert min(lengths) >= 1


@pytest.mark.sim
def test_an_episode_of_random_actions_has_no_fault():
    env = gym.make("fixation_gym:FixationPick-v0", scenario="clear", image_size=(32, 32))
    steps, faults = soak.run_episode(env, 0, 5, np.random.default_rng(0))
    env.close()
    assert (steps, faults) == (5, set())
