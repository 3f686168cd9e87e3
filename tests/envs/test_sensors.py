"""Image noise against its model."""

import numpy as np

from fixation_gym.envs.sensor_noise import SENSOR_NOISE
from fixation_gym.envs.sensors import measure_image


def test_image_noise_has_mean_and_variance_of_read_and_shot_noise():
    noise, exposure = SENSOR_NOISE["conservative"], 1.1
    for level in (30, 120, 200):
        image = np.full((200, 250, 3), level, np.uint8)
        noisy = measure_image(image, noise, exposure, np.random.default_rng(level)).astype(float)
        variance = noise.read_noise**2 + noise.shot_noise * exposure * level + 1 / 12  # rounding
        count = noisy.size
        assert abs(noisy.mean() - exposure * level) < 4 * np.sqrt(variance / count)
        assert abs(noisy.var() / variance - 1) < 4 * np.sqrt(2 / count)
        skewness = ((noisy - noisy.mean()) ** 3).mean() / noisy.std() ** 3
        assert abs(skewness) < 4 * np.sqrt(6 / count)


def test_image_noise_is_white_and_comes_from_the_generator():
    image = np.full((120, 160, 3), 100, np.uint8)
    first, again, other = (
        measure_image(image, SENSOR_NOISE["nominal"], 1.0, np.random.default_rng(seed)) for seed in (0, 0, 1)
    )
    np.testing.assert_array_equal(first, again)
    a = first.astype(float) - first.mean()
    neighbours = [a[1:] * a[:-1], a[:, 1:] * a[:, :-1], a[..., 1:] * a[..., :-1], a * (other - other.mean())]
    for product in neighbours:
        assert abs(product.mean()) < 4 * a.var() / np.sqrt(product.size)


def test_values_at_the_ends_of_the_range_are_clipped():
    image = np.zeros((8, 9, 3), np.uint8)
    image[4:] = 255
    noisy = measure_image(image, SENSOR_NOISE["conservative"], 1.2, np.random.default_rng(0))
    assert noisy[:4].max() < 12
    assert noisy[4:].min() > 200


def test_without_noise_the_image_is_unchanged():
    image = np.random.default_rng(0).integers(0, 256, (8, 9, 3), dtype=np.uint8)
    np.testing.assert_array_equal(measure_image(image, SENSOR_NOISE["ideal"], 1.0, np.random.default_rng(0)), image)
