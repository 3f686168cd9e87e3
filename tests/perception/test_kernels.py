from dataclasses import fields
from functools import cache

import cv2
import numpy as np
import plain_twins as twins
import pytest
from pinhole_scene import Rectangle, Scene, fixating_pose, noise_texture, observe, upright
from scipy.special import ndtr

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception import Colour, Perception
from fixation_gym.perception.detection import colour as segmentation
from fixation_gym.perception.flow import gradients, kernels
from fixation_gym.perception.zero_flow import pixel_kernels, zero_flow
from fixation_gym.perception.zero_flow.evidence_map import evidence_map
from fixation_gym.perception.zero_flow.zero_flow import ZeroFlowSettings

FOVY = np.deg2rad(42.5)


@cache
def observations(height, width, steps=9):
    """Views of a table with a red patch, a fast near post and a wall, from a circling camera."""
    forward, across = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    scene = Scene(
        [
            upright([1.5, 0, 0.3], 2, 2, noise_texture(9)),
            Rectangle(np.array([0.5, 0, 0]), 0.6 * forward, 2 * across, noise_texture(1, (0.75, 0.6, 0.45)), 0.4),
            Rectangle(np.array([0.5, 0, 0.001]), 0.03 * forward, 0.03 * across, noise_texture(2, (0.85, 0.08, 0.08))),
            upright([0.3, 0.05, 0.13], 0.02, 0.06, noise_texture(3, (0.4, 0.6, 0.4))),
        ]
    )
    camera = Intrinsics.from_fovy(height, width, FOVY)
    angles = 0.12 * np.arange(steps)
    places = [[0.1, 0.05 * np.cos(angle), 0.3 + 0.05 * np.sin(angle)] for angle in angles]
    poses = [fixating_pose(place, [0.5, 0, 0]) for place in places]
    return [observe(scene, pose, 0.04 * k, camera)[0] for k, pose in enumerate(poses)]


def percepts(height, width, **options):
    perception = Perception(Intrinsics.from_fovy(height, width, FOVY), **options)
    return [perception.update(observation) for observation in observations(height, width)]


# Odd in both, in one, on the grid, farther up the pyramid; two grids have fewer pixels than cells.
@pytest.mark.parametrize(
    ("height", "width"),
    [(128, 128), (240, 320), (97, 131), (60, 82), (96, 131), (97, 128), (163, 242), (166, 246), (33, 47)],
)
@pytest.mark.parametrize("support", [None, 0.0])
def test_compiled_and_plain_code_say_the_same(height, width, support, monkeypatch):
    compiled = percepts(height, width, support_height_m=support)[-1]
    twins.put_in_place(monkeypatch)
    plain = percepts(height, width, support_height_m=support)[-1]
    np.testing.assert_array_equal(compiled.segmentation.mask, plain.segmentation.mask)
    np.testing.assert_allclose(compiled.flow.residual, plain.flow.residual, atol=2e-5)
    np.testing.assert_allclose(compiled.flow.residual_cov, plain.flow.residual_cov, rtol=1e-4, atol=1e-6)
    assert (compiled.zfc.supported != plain.zfc.supported).mean() < 1e-4
    both = compiled.zfc.supported & plain.zfc.supported
    assert both.mean() > 0.1  # borders take much of a small image
    for name in ("p_nearer", "inverse_depth", "inverse_depth_std"):
        np.testing.assert_allclose(getattr(compiled.zfc, name)[both], getattr(plain.zfc, name)[both], atol=2e-4)
    cells = np.abs(compiled.zfc.cells.astype(int) - plain.zfc.cells)
    assert np.median(cells) == 0
    assert (cells > 1).mean() < 0.002


