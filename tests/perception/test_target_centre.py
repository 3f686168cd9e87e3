"""Which outlines of the target are kept, and what happens to them when it is pushed or covered."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_upright_body import CAMERA, TABLE, approach, mask_of, surface

from fixation_gym.geometry.rigid import inverse, transform
from fixation_gym.perception.body.target_centre import CentreSettings, TargetBody, with_outline
from fixation_gym.perception.detection.segmentation import Segmentation
from fixation_gym.perception.distance.pose_filter import Fixation

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


def test_a_pushed_body_is_found_at_its_new_place_soon_and_keeps_its_size():
    poses = approach(CENTRE)
    known = followed(TargetBody(), CENTRE, poses[:8])
    moved = CENTRE + np.array([0.05, 0.02, 0.0])
    known = followed(known, moved, poses[8 : 8 + SETTINGS.moved_frames - 1])
    for pose in poses[8 + SETTINGS.moved_frames - 1 :]:
        known = followed(known, moved, [pose])
        body = known.believed(pose, SETTINGS)
        assert body is not None
        assert np.linalg.norm(body.centre - moved) < 0.003
        np.testing.assert_allclose(body.half_sizes[2], HALF_SIZES[2], atol=0.003)


def test_a_single_bad_frame_costs_no_outline():
    poses = approach(CENTRE)
    known = followed(TargetBody(), CENTRE, poses[:8])
    seen, fixation = sight(CENTRE, poses[8])
    bad = np.zeros_like(seen.mask)
    bad[20:200, 20:300] = True
    for _ in range(SETTINGS.moved_frames - 1):
        after = with_outline(known, replace(seen, mask=bad), fixation, CAMERA, poses[8], TABLE, SETTINGS)
        assert after.outlines == known.outlines
        assert after.body is known.body
    assert followed(after, CENTRE, poses[8:]).contradictions == 0


def test_two_things_that_touched_and_parted_are_no_longer_one_body():
    poses = [pose for _ in range(3) for pose in approach(CENTRE)]
    known = TargetBody()
    small, other = (0.018, 0.018, 0.02), np.array([0.036, 0.011, 0.0])
    centre = np.array([0.5, -0.1, TABLE + small[2]])
    for index, pose in enumerate(poses):
        mask = mask_of(surface("box", small, 0.3, centre), pose)
        if index < 12:
            mask = mask | mask_of(surface("box", small, 0.3, centre + other), pose)
        seen, fixation = sight(centre, pose)
        known = with_outline(known, replace(seen, mask=mask), fixation, CAMERA, pose, TABLE, SETTINGS)
        if index == 11:
            assert known.body is not None
            assert known.body.half_sizes.max() > 0.03
    assert known.body is not None
    assert np.linalg.norm(known.body.centre - centre) < 0.002
    np.testing.assert_allclose(known.body.half_sizes, small, atol=0.003)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_body_that_is_covered_from_one_side_stays_where_it_is(side):
    poses = approach(CENTRE)
    known = followed(TargetBody(), CENTRE, poses[:8])
    edge = CENTRE + 0.06 * (poses[10][:3, 3] - CENTRE) / np.linalg.norm(
        poses[10][:3, 3] - CENTRE
    )  # of a board in front
    for pose in poses[8:]:
        seen, fixation = sight(CENTRE, pose)
        mask = seen.mask.copy()
        columns = np.arange(mask.shape[1])
        mask[:, side * (columns - CAMERA.project(transform(inverse(pose), edge))[0]) > 0.0] = False
        known = with_outline(known, replace(seen, mask=mask), fixation, CAMERA, pose, TABLE, SETTINGS)
        body = known.believed(pose, SETTINGS)
        assert body is not None
        assert np.linalg.norm(body.centre - CENTRE) < 0.002


def test_a_body_first_seen_in_part_is_found_when_all_of_it_appears():
    poses = [pose for _ in range(2) for pose in approach(CENTRE)]
    known = TargetBody()
    for index, pose in enumerate(poses):
        seen, fixation = sight(CENTRE, pose)
        mask = seen.mask.copy()
        if index < 8:
            mask[:, :150] = False
        known = with_outline(known, replace(seen, mask=mask), fixation, CAMERA, pose, TABLE, SETTINGS)
    assert known.body is not None
    assert np.linalg.norm(known.body.centre - CENTRE) < 0.002


def test_a_body_that_stays_out_of_sight_for_the_most_part_is_forgotten():
    poses = approach(CENTRE)
    known = followed(TargetBody(), CENTRE, poses)
    seen, fixation = sight(CENTRE, poses[-1])
    rows, columns = np.nonzero(seen.mask)
    small = np.zeros_like(seen.mask)
    small[rows[0] : rows[0] + 4, columns[0] : columns[0] + 4] = True
    bit = replace(seen, mask=small & seen.mask)
    for count in range(SETTINGS.doubts):
        assert known.body is not None, count
        known = with_outline(known, bit, fixation, CAMERA, poses[-1], TABLE, SETTINGS)
    assert known.body is None
    assert known.outlines == ()


def test_what_is_too_long_for_one_thing_is_no_body_until_it_parts():
    poses = [pose for _ in range(2) for pose in approach(CENTRE)]
    known = TargetBody()
    for index, pose in enumerate(poses):
        seen, fixation = sight(CENTRE, pose)
        if index < 10:
            other, _ = sight(CENTRE + np.array([-0.09, 0.09, 0.0]), pose)
            seen = replace(seen, mask=seen.mask | other.mask)
            assert known.body is None
        known = with_outline(known, seen, fixation, CAMERA, pose, TABLE, SETTINGS)
    assert known.body is not None
    assert np.linalg.norm(known.body.centre - CENTRE) < 0.002


def test_a_limit_that_would_bound_nothing_is_refused():
    with pytest.raises(ValueError, match="at least 6, got 5"):
        CentreSettings(max_outlines=5)


def test_without_sight_nothing_changes():
    poses = approach(CENTRE)
    known = followed(TargetBody(), CENTRE, poses)
    seen, fixation = sight(CENTRE, poses[-1])
    assert with_outline(known, replace(seen, visible=False), fixation, CAMERA, poses[-1], TABLE, SETTINGS) is known


def test_number_of_outlines_is_bounded_and_the_newest_is_kept():
    poses = [pose for _ in range(6) for pose in approach(CENTRE)]
    few = replace(SETTINGS, max_outlines=12)
    known = TargetBody()
    for pose in poses:
        known = with_outline(known, *sight(CENTRE, pose), CAMERA, pose, TABLE, few)
        assert len(known.outlines) <= 12
        np.testing.assert_array_equal(known.outlines[-1].origin, pose[:3, 3])


@pytest.mark.parametrize("distance", [0.1, 0.4])
def test_a_shape_that_is_not_quite_of_the_fitted_kind_contradicts_no_body_close_by(distance):
    poses = approach(CENTRE)
    known = followed(TargetBody(), CENTRE, poses)
    pose = poses[-1].copy()
    pose[:3, 3] = CENTRE - distance * pose[:3, 2]
    swollen = tuple(size + 0.001 for size in HALF_SIZES)
    mask = mask_of(surface("box", swollen, 0.3, CENTRE), pose)
    seen, fixation = sight(CENTRE, pose)
    after = with_outline(known, replace(seen, mask=mask), fixation, CAMERA, pose, TABLE, SETTINGS)
    assert after.contradictions == 0
