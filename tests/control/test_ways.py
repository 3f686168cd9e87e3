import math
from dataclasses import replace

import numpy as np
import pytest

from fixation_gym.control.corridor import level_axes
from fixation_gym.control.reach import directions, sample_direction
from fixation_gym.control.ways import (
    SeenSpace,
    WayCosts,
    chosen_way,
    grasp_axes,
    known_ways,
    lateral_direction,
    way_costs,
)
from fixation_gym.geometry.rigid import look_at
from fixation_gym.robots import ROBOT

TARGET = np.array([0.55, 0.08, -0.08])
BEARING = math.atan2(TARGET[1], TARGET[0])
COSTS = WayCosts()
NONE = np.zeros((0, 3))


def way_at(azimuth_deg, elevation_deg):
    return directions(np.radians([[azimuth_deg, elevation_deg]]), TARGET)[0]


def everything_seen():
    space = SeenSpace.empty(BEARING)
    return space.with_seen(np.ones_like(space.seen))


def post_at(way, distance=0.15, count=8):
    """Points of an upright post under a way, each surely seen."""
    place = TARGET + distance * way
    heights = np.linspace(-0.10, place[2], count)
    return np.column_stack([np.repeat(place[None, :2], count, axis=0), heights]), np.full(count, 20.0)


def test_without_obstacles_and_with_all_seen_the_present_way_is_taken():
    ways = known_ways(NONE, np.zeros(0), TARGET, everything_seen(), 0.01)
    present = way_at(60, 55)
    best = chosen_way(way_costs(ways, present, NONE, 60.0, COSTS), None, COSTS)
    assert math.degrees(math.acos(ways.directions[best] @ present)) < 5.0


def test_a_post_in_the_way_turns_the_hand_to_one_side():
    present = way_at(60, 45)
    points, weights = post_at(present)
    ways = known_ways(points, weights, TARGET, everything_seen(), 0.01)
    assert ways.evidence[ways.nearest(present)] > 60.0
    best = chosen_way(way_costs(ways, present, NONE, 60.0, COSTS), None, COSTS)
    assert ways.evidence[best] < 30.0


def test_a_wide_box_is_approached_along_its_sides_or_from_above():
    ways = known_ways(NONE, np.zeros(0), TARGET, everything_seen(), 0.01)
    present = way_at(60, 48)
    azimuth = math.atan2(present[1], present[0]) - math.radians(45.0)  # askew
    normals = np.array([[math.cos(azimuth), math.sin(azimuth), 0.0], [-math.sin(azimuth), math.cos(azimuth), 0.0]])
    axes = grasp_axes(ways.directions, math.radians(50.0))
    assert np.allclose(np.linalg.norm(axes, axis=2), 1.0)
    assert np.abs(np.einsum("wrk,wk->wr", axes, ways.directions)).max() < 1e-9
    half_sizes = np.array([0.035, 0.035, 0.035])
    widths = (2.0 * np.abs(axes @ np.vstack([normals, [0.0, 0.0, 1.0]]).T) @ half_sizes).min(axis=1)
    best = chosen_way(way_costs(ways, present, NONE, 60.0, COSTS, widths), None, COSTS)
    assert widths[ways.nearest(present)] > ROBOT.hand.finger_span[1]
    assert widths[best] < ROBOT.hand.finger_span[1]
    narrow = chosen_way(way_costs(ways, present, NONE, 60.0, COSTS, 0.8 * widths), None, COSTS)
    assert narrow == chosen_way(way_costs(ways, present, NONE, 60.0, COSTS), None, COSTS)


def test_what_is_deeper_in_a_corridor_counts_more():
    way = way_at(60, 60)
    nearest = known_ways(NONE, np.zeros(0), TARGET, everything_seen(), 0.01)
    axes = level_axes(nearest.directions[[nearest.nearest(way)]])[0]
    # The hand is widest at 0.104 m to the side, 0.08 m behind the finger tips.
    beside = [np.array([x, ROBOT.tool_in_camera[1], -0.2]) @ axes + TARGET for x in (0.090, 0.100, 0.108, 0.120)]
    counted = [
        known_ways(point[None], np.array([30.0]), TARGET, everything_seen(), 0.01).evidence[nearest.nearest(way)]
        for point in beside
    ]
    np.testing.assert_allclose(counted, [30.0, 20.0, 10.0, 0.0])


