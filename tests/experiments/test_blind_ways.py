"""Blind ways: the family, that scenes bar them, and that the arm can go them."""

from __future__ import annotations

import math
import zlib
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from fixation_gym.control.corridor import free_directions
from fixation_gym.control.reach import REACH_GRID, reachable_directions
from fixation_gym.envs.config import SCENARIOS
from fixation_gym.envs.sampling import sample_scene
from fixation_gym.experiments.necessity.config import scenarios_with_obstacles
from fixation_gym.experiments.necessity.run import run_cell
from fixation_gym.experiments.necessity.ways import ELEVATIONS, QUICK_WAYS, STRAIGHT, WAYS, azimuth_cells
from fixation_gym.geometry.boxes import joined
from fixation_gym.robots import ROBOT
from fixation_policies import catalogue
from fixation_policies.blind_ways import BlindWay

REACH = ROBOT.arm.reach
SCENES = 12
"""Scenes per scenario of the geometric test."""
MOST_OPEN, MOST_OPEN_IN_ALL = 0.75, 0.40
"""Largest share of scenes in which one direction is open: of the scenes of one scenario, and of all."""


# -- the family --------------------------------------------------------------------------------------------------------


def test_the_family_has_many_different_ways_of_every_style_and_speed():
    assert len(WAYS) >= 60
    assert len(set(WAYS.values())) == len(WAYS)
    assert {(way.style, way.origin) for way in WAYS.values()} >= {
        ("straight", "base"),
        ("straight", "view"),
        ("straight", "target"),
        ("curved", "base"),
        ("stepped", "view"),
    }
    assert {way.speed for way in WAYS.values()} == {0.04, 0.10}
    assert set(QUICK_WAYS) < set(WAYS)


@pytest.mark.parametrize("first_view", np.radians([-80.0, 30.0, 75.0, 178.0]))
def test_all_ways_are_within_reach(first_view):
    bearing = math.radians(-10.0)
    for way in WAYS.values():
        low, high = REACH.azimuths(math.radians(way.elevation_deg))
        azimuths = way.azimuths(bearing, first_view) - bearing
        assert np.all((low - 1e-9 <= azimuths) & (azimuths <= high + 1e-9)), way.name
        for depth, seconds in ((math.inf, 0.0), (0.3, 1.0), (0.18, 5.0)):
            assert REACH.lowest - 1e-9 <= way.elevation(depth, seconds) <= REACH.highest + 1e-9, way.name


def test_straight_ways_are_nowhere_far_apart():
    for elevation in ELEVATIONS:
        low, high = (math.degrees(angle) for angle in REACH.azimuths(math.radians(elevation)))
        cells = azimuth_cells(elevation)
        assert cells[0][0] == pytest.approx(low)
        assert cells[-1][1] == pytest.approx(high)
        for (_, end), (begin, _) in pairwise(cells):
            assert end == begin
        assert max((end - begin) * math.cos(math.radians(elevation)) for begin, end in cells) < 18.0
    assert len(STRAIGHT) == sum(len(azimuth_cells(elevation)) for elevation in ELEVATIONS)


def test_styles_differ_in_how_they_come_in():
    curved, stepped = BlindWay(50, 40, style="curved"), BlindWay(50, 40, style="stepped")
    assert math.degrees(curved.elevation(math.inf, 0.0)) == pytest.approx(70.0)
    assert math.degrees(curved.elevation(0.20, 3.0)) == pytest.approx(50.0)
    assert 52.0 < math.degrees(curved.elevation(0.35, 1.0)) < 68.0
    speeds = [stepped.speed_at(seconds) for seconds in np.arange(0.0, 5.0, 0.04)]
    assert sum(a > b for a, b in pairwise(speeds)) == 2
    assert speeds[0] == speeds[-1] == 0.10
    assert math.degrees(stepped.elevation(0.3, 1.0)) == pytest.approx(58.0)
    assert math.degrees(stepped.elevation(0.3, 2.0)) == pytest.approx(50.0)


def test_a_way_from_the_first_view_ends_where_the_reach_does():
    way = BlindWay(42, 50, origin="view")
    high = REACH.azimuths(math.radians(42.0))[1]
    assert way.azimuths(0.1, 0.1 + math.radians(20.0))[0] == pytest.approx(0.1 + math.radians(70.0))
    assert way.azimuths(0.1, 0.1 + math.radians(60.0))[0] == pytest.approx(0.1 + high)


# -- scenes ------------------------------------------------------------------------------------------------------------


@cache
def open_shares(name: str) -> np.ndarray:
    """Share of scenes in which nothing that stands bars a direction of the reach's grid, shape (n,)."""
    found = np.zeros(len(REACH_GRID))
    for seed in range(SCENES):
        scene = sample_scene(SCENARIOS[name], np.random.default_rng([seed, zlib.crc32(name.encode())]))
        target = scene.target.places[-1]
        boxes = joined([obstacle.boxes for obstacle in scene.obstacles if obstacle.motion is None])
        found += free_directions(target, boxes, reachable_directions(target), 0.0)
    return found / SCENES


@pytest.mark.parametrize("name", scenarios_with_obstacles())
def test_no_direction_is_open_in_most_scenes(name):
    assert open_shares(name).max() <= MOST_OPEN


def test_no_direction_is_open_in_many_scenes_of_all_scenarios():
    assert np.mean([open_shares(name) for name in scenarios_with_obstacles()], axis=0).max() <= MOST_OPEN_IN_ALL


# -- simulation --------------------------------------------------------------------------------------------------------


def outcome(scenario: str, member: str, seed: int) -> dict[str, Any]:
    return run_cell({"scenario": scenario, "member": member, "seed": seed})


@pytest.mark.sim
def test_blind_ways_pick_without_obstacles_and_mostly_collide_with_them():
    steep = "straight el70 base+40 0.10m/s"
    clear = outcome("clear", steep, 500_000)
    assert clear["success"]
    env = pytest.importorskip("gymnasium").make("fixation_gym:FixationPick-v0", scenario="clear", image_size=None)
    obs, _ = env.reset(seed=500_000)
    policy = catalogue.make_policy("oracle", env)
    done, steps = False, 0
    while not done:
        obs, _, terminated, truncated, info = env.step(policy.act(obs))
        done, steps = terminated or truncated, steps + 1
    env.close()
    same = outcome("clear", "oracle", 500_000)
    assert (same["success"], same["time_s"]) == (info["is_success"], pytest.approx(steps / 25.0))
    members = (steep, "straight el48 view+0 0.10m/s", "straight el62 base+60 0.10m/s")
    ends = [outcome("opaque", member, seed) for seed in range(500_000, 500_004) for member in members]
    assert sum(end["success"] for end in ends) <= 6
    assert sum(end["collision"] for end in ends) >= 6
