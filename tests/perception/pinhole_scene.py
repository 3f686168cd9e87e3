"""A tiny renderer of textured rectangles with exact depth: the truth for perception tests."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import inverse, look_at, matrix_to_pose, transform
from fixation_gym.types import Observation

UP = np.array([0.0, 0.0, 1.0])


@cache
def noise_texture(seed: int, colour=(0.7, 0.7, 0.7), contrast: float = 0.5, size: int = 256) -> np.ndarray:
    """Broad-band texture, shape (size, size, 3), 0..255 float32; shared and read-only."""
    rng = np.random.default_rng(seed)
    image = np.zeros((size, size), np.float32)
    for octave in (2, 4, 8, 16):
        coarse = rng.standard_normal((size // octave, size // octave)).astype(np.float32)
        image += cv2.resize(coarse, (size, size), interpolation=cv2.INTER_CUBIC)
    image = np.clip(1 + contrast * image / image.std() / 2, 0.1, 1.4)
    texture = np.clip(image[..., None] * np.array(colour, np.float32) * 180, 0, 255)
    texture.flags.writeable = False
    return texture


def plain_texture(colour) -> np.ndarray:
    return np.ones((8, 8, 3), np.float32) * np.array(colour, np.float32) * 255


@dataclass
class Rectangle:
    """Rectangle spanned by two base-frame half axes; the texture repeats every ``period`` m."""

    centre: np.ndarray
    half_u: np.ndarray
    half_v: np.ndarray
    texture: np.ndarray
    period: float = 0.25
    round: bool = False


@dataclass
class Scene:
    rectangles: list[Rectangle] = field(default_factory=list)

    def render(self, T_base_cam, intrinsics: Intrinsics, noise: float = 0.0, seed: int = 0, oversample: int = 2):
        """Image (H, W, 3) uint8, true depth (H, W) m and index of the visible rectangle (H, W)."""
        fine = intrinsics.scaled(intrinsics.height * oversample, intrinsics.width * oversample)
        x, y = (axis.astype(np.float32) for axis in fine.grid)
        image = np.full((*x.shape, 3), 90.0, np.float32)
        depth = np.full(x.shape, np.inf, np.float32)
        index = np.full(x.shape, -1)
        R, origin = T_base_cam[:3, :3], T_base_cam[:3, 3]
        for number, rectangle in enumerate(self.rectangles):
            box = _bounding_box(rectangle, T_base_cam, fine)
            columns, rows = x[:1, box[1]], y[box[0], :1]

            def along(direction, columns=columns, rows=rows):
                """Component of every ray of the box along a base-frame direction."""
                a, b, c = (direction @ R).astype(np.float32)
                return a * columns + (b * rows + c)

            offset = rectangle.centre - origin
            lengths = np.linalg.norm(rectangle.half_u), np.linalg.norm(rectangle.half_v)
            normal = np.cross(rectangle.half_u, rectangle.half_v)
            with np.errstate(divide="ignore", invalid="ignore"):
                z = np.float32(offset @ normal) / along(normal)
            unit_u, unit_v = rectangle.half_u / lengths[0], rectangle.half_v / lengths[1]
            u = z * along(unit_u) - np.float32(offset @ unit_u)  # m
            v = z * along(unit_v) - np.float32(offset @ unit_v)
            relative = (u / lengths[0]) ** 2, (v / lengths[1]) ** 2
            inside = relative[0] + relative[1] < 1 if rectangle.round else np.maximum(*relative) < 1
            hit = inside & (z > 1e-3) & (z < depth[box])
            scale = np.float32(rectangle.texture.shape[0] / rectangle.period)
            colour = cv2.remap(rectangle.texture, u * scale, v * scale, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
            cv2.copyTo(colour, hit.astype(np.uint8), image[box])
            np.copyto(depth[box], z, where=hit)
            index[box][hit] = number
        image = cv2.resize(image, (intrinsics.width, intrinsics.height), interpolation=cv2.INTER_AREA)
        image = image + noise * np.random.default_rng(seed).standard_normal(image.shape)
        middle = oversample // 2
        return (
            np.clip(np.rint(image), 0, 255).astype(np.uint8),
            depth[middle::oversample, middle::oversample],
            index[middle::oversample, middle::oversample],
        )


def _bounding_box(rectangle: Rectangle, T_base_cam, camera: Intrinsics):
    """Slices of the image part that can show a rectangle; all of it if a corner is not in front of the camera."""
    signs = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    corners = rectangle.centre + signs @ np.stack([rectangle.half_u, rectangle.half_v])
    pixels = camera.project(transform(inverse(T_base_cam), corners))
    if np.isnan(pixels).any():
        return slice(None), slice(None)
    low = np.maximum(np.floor(pixels.min(axis=0)), 0).astype(int)
    high = np.maximum(np.ceil(pixels.max(axis=0)) + 1, 0).astype(int)
    return slice(low[1], high[1]), slice(low[0], high[0])


def observe(scene: Scene, T_base_cam, time: float, intrinsics: Intrinsics, noise: float = 2.0, pose=None):
    """Observation of a scene and the true depth."""
    rgb, depth, index = scene.render(T_base_cam, intrinsics, noise, seed=round(time * 1000))
    zeros = np.zeros(7)
    reported = T_base_cam if pose is None else pose
    return Observation(time, rgb, zeros, zeros, matrix_to_pose(reported), np.zeros(6), 0.08), depth, index


def upright(centre, half_width: float, half_height: float, texture, **options) -> Rectangle:
    """Rectangle facing the base's x axis, like a poster seen by a camera looking along +x."""
    half_u, half_v = np.array([0.0, -half_width, 0.0]), np.array([0.0, 0.0, -half_height])
    return Rectangle(np.asarray(centre, float), half_u, half_v, texture, **options)


def fixating_pose(position, target) -> np.ndarray:
    return look_at(np.asarray(position, float), np.asarray(target, float), UP)
