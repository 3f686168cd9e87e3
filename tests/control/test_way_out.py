"""Ways around obstacles whose places are known."""

import numpy as np
import pytest

from fixation_gym.control.corridor import approach_directions, in_corridor, level_axes
from fixation_gym.control.gaze import GazeGains, within_reach
from fixation_gym.control.way_out import way_out
from fixation_gym.geometry.rigid import look_at

TARGET = np.array([0.55, 0.0, -0.08])
GAINS = GazeGains()
UP = np.array([0.0, 0.0, 1.0])
STEP = np.radians(1.0)


def direction(azimuth_deg, elevation_deg):
    return approach_directions(np.radians([azimuth_deg]), np.radians([elevation_deg]))[0]


def post(azimuth_deg, height, distance):
    """Points on a post that stands beside the target."""
    foot = TARGET + distance * direction(azimuth_deg, 0.0)
    z = np.arange(-0.11, height - 0.11, 0.01)
    ring = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    around = 0.03 * np.stack([np.cos(ring), np.sin(ring)], -1)
    points = np.array([[*(foot[:2] + offset), height] for height in z for offset in around])
    return points, np.full(len(points), 10.0)


def evidence(points, weights, towards):
    seen = (points - TARGET) @ level_axes(towards[None])[0].T
    return weights @ (in_corridor(seen, 0.0) & (seen[:, 2] < 0.0))


def follow(points, weights, start, steps=90):
    """Directions from target to camera on the way that the law takes, and where it ends."""
    towards = start
    for _ in range(steps):
        if not evidence(points, weights, towards):
            break
        pose = look_at(TARGET + 0.4 * towards, TARGET, UP)
        x, y = way_out(points, weights, TARGET, pose, 60.0, 0.005, GAINS)
        towards = towards + STEP * (x * pose[:3, 0] + y * pose[:3, 1])
        towards /= np.linalg.norm(towards)
    return towards


@pytest.mark.parametrize("azimuth", [10.0, 40.0, 70.0])
@pytest.mark.parametrize(("height", "distance"), [(0.12, 0.13), (0.20, 0.22)])
def test_the_way_leads_to_a_free_direction_within_reach(azimuth, height, distance):
    points, weights = post(azimuth, height, distance)
    start = direction(azimuth, 45.0)
    assert evidence(points, weights, start) > 60.0
    end = follow(points, weights, start)
    assert evidence(points, weights, end) == 0.0
    turned = np.arctan2(-end[1], -end[0])
    assert GAINS.azimuth_range[0] - 2.0 * STEP < turned < GAINS.azimuth_range[1] + 2.0 * STEP


@pytest.mark.parametrize("elevation", [45.0, 60.0, 75.0])
def test_at_the_border_of_the_reach_the_way_does_not_lead_out_of_it(elevation):
    points, weights = post(70.0, 0.20, 0.20)
    pose = look_at(TARGET + 0.4 * direction(81.0, elevation), TARGET, UP)
    way = way_out(points, weights, TARGET, pose, 60.0, 0.005, GAINS)
    assert 0.0 < np.linalg.norm(way) <= 1.0 + 1e-9
    assert within_reach(way, pose, TARGET, GAINS) == pytest.approx(way, abs=0.05)
