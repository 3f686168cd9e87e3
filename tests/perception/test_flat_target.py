"""The centre of a flat target against discs drawn by ray casting, with known truth."""

import cv2
import numpy as np
import pytest

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.distance.flat_target import coverage, flat_centroid

CAMERA = Intrinsics.from_fovy(120, 160, 0.74)
RED, CARD = np.array([200.0, 16.0, 14.0]), np.array([225.0, 225.0, 222.0])
SAMPLES = 16


def slanted_disc(centre, radius, normal):
    """Share of every pixel that a disc covers, shape (H, W): rays through SAMPLES^2 points of each pixel."""
    camera = CAMERA.scaled(CAMERA.height * SAMPLES, CAMERA.width * SAMPLES)
    x, y = camera.grid
    depth = (normal @ centre) / (normal[0] * x + normal[1] * y + normal[2])
    inside = (x * depth - centre[0]) ** 2 + (y * depth - centre[1]) ** 2 + (depth - centre[2]) ** 2 < radius**2
    return cv2.resize(inside.astype(np.float32), (CAMERA.width, CAMERA.height), interpolation=cv2.INTER_AREA)


@pytest.mark.parametrize("tilt", [-0.35, 0.0, 0.2])
def test_the_centre_of_a_slanted_disc_is_found_to_a_hundredth_of_a_pixel(tilt):
    centre = np.array([0.03, -0.02, 0.5])
    normal = np.array([np.sin(tilt), 0.1, np.cos(tilt)]) / np.linalg.norm([np.sin(tilt), 0.1, np.cos(tilt)])
    share = slanted_disc(centre, 0.1, normal)
    x, y = CAMERA.grid
    plain = np.array([np.average(x, weights=share), np.average(y, weights=share)])
    expected = centre[:2] / centre[2]
    assert CAMERA.fx * np.linalg.norm(plain - expected) > 0.3  # what the slant does to the plain centroid
    found = flat_centroid(share, CAMERA, normal)
    np.testing.assert_allclose(CAMERA.fx * (found - expected), 0.0, atol=0.01)
    np.testing.assert_allclose(flat_centroid(share, CAMERA, -normal), found)


def test_mixed_colours_at_the_outline_tell_the_share_of_a_pixel():
    share = slanted_disc(np.array([0.01, 0.0, 0.5]), 0.06, np.array([0.0, 0.0, 1.0]))
    image = share[..., None] * RED + (1.0 - share[..., None]) * CARD
    noisy = image + np.random.default_rng(0).normal(0.0, 2.0, image.shape)
    found = coverage(np.rint(np.clip(noisy, 0, 255)).astype(np.uint8), share > 0.4)
    assert np.abs(found - share).max() < 0.05
    assert np.all(found[share == 1.0] > 0.95)
    assert not found[:20].any()
    # A mask of whole pixels is off by several times as much as the shares are.
    error = {
        name: abs(weights.mean() / share.mean() - 1.0) for name, weights in (("mask", share > 0.4), ("own", found))
    }
    assert error["own"] < 0.3 * error["mask"]


def test_a_target_without_an_inside_keeps_its_mask():
    mask = np.zeros((20, 20), np.bool_)
    mask[9:11, 5:15] = True
    np.testing.assert_array_equal(coverage(np.zeros((20, 20, 3), np.uint8), mask), mask)
