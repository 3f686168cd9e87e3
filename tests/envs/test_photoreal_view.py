"""The wrist camera's picture by Mitsuba against MuJoCo's: the same geometry; equal seeds give equal pictures."""

import cv2
import gymnasium as gym
import numpy as np
import pytest

import fixation_gym  # noqa: F401
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.robots import ROBOT

pytestmark = pytest.mark.sim
mitsuba = pytest.importorskip("mitsuba")
pytest.importorskip("pyoidn")
FINE = 4
"""Pixels along a side in which a pixel of a 64x80 image is looked at."""
SIZE = (64, 80)


@pytest.fixture(scope="module")
def env():
    """Wood, wire, a pushed target and a moving obstacle, some steps into an episode."""
    scenario = {"base": "mixed", "obstacle_materials": ["opaque", "wire"], "moving_count": [1, 1], "target_moves": 1.0}
    env = gym.make("FixationPick-v0", scenario=scenario, image_size=None, sensor_noise="ideal")
    env.reset(seed=5)
    for _ in range(60):
        env.step(np.array([0.2, 0.0, 0.3, 0.0, 0.1, 0.0, 0.0]))
    yield env
    env.close()


def photoreal_view(env, size, samples=1):
    from fixation_gym.envs.photoreal.view import PhotorealView

    return PhotorealView(env.unwrapped.model, Intrinsics.from_fovy(*size, ROBOT.camera.fovy), samples)


def bodies_seen(view, qpos):
    """Index of the body that every pixel of a photoreal view shows; one ray each."""
    view.render(qpos, 0)
    integrator = mitsuba.load_dict({"type": "aov", "aovs": "shape:shape_index"})
    found = np.array(mitsuba.render(view.scene, integrator=integrator, spp=1))[..., 0].round().astype(int)
    names = [shape.id() for shape in view.scene.shapes()]
    bodies = {f"solid{index}": body for index, body in enumerate(view.bodies)}
    return np.array([-1, *(bodies.get(name, -1) for name in names)])[found]  # Mitsuba counts from 1; 0 is nothing


def test_outlines_of_opaque_things_agree_with_mujoco_within_half_a_pixel(env):
    from fixation_gym.envs.truth_view import TruthView

    height, width = (FINE * length for length in SIZE)
    model, qpos = env.unwrapped.model, env.unwrapped.data.qpos
    truth = TruthView(model, Intrinsics.from_fovy(height, width, ROBOT.camera.fovy))
    geom = truth.look(qpos).geom
    truth.close()
    expected = np.where(geom >= 0, model.geom_bodyid[geom], -1)
    found = bodies_seen(photoreal_view(env, (height, width)), qpos)
    near = np.ones((FINE + 1, FINE + 1), np.uint8)  # half a pixel to every side
    moving = [model.body(name).id for name in ("target", *env.unwrapped.sim.obstacles)]
    shown = [body for body in moving if (expected == body).sum() > 200]
    assert len(shown) >= 3
    for body in shown:
        mask, other = (expected == body).astype(np.uint8), (found == body).astype(np.uint8)
        assert not np.any(other & ~cv2.dilate(mask, near) & 1), model.body(body).name
        assert not np.any(cv2.erode(mask, near) & ~other & 1), model.body(body).name
    assert np.mean(found != expected) < 0.01


def test_equal_seeds_give_equal_pictures_whatever_was_shown_before(env):
    qpos = env.unwrapped.data.qpos.copy()
    view = photoreal_view(env, SIZE, samples=4)
    elsewhere = qpos + 0.02
    view.render(elsewhere, 1)
    first = view.render(qpos, 2)
    np.testing.assert_array_equal(photoreal_view(env, SIZE, samples=4).render(qpos, 2), first)
    view.load()
    np.testing.assert_array_equal(view.render(qpos, 2), first)
    assert np.any(view.render(qpos, 3) != first)


def test_noise_of_neighbouring_seeds_is_independent(env):
    qpos = env.unwrapped.data.qpos
    view = photoreal_view(env, SIZE, samples=4)
    pictures = np.array([view.render(qpos, seed).astype(float) for seed in range(24)])
    noise = (pictures - pictures.mean(axis=0)).reshape(24, -1)
    neighbours = np.diag(np.corrcoef(noise), 1)
    assert abs(neighbours.mean() + 1.0 / 23.0) < 0.03  # of 24 values minus their mean


def test_picture_has_the_brightness_and_colours_of_mujocos(env):
    from fixation_gym.envs.rendering import View

    model, qpos = env.unwrapped.model, env.unwrapped.data.qpos
    view = View(model, "wrist", *SIZE, full_quality=False)
    plain = view.render(qpos, with_reflections=False).astype(float)
    view.close()
    photo = photoreal_view(env, SIZE, samples=16).render(qpos, 0).astype(float)
    for channel in range(3):
        assert np.corrcoef(plain[..., channel].ravel(), photo[..., channel].ravel())[0, 1] > 0.7
    assert 0.6 < photo.mean() / plain.mean() < 1.4
