"""Scenes with glass, chrome, lacquer, plastic and several mirrors: what both renderers make of them."""

from dataclasses import replace

import numpy as np
import pytest

from fixation_gym.envs.config import SCENARIOS, Scenario
from fixation_gym.envs.photoreal.materials import AIR, GLASS, WATER, Material
from fixation_gym.envs.photoreal.solids import solids_of
from fixation_gym.envs.sampling import sample_scene
from fixation_gym.envs.scene import ObstacleSpec
from fixation_gym.envs.shapes import PLAIN_MATERIALS, Part, Shape, scaled
from fixation_gym.envs.things import THINGS

pytestmark = pytest.mark.sim


@pytest.fixture(scope="module")
def sim():
    from fixation_gym.envs.pick_sim import PickSim

    return PickSim(25)


def materials_of(sim, shape):
    """Materials of the solids of one obstacle of that shape, alone on the table."""
    scene = sample_scene(SCENARIOS["clear"], np.random.default_rng(1))
    obstacle = ObstacleSpec("glass", shape, (0.7, 0.3, 0.0), 0.0, (0.6, 0.9, 0.6, 0.4), "wood_dark")
    sim.reset(replace(scene, obstacles=(obstacle,)))
    body = sim.model.body(sim.obstacles[0]).id
    return [solid.material for solid in solids_of(sim.model) if solid.body == body]


def one_part(finish, primitive="cylinder"):
    return Shape("part", (Part(primitive, (0.03, 0.03, 0.05), finish=finish),), (0.03, 0.03, 0.05), 0.5)


@pytest.mark.parametrize("finish", ["chrome", "brushed", "lacquer", "plastic"])
def test_finishes_become_materials_of_the_same_names(sim, finish):
    assert [material.finish for material in materials_of(sim, one_part(finish))] == [finish]


def test_lacquer_has_the_colour_of_the_obstacle(sim):
    assert materials_of(sim, one_part("lacquer")) == [Material("lacquer", (0.6, 0.9, 0.6))]


def test_bottle_of_water_has_three_kinds_of_surface(sim):
    found = {(m.inside, m.outside) for m in materials_of(sim, one_part("water"))}
    assert found == {(GLASS, AIR), (GLASS, WATER), (WATER, AIR)}
    assert {(m.inside, m.outside) for m in materials_of(sim, one_part("cup"))} == {(GLASS, AIR)}


def test_mirrors_reflect_on_one_face(sim):
    assert {material.finish for material in materials_of(sim, one_part("mirror", "box"))} == {"mirror", "matt"}


@pytest.mark.parametrize("material", ["glass", "chrome", "lacquer", "plastic"])
def test_things_look_alike_whatever_their_size(sim, material):
    for shape in THINGS[material]:
        assert set(materials_of(sim, scaled(shape, 0.8))) == set(materials_of(sim, shape))


def test_only_scenarios_that_say_so_have_several_mirrors():
    counts = {}
    for name in ("mirror", "two_mirrors"):
        scenes = [sample_scene(SCENARIOS[name], np.random.default_rng(seed)) for seed in range(6)]
        counts[name] = [sum(obstacle.kind == "mirror" for obstacle in scene.obstacles) for scene in scenes]
    assert max(counts["mirror"]) == 1
    assert min(counts["two_mirrors"]) >= 2
    with pytest.raises(ValueError, match="mirrors alone allow one obstacle; add another material, or several_mirrors"):
        Scenario("custom", ("mirror",), obstacle_count=(2, 2))


def test_earlier_scenarios_draw_from_the_materials_that_there_were():
    assert SCENARIOS["mixed"].obstacle_materials == SCENARIOS["clutter"].obstacle_materials == PLAIN_MATERIALS
    assert PLAIN_MATERIALS == ("opaque", "translucent", "mirror", "wire")