def test_what_was_never_looked_at_costs_more_and_so_does_what_was_tried():
    present = way_at(60, 60)
    nothing, everything = (
        known_ways(NONE, np.zeros(0), TARGET, s, 0.01) for s in (SeenSpace.empty(0), everything_seen())
    )
    blind, sighted = (way_costs(ways, present, NONE, 60.0, COSTS) for ways in (nothing, everything))
    np.testing.assert_allclose(blind - sighted, COSTS.unseen)
    tried = way_costs(everything, present, present[None], 60.0, COSTS)
    near = everything.directions @ present > math.cos(math.radians(10.0))
    assert np.all(tried[near] - sighted[near] == pytest.approx(COSTS.tried))
    assert np.sum(tried != sighted) < 0.4 * len(tried)


def test_of_two_ways_equally_far_away_the_steeper_is_taken_but_a_low_one_if_only_that_is_free():
    ways, present = known_ways(NONE, np.zeros(0), TARGET, everything_seen(), 0.01), way_at(60, 50)
    cost = way_costs(ways, present, NONE, 60.0, COSTS)
    assert cost[ways.nearest(way_at(60, 40))] - cost[ways.nearest(way_at(60, 60))] > 0.3
    low = ways.nearest(way_at(60, 40))
    barred = replace(ways, evidence=np.where(np.arange(len(cost)) == low, 0.0, 600.0))
    assert chosen_way(way_costs(barred, present, NONE, 60.0, COSTS), None, COSTS) == low


def test_looking_goes_first_to_the_nearest_place_in_the_corridor_that_was_not_seen():
    ways, space = known_ways(NONE, np.zeros(0), TARGET, everything_seen(), 0.01), everything_seen()
    way = ways.nearest(way_at(60, 60))
    present = ways.directions[way]
    assert space.least_seen_share(way) == 1.0
    assert not space.towards_unseen(way, TARGET, present).any()
    sideways = np.cross(present, [0.0, 0.0, 1.0])
    sideways /= np.linalg.norm(sideways)
    local = space.places(TARGET) - TARGET
    far = np.linalg.norm(local, axis=1) > 0.3
    for side, width in ((1.0, 0.06), (-1.0, 0.06), (1.0, 0.5)):
        hidden = far & (side * (local @ sideways) > 0.05) & (side * (local @ sideways) < 0.05 + width)
        looked = SeenSpace(space.bearing, ~hidden)
        assert 0.5 < looked.least_seen_share(way) < 1.0
        assert side * (looked.towards_unseen(way, TARGET, present) @ sideways) > 0.04
        assert abs(looked.towards_unseen(way, TARGET, present) @ present) < 1e-9
    assert SeenSpace.empty(BEARING).least_seen_share(way) == 0.0


def test_a_way_is_kept_while_no_other_is_clearly_cheaper():
    cost = np.array([0.5, 0.45, 0.1])
    assert chosen_way(cost, 0, COSTS) == 2
    assert chosen_way(cost[:2], 0, COSTS) == 0


@pytest.mark.parametrize("way", [(20, 70), (100, 60), (60, 84), (60, 42)])
def test_the_lateral_direction_leads_to_the_way(way):
    camera = TARGET + 0.45 * way_at(60, 60)
    pose = look_at(camera, TARGET, np.array([0.0, 0.0, 1.0]))
    direction, angle = lateral_direction(pose, way_at(60, 60), way_at(*way))
    moved = camera + pose[:3, :2] @ direction * 0.05 - TARGET
    after = math.acos(moved @ way_at(*way) / np.linalg.norm(moved))
    assert after == pytest.approx(angle - 0.05 / 0.45, abs=0.01)


def test_directions_are_drawn_within_the_reach_and_from_all_of_it():
    rng = np.random.default_rng(0)
    for elevation in np.radians([40.0, 63.0, 85.0]):
        low, high = ROBOT.arm.reach.azimuths(elevation)
        drawn = np.array([sample_direction(rng, elevation, (1.0, 1.0)) for _ in range(200)])
        assert np.all(drawn[:, 1] == elevation)
        azimuths = (drawn[:, 0] - low) / (high - low)
        assert 0.0 <= azimuths.min() < 0.05
        assert 0.95 < azimuths.max() <= 1.0
        ends = np.array([sample_direction(rng, elevation, (0.3, 0.3))[0] for _ in range(200)])
        assert np.std(ends) > np.std(drawn[:, 0])