@pytest.mark.parametrize("size", [(96, 128), (97, 131), (96, 131), (97, 128), (3, 3), (2, 9)])
def test_pixels_are_pooled_by_area_for_every_size(size):
    smooth, change = np.random.default_rng(2).normal(0, 30, (2, *size)).astype(np.float32)
    compiled, plain = np.empty((2, 10, size[0] // 2, size[1] // 2), np.float32)
    for way, pooled in ((kernels, compiled), (twins, plain)):
        noise = np.float32(0.0125), np.float32(3.0), np.float32(0.7)
        way.pooled_products(smooth, change, gradients.SPACE_PREFILTER, gradients.SPACE_DERIVATIVE, noise, pooled)
    np.testing.assert_allclose(compiled, plain, rtol=1e-3, atol=1e-5 * np.abs(plain).max())


@pytest.mark.parametrize("size", [(40, 64), (41, 65), (40, 65), (41, 64), (121, 163)])
def test_a_coarse_level_is_enlarged_for_every_size(size):
    rng = np.random.default_rng(3)
    coarse = rng.normal(0, 30, (6, size[0] // 2, size[1] // 2)).astype(np.float32)
    motion, fine = rng.normal(0, 1, coarse[:2].shape).astype(np.float32), np.zeros((6, *size), np.float32)
    compiled, plain = fine.copy(), fine.copy()
    for way, sums in ((kernels, compiled), (twins, plain)):
        way.take_coarse_where_fast(coarse, motion, np.float32(1.4), gradients._TO_FINER_PX, sums)
    assert 0.3 < (plain[0] != 0).mean() < 0.7
    np.testing.assert_array_equal(compiled != 0, plain != 0)
    np.testing.assert_allclose(compiled, plain, atol=1e-3)


@pytest.mark.parametrize("colour", [segmentation.RED, Colour(120, 20, 0.3, 0.2), Colour(345, 30, 0.5, 0.0)])
def test_the_compiled_colour_test_is_that_of_opencv_to_the_bit(colour):
    green, blue = np.meshgrid(np.arange(256), np.arange(256))
    for red in (0, 1, 39, 40, 41, 127, 200, 255):
        image = np.stack([np.full_like(green, red), green, blue], axis=-1).astype(np.uint8)
        for window, step in (((slice(0, 256), slice(0, 256)), 1), ((slice(2, 242), slice(4, 253)), 3)):
            compiled = segmentation._in_colour_range(image, window, colour, step)
            np.testing.assert_array_equal(compiled, twins.in_colour_range(image, window, colour, step))


@pytest.mark.parametrize(
    "shape", [(64, 64), (120, 160), (97, 131), (32, 33), (20, 24), (31, 40), (15, 45), (100, 7), (1, 1)]
)
def test_cells_are_area_means_for_every_grid(shape):
    rng = np.random.default_rng(0)
    supported = cv2.resize(rng.random((9, 9)), shape[::-1]) > 0.4
    p_nearer = np.where(supported, rng.random(shape), 0.5).astype(np.float32)
    moving = rng.random(shape) > 0.99
    compiled = evidence_map(p_nearer, supported, moving, ZeroFlowSettings())
    plain = twins.evidence_map(p_nearer, supported, moving, ZeroFlowSettings())
    assert (compiled != plain).mean() < 0.005  # ties in rounding


def test_the_normal_distribution_is_that_of_scipy():
    z = np.concatenate([np.linspace(-40, 40, 4001), [0.0, -0.0, 1e9, -1e9]]).astype(np.float32)
    compiled = [pixel_kernels._normal_distribution(value) for value in z]
    np.testing.assert_allclose(compiled, ndtr(z.astype(np.float64)), atol=2e-6)


def test_what_was_handed_out_is_never_overwritten():
    perception = Perception(Intrinsics.from_fovy(128, 128, FOVY))
    *before, last = observations(128, 128, 7)
    for observation in before:
        percept = perception.update(observation)
    parts = (percept.flow, percept.zfc, percept.segmentation)
    arrays = [getattr(part, entry.name) for part in parts for entry in fields(part)]
    arrays = [array for array in arrays if isinstance(array, np.ndarray)]
    copies = [array.copy() for array in arrays]
    perception.update(last)
    for array, copy in zip(arrays, copies, strict=True):
        np.testing.assert_array_equal(array, copy)


@pytest.mark.parametrize("seed", range(4))
def test_searching_a_window_finds_what_searching_the_whole_image_finds(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    image = np.full((240, 320, 3), (150, 110, 70), np.uint8)
    for _ in range(3):
        centre, radius = tuple(int(c) for c in rng.integers((0, 0), (320, 240))), int(rng.integers(3, 25))
        cv2.circle(image, centre, radius, (190, 25, 20), int(rng.choice([-1, 3])))
    camera = Intrinsics.from_fovy(240, 320, FOVY)
    found = segmentation.segment(image, camera)
    monkeypatch.setattr(segmentation, "_search_window", lambda rgb, _: tuple(slice(0, n) for n in rgb.shape[:2]))
    everywhere = segmentation.segment(image, camera)
    np.testing.assert_array_equal(found.mask, everywhere.mask)
    np.testing.assert_allclose(found.centroid, everywhere.centroid, atol=1e-12)
    np.testing.assert_allclose(found.second_moments, everywhere.second_moments, atol=1e-12)
    assert found.touches_border == everywhere.touches_border


@pytest.mark.parametrize("shape", [(120, 160), (64, 64), (48, 65)])
def test_a_mask_on_the_grid_covers_every_pixel_of_it(shape):
    mask = np.zeros((240, 320), bool)
    mask[31:77, 203] = mask[200, 17:23] = True
    area = cv2.resize(mask.view(np.uint8) * np.uint8(255), shape[::-1], interpolation=cv2.INTER_AREA)
    np.testing.assert_array_equal(zero_flow.widened_on_grid(mask, shape, 0), area > 0)
