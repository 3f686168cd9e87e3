"""Every table of docs/environment.md says what the code does."""

import inspect
import re
from dataclasses import asdict, fields
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import fixation_gym
from fixation_gym.envs import config
from fixation_gym.envs.info import reward_terms, with_prefix
from fixation_gym.envs.pick_env import FixationPickEnv
from fixation_gym.envs.rewards import RewardWeights
from fixation_gym.envs.sensor_noise import SENSOR_NOISE, SensorNoise
from fixation_gym.envs.zfc_env import FixationPickZFC
from fixation_gym.envs.zfc_observation import OBSERVATIONS
from fixation_gym.robots import ROBOT

PAGE = (Path(__file__).parents[2] / "docs" / "environment.md").read_text()
IDS = ("FixationPick-v0", "FixationPickZFC-v0")


def section(*titles):
    """Text below a heading, and within that below another."""
    text = PAGE
    for level, title in enumerate(titles, 2):
        text = re.search(rf"^{'#' * level} {re.escape(title)}$(.*?)(?=^{'#' * level} |\Z)", text, re.M | re.S)[1]
    return text


def rows(text):
    """Cells of the rows of all tables in a text, without headings."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    rules = [i for i, row in enumerate(cells) if set("".join(row)) == {"-"}]
    return [row for i, row in enumerate(cells) if i not in rules and i + 1 not in rules]


def numbers(cell):
    return {float(number) for number in re.findall(r"-?\d+(?:\.\d+)?(?:e-?\d+)?", cell)}


def name_in(cell):
    return re.match(r"`(\w+)`", cell)[1]


def same(cell, value):
    """Whether a cell of a table of fields tells a default."""
    if isinstance(value, bool):
        return cell == str(value).lower()
    if isinstance(value, str):
        return cell == value
    if isinstance(value, tuple) and (not value or isinstance(value[0], str)):
        return cell == ("all" if value else "none")
    return np.allclose([float(part) for part in cell.split(",")], value)


@pytest.mark.parametrize("env_id", IDS)
def test_the_action_tables(env_id):
    env = gym.make(env_id).unwrapped
    table = rows(section(env_id, "Action space"))
    assert [int(row[0]) for row in table] == list(range(env.action_space.shape[0]))
    assert all((float(row[2]), float(row[3])) == (-1.0, 1.0) for row in table)
    assert f"`{env.action_space}`" in section(env_id)
    limits = [float(row[4]) for row in table if row[4]]
    assert limits == list(ROBOT.arm.twist_limits[: len(limits)])


def test_the_observation_tables():
    shown = [gym.make(IDS[1], observation=name).observation_space for name in OBSERVATIONS]
    of_learner = {key: box for space in shown for key, box in space.items()}
    of_robot = dict(gym.make(IDS[0], depth_camera=True).observation_space.items())
    for env_id, known in zip(IDS, (of_robot, of_learner), strict=True):
        table = [row for row in rows(section(env_id, "Observation space")) if len(row) == 6]
        assert {name_in(row[0]) for row in table} == set(known)
        for key, shape, dtype, low, high, _ in table:
            box = known[name_in(key)]
            assert (shape, dtype) == (str(box.shape), str(box.dtype)), key
            assert numbers(low) == {round(float(value), 6) for value in np.unique(box.low)}, key
            assert numbers(high) == {round(float(value), 6) for value in np.unique(box.high)}, key


def test_the_proprioception_table_counts_all_its_numbers():
    table = [row for row in rows(section(IDS[1], "Observation space")) if len(row) == 3]
    spans = [[int(end) for end in row[0].split("-")] for row in table]
    counted = [index for span in spans for index in range(span[0], span[-1] + 1)]
    assert counted == list(range(gym.make(IDS[1]).observation_space["proprio"].shape[0]))


def test_the_tables_of_arguments():
    pick = [(name_in(row[0]), row[1].strip("`")) for row in rows(section(IDS[0], "Arguments"))]
    own = [(name_in(row[0]), row[1].strip("`")) for row in rows(section(IDS[1], "Arguments"))]
    for table, cls in ((pick, FixationPickEnv), (pick[:1] + own + pick[1:-1], FixationPickZFC)):
        parameters = list(inspect.signature(cls).parameters.values())
        assert table == [(parameter.name, repr(parameter.default)) for parameter in parameters]


def test_frequency_and_length_of_an_episode():
    for env_id in IDS:
        assert dict(rows(section(env_id))[:4])["control steps per second"] == str(fixation_gym.CONTROL_FREQUENCY)
        assert dict(rows(section(env_id))[:4])["steps until an episode is truncated"] == str(
            gym.spec(env_id).max_episode_steps
        )


def test_the_reward_table():
    weights = asdict(RewardWeights())
    text = section(IDS[0], "Rewards")
    for _, value, default in rows(text):
        (weight,) = (name for name in weights if f"`{name}`" in value)
        assert numbers(default) == {weights.pop(weight)}
    assert list(weights) == ["farthest_distance"]
    assert f"`farthest_distance`, {weights['farthest_distance']} m" in text


def test_the_numbers_of_success_and_collision():
    text = " ".join(section(IDS[0], "Episode end").split())
    assert f"{config.LIFT_HEIGHT} m above its resting height for {config.HOLD_SECONDS} s" in text
    assert f"more than {config.COLLISION_FORCE:g} N" in text
    assert f"the table with more than {config.TABLE_FORCE:g} N" in text
    assert f"by more than {100 * config.COLLISION_PUSH:g} cm" in text


def test_the_table_of_scenario_fields():
    default = config.Scenario()
    table = {name_in(row[0]): row[1] for row in rows(section("Fields of a scenario"))}
    assert set(table) == {field.name for field in fields(default)} - {"name"}
    for name, cell in table.items():
        assert same(cell, getattr(default, name)), name


def test_the_table_of_noise():
    table = {name_in(row[0]): row[1:-1] for row in rows(section("Sensor noise"))}
    assert list(table) == [field.name for field in fields(SensorNoise)]
    lens = table.pop("lens")
    assert [cell != "none" for cell in lens] == [bool(preset.lens) for preset in SENSOR_NOISE.values()]
    assert all(f"{value:g}" in section("Sensor noise") for value in SENSOR_NOISE["realistic"].lens)
    for name, values in table.items():
        kept = [getattr(preset, name) for preset in SENSOR_NOISE.values()]
        assert [float(value) for value in values] == pytest.approx(kept, rel=1e-3), name


@pytest.mark.sim
def test_the_tables_of_info_and_reward_terms():
    env = gym.make(IDS[0], image_size=None)
    _, info = env.reset(seed=0)
    env.close()
    told = [key for row in rows(section(IDS[0], "Info")) for key in re.findall(r"`(\w+)`", row[0])]
    assert told == list(info)
    assert [name_in(row[0]) for row in rows(section(IDS[0], "Rewards"))] == list(with_prefix(reward_terms(info)))
