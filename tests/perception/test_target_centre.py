"""Which outlines of the target are kept, and what happens to them when it is pushed or covered."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_upright_body import CAMERA, TABLE, approach, mask_of, surface

from fixation_gym.perception.distance_filters import Fixation
from fixation_gym.perception.segmentation import Segmentation
from fixation_gym.perception.target_centre import CentreSettings, TargetBody, with_outline

SETTINGS = CentreSettings()
HALF_SIZES = (0.025, 0.025, 0.035)
CENTRE = np.array([0.5, -0.1, TABLE + HALF_SIZES[2]])


def sight(centre, pose):
    """Segmentation and fixation of a box there; the fixated point lies on its top."""
    mask = mask_of(surface("box", HALF_SIZES, 0.3, centre), pose)
    seen = Segmentation(mask, True, np.zeros(2), np.eye(2) * 1e-3, float(mask.mean()), False)
    point = centre + np.array([0.0, 0.0, 0.02])
    depth = float(pose[:3, 2] @ (point - pose[:3, 3]))
    return seen, Fixation(True, np.zeros(2), point, depth, 0.005, 0.0, True)


def followed(known, centre, poses):
    for pose in poses:
        known = with_outline(known, *sight(centre, pose), CAMERA, pose, TABLE, SETTINGS)
    return known


def test_centre_is_sure_after_an_approach_and_not_after_one_look():
    poses = approach(CENTRE)
    known = followed(TargetBody(), CENTRE, poses[:1])
    assert known.believed(poses[0], SETTINGS) is None
    body = followed(known, CENTRE, poses[1:]).believed(poses[-1], SETTINGS)
    assert body is not None
    depth, std = body.depth(poses[-1])
    assert depth == pytest.approx(float(poses[-1][:3, 2] @ (CENTRE - poses[-1][:3, 3])), abs=0.001)
    assert 0.0 < std < 0.002


def test_outlines_are_kept_from_new_places_only():
    pose = approach(CENTRE)[0]
    known = followed(TargetBody(), CENTRE, [pose, pose])
    assert len(known.outlines) == 1


def test_outlines_cut_by_the_border_or_at_unknown_distance_are_not_kept():
    pose = approach(CENTRE)[0]
    seen, fixation = sight(CENTRE, pose)
    cut, unsure = replace(seen, touches_border=True), replace(fixation, distance_std_m=0.2)
    for a, b in ((cut, fixation), (seen, unsure)):
        assert with_outline(TargetBody(), a, b, CAMERA, pose, TABLE, SETTINGS).outlines == ()


def test_pushed_body_is_found_at_its_new_place():
    poses = approach(CENTRE)
    known = followed(TargetBody(), CENTRE, poses[:6])
    moved = CENTRE + np.array([0.05, 0.02, 0.0])
    known = followed(known, moved, poses[6:])
    assert len(known.outlines) == len(poses) - 6
    assert known.body is not None
    assert np.linalg.norm(known.body.centre - moved) < 0.002


def test_number_of_outlines_is_bounded_and_the_newest_is_kept():
    poses = [pose for _ in range(6) for pose in approach(CENTRE)]
    few = replace(SETTINGS, max_outlines=12)
    known = TargetBody()
    for pose in poses:
        known = with_outline(known, *sight(CENTRE, pose), CAMERA, pose, TABLE, few)
        assert len(known.outlines) <= 12
        np.testing.assert_array_equal(known.outlines[-1].origin, pose[:3, 3])
