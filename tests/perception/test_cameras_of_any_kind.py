"""Cameras with a lens, grey ones, and ones that give nothing but a pose, against a pinhole of the same view."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from pinhole_scene import Scene, fixating_pose, noise_texture, observe, upright

from fixation_gym.geometry.camera import Intrinsics, Lens
from fixation_gym.perception.detection.detector import GivenMasks
from fixation_gym.perception.distance.estimator import TwistEstimator
from fixation_gym.perception.pipeline import Perception
from fixation_gym.perception.rectification import Rectification
from fixation_gym.types import Observation

PINHOLE = Intrinsics(160, 120, 150.0, 152.0, 81.0, 58.0)
LENSES = [Lens((-0.3, 0.1, 0.001, -0.002, 0.02)), Lens((0.25, 0.05, 0.0, 0.0)), Lens((0.1, 0.03, 0.0, 0.0), "fisheye")]
TARGET = np.array([0.6, 0.0, 0.2])
SCENE = Scene(
    [
        upright([1.0, 0.0, 0.2], 1.0, 0.8, noise_texture(1)),
        upright(TARGET, 0.05, 0.05, noise_texture(2, (1.0, 0.1, 0.1), 0.2)),
        upright([0.35, 0.08, 0.2], 0.02, 0.05, noise_texture(3)),
    ]
)


def bent_pixels(lens, camera):
    """Where the pixels of a bent picture lie in that of the pinhole, by the textbook formulas, solved by Newton's way.

    Returns columns and rows, each of shape (H, W), float32.
    """
    x, y = camera.grid
    u, v = x.copy(), y.copy()
    for _ in range(200):  # a fixed point: the undistorted ray whose distortion is the pixel
        p, q = distorted(lens, u, v)
        u, v = u + 0.5 * (x - p), v + 0.5 * (y - q)
    p, q = distorted(lens, u, v)
    assert np.hypot(p - x, q - y).max() < 1e-9
    return (camera.fx * u + camera.cx).astype(np.float32), (camera.fy * v + camera.cy).astype(np.float32)


def distorted(lens, x, y):
    k = lens.coefficients
    r2 = x * x + y * y
    if lens.model == "fisheye":
        theta = np.arctan(np.sqrt(r2))
        bent = theta * (1 + sum(c * theta ** (2 * n + 2) for n, c in enumerate(k)))
        factor = bent / np.maximum(np.sqrt(r2), 1e-12)
        return x * factor, y * factor
    k1, k2, p1, p2, k3 = (*k, 0.0)[:5]
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    return (
        x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
        y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
    )


def views(count=14):
    """Observations by the pinhole, noise-free, while the camera moves sideways around the target."""
    for step in range(count):
        pose = fixating_pose([0.0, 0.012 * step - 0.08, 0.22], TARGET)
        observation, _, index = observe(SCENE, pose, 0.04 * step, PINHOLE, noise=0.0)
        yield replace(observation, mask=index == 1), pose


def bend(image, lens):
    columns, rows = bent_pixels(lens, PINHOLE)
    return cv2.remap(image, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


@pytest.mark.parametrize("lens", LENSES, ids=lambda lens: f"{lens.model}{lens.coefficients[0]}")
def test_an_undistorted_picture_is_that_of_the_pinhole(lens):
    straight = SCENE.render(fixating_pose([0.0, 0.0, 0.22], TARGET), PINHOLE)[0]
    rectification = Rectification(replace(PINHOLE, lens=lens))
    found = rectification.image(bend(straight, lens))
    seen = ~rectification.unseen(None)
    inner = np.zeros_like(seen)
    inner[4:-4, 4:-4] = seen[4:-4, 4:-4]
    assert inner.mean() > 0.4
    pictures = found, bend(straight, lens), straight
    found, bent, truth = (cv2.GaussianBlur(picture, (0, 0), 1.5).astype(float)[inner] for picture in pictures)
    assert np.abs(found - truth).mean() < 1.0  # two interpolations blur
    assert np.abs(bent - truth).mean() > 3.0


@pytest.mark.parametrize("lens", LENSES, ids=lambda lens: f"{lens.model}{lens.coefficients[0]}")
def test_a_box_is_found_again_around_the_same_thing(lens):
    mask = np.zeros((120, 160), np.uint8)
    mask[20:50, 25:70] = 1
    left, top, width, height = cv2.boundingRect((bend(255 * mask, lens) > 127).astype(np.uint8))
    box = Rectification(replace(PINHOLE, lens=lens)).box(np.array([left, top, width, height], float))
    # A box around a bent box is a little larger.
    assert box[:2] == pytest.approx([25, 20], abs=3.5)
    assert box[:2] + box[2:] == pytest.approx([70, 50], abs=3.5)


@pytest.mark.parametrize("lens", LENSES, ids=lambda lens: f"{lens.model}{lens.coefficients[0]}")
def test_distance_and_map_through_a_lens_are_those_of_the_pinhole(lens):
    """The same views bent by the lens: perception that knows it says the same; one that does not is off."""
    straight, knowing, ignorant = (
        Perception(camera, detector=GivenMasks()) for camera in (PINHOLE, replace(PINHOLE, lens=lens), PINHOLE)
    )
    for observation, _pose in views():
        mask = bend(255 * observation.mask.astype(np.uint8), lens) > 127
        bent = replace(observation, rgb=bend(observation.rgb, lens), mask=mask)
        percepts = [straight.update(observation), knowing.update(bent), ignorant.update(bent)]
    truth = percepts[0].fixation.distance_m
    assert truth == pytest.approx(0.6, rel=0.03)
    assert percepts[1].fixation.distance_m == pytest.approx(truth, rel=0.01)
    both = percepts[0].zfc.supported & percepts[1].zfc.supported
    assert np.count_nonzero(both) > 500
    same = (percepts[0].zfc.p_nearer > 0.5) == (percepts[1].zfc.p_nearer > 0.5)
    assert same[both].mean() > 0.97
    assert (percepts[1].zfc.p_nearer > 0.9).sum() > 20


def test_nothing_is_said_where_the_lens_saw_nothing():
    lens = Lens((0.25, 0.05, 0.0, 0.0))  # pincushion: the corners of the pinhole's picture lie outside
    camera = replace(PINHOLE, lens=lens)
    perception = Perception(camera, detector=GivenMasks())
    for observation, _pose in views(6):
        bent = replace(observation, rgb=bend(observation.rgb, lens))
        percept = perception.update(bent)
    unseen = cv2.resize(Rectification(camera).unseen(None).view(np.uint8), (80, 60)) > 0
    assert 0.02 < unseen.mean() < 0.6
    assert percept.zfc.supported.any()
    assert not percept.zfc.supported[unseen].any()


def test_a_grey_picture_counts_as_one_with_three_equal_channels():
    colour, grey = (Perception(PINHOLE, detector=GivenMasks()) for _ in range(2))
    for observation, _pose in views(5):
        picture = cv2.cvtColor(observation.rgb, cv2.COLOR_RGB2GRAY)
        a = colour.update(replace(observation, rgb=cv2.cvtColor(picture, cv2.COLOR_GRAY2RGB)))
        b = grey.update(replace(observation, rgb=picture))
    assert b.fixation.distance_m == a.fixation.distance_m
    np.testing.assert_array_equal(b.zfc.cells, a.zfc.cells)


def test_pictures_and_poses_are_enough():
    full, camera_only = (Perception(PINHOLE, detector=GivenMasks()) for _ in range(2))
    for seen, _pose in views(8):
        a = full.update(seen)
        b = camera_only.update(Observation.of_camera(seen.time, seen.rgb, seen.camera_pose, mask=seen.mask))
    assert b.fixation.distance_m == a.fixation.distance_m
    np.testing.assert_array_equal(b.zfc.p_nearer, a.zfc.p_nearer)


def test_without_a_measured_twist_the_poses_give_it():
    perception = Perception(PINHOLE, detector=GivenMasks(), estimator=TwistEstimator())
    for seen, _pose in views(14):
        percept = perception.update(Observation.of_camera(seen.time, seen.rgb, seen.camera_pose, mask=seen.mask))
    assert percept.fixation.distance_m == pytest.approx(0.6, rel=0.15)


@pytest.mark.parametrize(
    ("coefficients", "model", "message"),
    [
        ((0.1,) * 3, "brown_conrady", "4 or 5 or 8 or 12 or 14 finite coefficients"),
        ((0.1,) * 5, "fisheye", "a fisheye lens has 4 finite"),
        ((0.1, np.nan, 0.0, 0.0), "fisheye", "finite"),
        ((0.1,) * 4, "double_sphere", "choose one of brown_conrady, fisheye"),
    ],
)
def test_a_lens_that_cannot_be_is_refused(coefficients, model, message):
    with pytest.raises(ValueError, match=message):
        Lens(coefficients, model)
