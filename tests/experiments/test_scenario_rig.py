"""The arm before the hard scenes: the truth is the simulator's, and mirrors show what the truth says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from fixation_gym.envs.sensor_noise import SENSOR_NOISE
from fixation_gym.experiments.scenarios.scenes import SCENES

pytestmark = pytest.mark.sim


@pytest.fixture(scope="module")
def rig() -> Iterator:
    from fixation_gym.gl import select_backend

    select_backend()
    from fixation_gym.experiments.scenarios.rig import ScenarioRig

    rig = ScenarioRig(SENSOR_NOISE["ideal"])
    yield rig
    rig.close()


def looks(rig, scene, variant="lateral", seed=3, seconds=1.2):
    rng = np.random.default_rng(seed)
    instance = replace(rig.draw(scene, variant, rng), duration_s=seconds)
    return instance, list(rig.run(instance, rng))


def test_true_depths_are_those_of_the_estimated_flow_also_in_a_mirror(rig) -> None:
    from fixation_gym.experiments.scenarios.scores import pixel_truth

    instance, seen = looks(rig, "reflection")
    look = seen[-1]
    truth = rig.truth(look)
    answers = pixel_truth(rig, instance, truth, look.target_depth)
    zfc = look.percept.zfc
    mirror = np.isfinite(truth.image_depth) & answers.inner & zfc.supported
    assert mirror.sum() > 100
    assert (truth.image_depth[mirror] > truth.depth[mirror]).all()  # virtual images lie behind their mirror
    for pixels, true in ((mirror, truth.image_depth), (answers.inner & zfc.supported & ~mirror, truth.depth)):
        relative = zfc.inverse_depth[pixels] * true[pixels] - 1.0
        assert abs(np.median(relative)) < 0.05
        assert np.mean(np.abs(relative) < 0.25) > 0.9
    # The surface of the mirror itself would not do.
    assert np.median(zfc.inverse_depth[mirror] * truth.depth[mirror]) < 0.9


def test_see_through_things_have_a_surface_and_something_behind_it(rig) -> None:
    instance, seen = looks(rig, "see_through", "plain", seconds=0.2)
    truth = rig.truth(seen[-1])
    glass = truth.depth_behind_glass > truth.depth + 1e-4
    owners = np.array(rig.owners)[truth.geom[glass]]
    assert glass.sum() > 200
    assert set(owners) == {rig.sim.obstacles[0]}
    assert instance.bare


def test_nothing_falls_or_touches_the_arm(rig) -> None:
    for seed, (scene, variant) in enumerate([("opaque", "lateral"), ("mirror", "approach"), ("see_through", "border")]):
        rng = np.random.default_rng(seed)
        instance = rig.draw(scene, variant, rng)
        bodies = (*rig.sim.obstacles, "target")
        before = [rig.sim.body_position(body) for body in bodies]
        for _ in rig.run(instance, rng):
            pass
        np.testing.assert_allclose([rig.sim.body_position(body) for body in bodies], before, atol=0.002)


def test_places_part_the_picture_and_all_rules_are_asked_at_the_same_pixels(rig) -> None:
    from fixation_gym.experiments.scenarios.rules import RULES
    from fixation_gym.experiments.scenarios.scores import PLACES, pixel_counts, pixel_truth

    instance, seen = looks(rig, "mirror", seconds=0.6)
    answers = pixel_truth(rig, instance, rig.truth(seen[-1]), seen[-1].target_depth)
    np.testing.assert_array_equal(sum(answers.places[place].astype(int) for place in PLACES), 1)
    assert all(answers.places[place].sum() > 200 for place in PLACES)
    counts = pixel_counts(seen[-1], answers)
    assert set(counts) == set(RULES)
    assert {tuple(counts[rule][f"on_{place}"] for place in PLACES) for rule in RULES} == {
        tuple(counts["exact"][f"on_{place}"] for place in PLACES)
    }
    behind = counts["behind"]
    assert behind["right"] == behind["asked"] - behind["front"]
    plane = counts["plane"]  # the table tells itself
    assert plane["on_table_right"] >= 0.99 * plane["on_table"]


def test_a_moving_obstacle_moves_as_told(rig) -> None:
    instance, _ = looks(rig, "opaque", "moving", seconds=0.0)
    body = rig.sim.obstacles[instance.mover]
    before = rig.sim.body_position(body)
    for _ in rig.run(replace(instance, duration_s=0.8), np.random.default_rng(0)):
        pass
    moved = rig.sim.body_position(body) - before
    np.testing.assert_allclose(moved, 0.8 * np.array(instance.velocity), atol=0.003)


@pytest.mark.parametrize("scene", SCENES)
def test_a_run_is_scored_and_the_exact_rule_is_right(rig, scene, monkeypatch) -> None:
    from fixation_gym.experiments.scenarios import scoring_run as scenario_runs

    draw = rig.draw
    monkeypatch.setattr(rig, "draw", lambda *given: replace(draw(*given), duration_s=1.0))
    result = scenario_runs.run_scene(rig, scene, "border", np.random.default_rng(1))
    exact, paper = result["rules"]["exact"], result["rules"]["paper"]
    assert result["frames"] >= 2
    # But for images in mirrors: where those show nothing but a white wall, only the frame's edge has evidence.
    assert (exact["right"] - exact["image_behind"]) / (exact["asked"] - exact["image"]) > 0.97
    assert exact["asked"] == paper["asked"]
    assert exact["right"] > paper["right"]
    assert result["objects"]


def test_two_runs_with_the_same_seed_agree(rig) -> None:
    first, second = (looks(rig, "mirror", seconds=0.3)[1][-1] for _ in range(2))
    np.testing.assert_array_equal(first.image, second.image)
    np.testing.assert_array_equal(first.percept.zfc.p_nearer, second.percept.zfc.p_nearer)


def test_pictures_of_a_look_are_all_of_one_size(rig) -> None:
    from fixation_gym.experiments.scenarios.pictures import ROWS, panels
    from fixation_gym.experiments.scenarios.scores import pixel_truth

    instance, seen = looks(rig, "mirror", seconds=0.3)
    pictures = panels(seen[-1], pixel_truth(rig, instance, rig.truth(seen[-1]), seen[-1].target_depth))
    assert len(pictures) == len(ROWS)
    assert {picture.shape for picture in pictures} == {seen[-1].image.shape}
