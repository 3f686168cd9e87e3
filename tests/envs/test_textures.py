"""A texture is uploaded when a scene first shows it, and pictures are those of a context that has them all."""

import numpy as np
import pytest

from fixation_gym.envs import offscreen
from fixation_gym.envs.config import SCENARIOS
from fixation_gym.envs.sampling import sample_scene
from fixation_gym.gl import select_backend

pytestmark = pytest.mark.sim


@pytest.fixture(scope="module")
def sim():
    select_backend()
    from fixation_gym.envs.pick_sim import PickSim

    return PickSim(25)


def walk(sim, full_quality):
    """Pictures of scenes one after the other in one GL context, and how many textures wait after each."""
    from fixation_gym.envs.rendering import View

    view = View(sim.model, "wrist", 48, 64, full_quality=full_quality)
    pictures, waiting = [], []
    for name, seed in (("clear", 0), ("opaque", 0), ("any_colour", 1), ("clear", 1), ("opaque", 3)):
        sim.reset(sample_scene(SCENARIOS[name], np.random.default_rng(seed)))
        pictures.append(view.render(sim.data.qpos, with_reflections=False))
        waiting.append(len(view.renderer._waiting))
    view.close()
    return np.array(pictures), waiting


@pytest.mark.parametrize("full_quality", [False, True])
def test_pictures_are_those_of_a_context_that_has_all_textures(sim, full_quality, monkeypatch):
    pictures, waiting = walk(sim, full_quality)
    assert waiting == sorted(waiting, reverse=True)
    assert waiting[0] > waiting[-1]
    monkeypatch.setattr(offscreen, "shown_textures", lambda model: frozenset(range(model.ntex)))
    all_at_once, none_waits = walk(sim, full_quality)
    assert none_waits == [0] * 5
    np.testing.assert_array_equal(pictures, all_at_once)


def test_the_model_keeps_its_textures(sim):
    sizes = sim.model.tex_width.copy()
    walk(sim, full_quality=False)
    np.testing.assert_array_equal(sim.model.tex_width, sizes)
    assert (sizes > 1).all()
