"""The depth camera under Mitsuba: dots give texture to what is plain, glass and mirrors come out as they do."""

import gymnasium as gym
import numpy as np
import pytest

import fixation_gym  # noqa: F401
from fixation_gym.envs.depth_camera import BASELINE_M, PROJECTOR_M, imager, stereo_depth
from fixation_gym.envs.photoreal import build, engine
from fixation_gym.envs.photoreal.lighting import dot_pattern
from fixation_gym.envs.photoreal.materials import Material
from fixation_gym.envs.photoreal.meshes import box
from fixation_gym.geometry.camera import Intrinsics

pytest.importorskip("mitsuba")
pytest.importorskip("pyoidn")

CAMERA = Intrinsics.from_fovy(120, 160, 0.74)
WIDE = imager(CAMERA)
SIZE = (WIDE.height, WIDE.width)
AHEAD = np.diag([-1.0, 1.0, -1.0, 1.0])  # along -z of the world, x to the right


def seen_from(x):
    pose = AHEAD.copy()
    pose[0, 3] = x
    return pose


def depth_of(things, dots=True):
    """Depth that is measured of things in front of a camera at the origin: materials, centres and half sizes."""
    mitsuba = engine.load()
    shapes = {
        f"solid{index}": build.shape(
            mitsuba, box(np.array(half)).placed(np.eye(3), np.array(centre)), build.material(mitsuba, made, None)
        )
        for index, (made, centre, half) in enumerate(things)
    }
    projector = build.dots(mitsuba, seen_from(PROJECTOR_M), WIDE.fovy, SIZE) if dots else None
    pictures = []
    for x in (0.0, BASELINE_M):
        sensor = build.camera(mitsuba, seen_from(x), WIDE.fovy, SIZE, 16)
        scene = build.scene(mitsuba, sensor, shapes, np.array([0.2, 0.1, -1.0]), np.array([0.0, 0.0, -0.5]), projector)
        light = np.array(mitsuba.render(scene, seed=1)).mean(axis=-1)
        pictures.append(np.clip(100.0 * light, 0, 255).astype(np.uint8))
    return stereo_depth(*pictures, CAMERA)


GREY, GLASS, MIRROR = Material("matt", (0.5, 0.5, 0.5)), Material("glass"), Material("mirror")
WALL = (GREY, (0.0, 0.0, -0.51), (2.0, 2.0, 0.01))  # its face is at 0.5 m


def test_plain_wall_is_measured_by_its_dots_alone():
    lit, unlit = depth_of([WALL]), depth_of([WALL], dots=False)
    known = lit > 0
    assert known.mean() > 0.9
    # Dots are a pixel wide: matching prefers whole pixels of disparity.
    assert np.median(np.abs(lit[known] - 0.5)) < 0.5 * 0.5**2 / (CAMERA.fx * BASELINE_M)
    assert np.mean(np.abs(unlit - 0.5) < 0.01) < 0.2


def test_glass_pane_is_never_measured_as_what_it_is():
    pane = (GLASS, (0.0, 0.0, -0.3), (0.06, 0.05, 0.004))
    depth = depth_of([WALL, pane])
    middle = depth[50:70, 70:90]
    assert np.mean(np.abs(middle - 0.296) < 0.02) < 0.1


def test_mirror_shows_dots_behind_its_face_or_none():
    ceiling = (GREY, (0.0, 0.0, 0.3), (2.0, 2.0, 0.01))
    mirror = (MIRROR, (0.0, 0.0, -0.4), (0.1, 0.1, 0.005))
    middle = depth_of([WALL, ceiling, mirror])[50:70, 70:90]
    assert np.mean(np.abs(middle - 0.395) < 0.02) < 0.1


def test_pattern_is_always_the_same_and_has_some_thousand_dots():
    import cv2

    pattern = dot_pattern(240, 576)
    np.testing.assert_array_equal(pattern, dot_pattern(240, 576))
    dots = cv2.connectedComponents((pattern[..., 0] > 0).astype(np.uint8))[0]
    assert 2500 < dots < 4000


@pytest.mark.sim
def test_environment_measures_depth_by_the_renderer_of_its_picture():
    envs = [
        gym.make("FixationPick-v0", image_size=(96, 128), renderer=renderer, depth_camera=True, sensor_noise="ideal")
        for renderer in ("mujoco", "mitsuba")
    ]
    plain, photoreal = (env.reset(seed=3)[0]["depth"] for env in envs)
    np.testing.assert_array_equal(envs[1].reset(seed=3)[0]["depth"], photoreal)
    both = (plain > 0) & (photoreal > 0) & (plain < 1.0)
    assert both.mean() > 0.3
    assert np.median(np.abs(plain - photoreal)[both] / plain[both]) < 0.02
    for env in envs:
        env.close()
