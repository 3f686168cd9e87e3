"""From the light that fell in to the picture that the robot gets: gains, image noise, hue, compression."""

from __future__ import annotations

import math

import cv2
import numpy as np

from fixation_gym.envs.sensor_noise import SensorNoise
from fixation_gym.envs.sensors import measure_image
from fixation_gym.envs.shutter import exposed_rows
from fixation_gym.types import FloatArray, ImageArray


def developed(
    image: ImageArray,
    noise: SensorNoise,
    exposure: float,
    drift: FloatArray,
    middle_s: float,
    rng: np.random.Generator,
) -> ImageArray:
    """Picture of a camera, shape (H, W, 3), uint8.

    Args:
        image: the light, shape (H, W, 3).
        noise: of the camera.
        exposure: factor on every grey level that is constant in an episode.
        drift: logarithms of the changed gains of all channels, of red, of blue; shape (3,).
        middle_s: middle of the exposure of the middle row, s, for the light's flicker.
        rng: of the noise.
    """
    lamp = np.array([noise.light_red, 1.0, noise.light_blue])
    if noise.light != 1.0 or noise.flicker or drift.any() or (lamp != 1.0).any():
        gains = lamp * np.exp(drift[0] + _by_channel(drift))
        factor = _light(noise, middle_s, image.shape[0])[:, None, None] * gains
        image = np.clip(np.rint(image * factor.astype(np.float32)), 0, 255).astype(np.uint8)
    image = measure_image(image, noise, exposure, rng)
    if noise.hue_shift_deg:
        image = _turned(image, noise.hue_shift_deg)
    return _compressed(image, noise.jpeg_quality) if noise.jpeg_quality else image


def _by_channel(drift: FloatArray) -> FloatArray:
    return np.array([drift[1], 0.0, drift[2]])


def _light(noise: SensorNoise, middle_s: float, rows: int) -> FloatArray:
    """Factor of the light on every row, shape (rows,): its flicker, averaged over the exposure."""
    times = exposed_rows(middle_s, noise.readout_s, rows)
    seen = noise.flicker * float(np.sinc(noise.flicker_hz * noise.exposure_s))
    return noise.light * (1.0 + seen * np.sin(2.0 * math.pi * noise.flicker_hz * times))


def _turned(image: ImageArray, degrees: float) -> ImageArray:
    """Picture with every hue turned; saturation and brightness stay."""
    hsv = cv2.cvtColor(image.astype(np.float32) / np.float32(255.0), cv2.COLOR_RGB2HSV)
    hsv[..., 0] = (hsv[..., 0] + np.float32(degrees)) % np.float32(360.0)
    return np.rint(255.0 * cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB)).astype(np.uint8)


def _compressed(image: ImageArray, quality: int) -> ImageArray:
    """What JPEG leaves of a picture, with its usual halved resolution of colour."""
    ok, data = cv2.imencode(".jpg", image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert ok, "pictures of the camera can be encoded"
    decoded = cv2.imdecode(data, cv2.IMREAD_COLOR)
    assert decoded is not None, "and decoded again"
    return np.ascontiguousarray(decoded[..., ::-1], np.uint8)
