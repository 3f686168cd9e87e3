import cv2
import numpy as np
import pytest

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.detection.colour import segment
from fixation_gym.perception.detection.tracking import Expectation

CAMERA = Intrinsics.from_fovy(240, 320, np.deg2rad(42.5))
RED = (190, 25, 20)
WOOD = (150, 110, 70)


def noisy(image, seed=0, std=4.0):
    values = image + np.random.default_rng(seed).normal(0, std, image.shape)
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def wooden():
    return np.full((240, 320, 3), WOOD, np.uint8)


def test_the_centroid_and_moments_of_a_noisy_disc_are_those_of_the_disc():
    image = wooden()
    cv2.circle(image, (200, 90), 25, RED, -1)
    seen = segment(noisy(image), CAMERA)
    assert seen.visible
    assert not seen.touches_border
    np.testing.assert_allclose(seen.centroid, CAMERA.normalise(np.array([200, 90])), atol=0.3 / CAMERA.fx)
    np.testing.assert_allclose(seen.second_moments, np.eye(2) * (25 / CAMERA.fx) ** 2 / 4, rtol=0.06, atol=2e-5)
    assert seen.area_fraction == pytest.approx(np.pi * 25**2 / (240 * 320), rel=0.05)


@pytest.mark.parametrize("brightness", [0.35, 1.0, 1.3])
def test_the_target_is_found_in_dim_and_bright_light(brightness):
    image = wooden()
    cv2.circle(image, (100, 150), 20, RED, -1)
    seen = segment(noisy(np.clip(image * brightness, 0, 255)), CAMERA)
    np.testing.assert_allclose(seen.centroid, CAMERA.normalise(np.array([100, 150])), atol=0.4 / CAMERA.fx)


def test_parts_of_a_target_behind_a_bar_are_one_target():
    image = wooden()
    cv2.circle(image, (160, 120), 30, RED, -1)
    image[:, 156:165] = (60, 60, 60)
    seen = segment(noisy(image), CAMERA)
    np.testing.assert_allclose(seen.centroid, CAMERA.normalise(np.array([160, 120])), atol=0.7 / CAMERA.fx)
    assert seen.mask[120, 140]
    assert seen.mask[120, 180]
    assert not seen.mask[120, 160]


def test_a_target_behind_half_transparent_grey_is_still_seen():
    image = wooden()
    cv2.circle(image, (160, 120), 30, RED, -1)
    image[60:180, 100:220] = (0.6 * image[60:180, 100:220] + 0.4 * 120).astype(np.uint8)
    seen = segment(noisy(image), CAMERA)
    np.testing.assert_allclose(seen.centroid, CAMERA.normalise(np.array([160, 120])), atol=0.5 / CAMERA.fx)


def test_the_centroid_of_a_hollow_target_is_its_empty_centre():
    image = wooden()
    cv2.circle(image, (120, 100), 30, RED, 9)
    seen = segment(noisy(image), CAMERA)
    assert not seen.mask[100, 120]
    np.testing.assert_allclose(seen.centroid, CAMERA.normalise(np.array([120, 100])), atol=0.4 / CAMERA.fx)


def test_a_second_red_object_is_not_mixed_in_and_the_expected_place_decides():
    image = wooden()
    cv2.circle(image, (80, 120), 20, RED, -1)
    cv2.circle(image, (240, 120), 24, RED, -1)
    largest = segment(noisy(image), CAMERA)
    expected = segment(noisy(image), CAMERA, expected=Expectation(CAMERA.normalise(np.array([85.0, 122.0])), np.inf))
    np.testing.assert_allclose(largest.centroid, CAMERA.normalise(np.array([240, 120])), atol=0.4 / CAMERA.fx)
    np.testing.assert_allclose(expected.centroid, CAMERA.normalise(np.array([80, 120])), atol=0.4 / CAMERA.fx)


def test_a_target_at_the_border_says_so():
    image = wooden()
    cv2.circle(image, (5, 100), 20, RED, -1)
    assert segment(image, CAMERA).touches_border


@pytest.mark.parametrize("noise", [0.0, 6.0])
def test_without_a_target_nothing_is_seen_and_the_centroid_is_nan(noise):
    seen = segment(noisy(wooden(), std=noise), CAMERA)
    assert not seen.visible
    assert not seen.mask.any()
    assert seen.area_fraction == 0
    assert np.isnan(seen.centroid).all()
    assert np.isnan(seen.second_moments).all()


@pytest.mark.parametrize("size", [(480, 848), (768, 1024), (375, 500), (1208, 1928), (240, 320), (241, 321)])
@pytest.mark.parametrize("corner", ["top left", "right", "bottom"])
def test_any_image_size_can_show_the_target_at_any_edge_beside_something_else(size, corner):
    height, width = size
    camera = Intrinsics.from_fovy(height, width, 0.7)
    image = np.full((height, width, 3), WOOD, np.uint8)
    radius = width // 16
    place = {"top left": (2, 3), "right": (width - 1, height // 2), "bottom": (width // 2, height - 1)}[corner]
    other = (width // 4, height // 2 + 10)
    for centre in (place, other):
        cv2.circle(image, centre, radius, RED, -1)
    seen = segment(image, camera, expected=Expectation(camera.normalise(np.array(place)), 0.15))
    assert seen.touches_border
    assert seen.mask[min(place[1], height - 2), min(place[0], width - 2)]
    assert not seen.mask[other[1], other[0]]
