"""Instances of the hard scenes, and what the scenarios experiment runs, resumes and writes; the runs are made up."""

from __future__ import annotations

import csv
import json
import math

import numpy as np
import pytest

from fixation_gym import cli
from fixation_gym.errors import UsageError
from fixation_gym.experiments.scenarios.run import CSV_FILE, RUNS_FILE, ScenariosConfig, cell_key, instance_rng, measure
from fixation_gym.experiments.scenarios.scenes import (
    CIRCLE_RADIUS,
    CIRCLE_RATE,
    CLEAR,
    SCENES,
    VARIANTS,
    Instance,
    sample_instance,
)
from fixation_gym.experiments.scenarios.statistics import bootstrap_ratio, format_table, summarise
from fixation_gym.experiments.scenarios.view import MARGIN, SceneView
from fixation_gym.geometry.rigid import inverse, look_at, transform


def view_of(instance: Instance) -> SceneView:
    scene = instance.scene
    pose = look_at(np.array(scene.camera_position), np.array(scene.gaze_point), np.array([0.0, 0.0, 1.0]))
    depth = float(np.linalg.norm(np.array(scene.gaze_point) - scene.camera_position))
    return SceneView(pose, scene.target, depth)


@pytest.mark.parametrize(
    ("scene", "variant"),
    [(scene, variant) for scene in SCENES[:3] for variant in VARIANTS] + [("reflection", "border")],
)
def test_every_instance_shows_what_its_scene_promises(scene, variant):
    instance = sample_instance(scene, variant, np.random.default_rng(7))
    view = view_of(instance)
    kinds = [obstacle.kind for obstacle in instance.scene.obstacles]
    expected = {
        "opaque": ["opaque"] * 4,
        "see_through": ["translucent", "opaque"],
        "mirror": ["mirror", "opaque", "opaque"],
        "reflection": ["mirror", "opaque"],
    }
    assert kinds == expected[scene]
    depths = [view.depths(obstacle) for obstacle in instance.scene.obstacles]
    assert depths[0].max() < 1.0 - MARGIN
    assert scene == "reflection" or depths[-1].min() > 1.0 + MARGIN
    if scene == "see_through" and variant != "border":
        assert view.is_across(instance.scene.obstacles[0])
    first = transform(inverse(view.T_base_cam), np.array(instance.scene.obstacles[0].position))
    assert variant != "border" or abs(first[0] / first[2]) > 0.29
    solid = [obstacle.texture for obstacle in instance.scene.obstacles if obstacle.kind == "opaque"]
    assert variant != "plain" or set(solid) <= {"wood_plain"}
    assert instance.bare == (variant == "plain" and scene == "see_through")
    assert (instance.mover is not None) == (variant == "moving")
    assert 0.0199 < math.hypot(*instance.velocity) < 0.101 or variant != "moving"


def test_a_reflected_thing_has_its_image_behind_the_target_in_the_direction_of_the_mirror():
    for seed in range(3):
        instance = sample_instance("reflection", "border", np.random.default_rng(seed))
        view, (mirror, solid) = view_of(instance), instance.scene.obstacles
        normal = np.array([math.cos(mirror.yaw), math.sin(mirror.yaw), 0.0])
        offset = np.array(solid.position) - mirror.position
        assert offset @ normal > 0.0  # before the mirror's face
        image = np.array(solid.position) - 2.0 * (offset @ normal) * normal
        seen = transform(inverse(view.T_base_cam), image)
        there = transform(inverse(view.T_base_cam), np.array(mirror.position))
        assert seen[2] > (1.0 + MARGIN) * view.depth
        assert abs(seen[0] / seen[2] - there[0] / there[2]) < 0.2


def test_the_camera_circles_and_approaches_as_fast():
    lateral, approach = (sample_instance("opaque", name, np.random.default_rng(0)) for name in VARIANTS[:2])
    speed = CIRCLE_RADIUS * CIRCLE_RATE
    np.testing.assert_allclose(np.linalg.norm(lateral.velocity_at(1.0)), speed)
    assert lateral.velocity_at(1.0)[2] == 0.0
    np.testing.assert_allclose(approach.velocity_at(1.0)[2], speed)
    np.testing.assert_allclose(np.linalg.norm(approach.velocity_at(1.0)[:2]), speed)
    np.testing.assert_array_equal(lateral.velocity_at(0.0), 0.0)
    assert sample_instance(CLEAR, "approach", np.random.default_rng(0)).scene.obstacles == ()


def counts(right: int) -> dict[str, int]:
    halves = {"front": 40, "front_called": 38, "called": 40, "image": 0, "image_behind": 0}
    return {"asked": 100, "right": right, "inner": 80, "inner_right": min(80, right), **halves}


def fake_run(cell):
    if cell["scene"] == CLEAR:
        alarms = {"map_alarms": 2, "path_alarms": 0, "front_cells": 1, "known_cells": 1000}
        return {**cell, "frames": 748, "seconds": 30.0, **alarms}
    item = {
        "kind": "opaque",
        "shape": "block",
        "alpha": 1.0,
        "trimmed": False,
        "moves": cell["variant"] == "moving",
        "side": "front",
        "nearness": 0.6,
        "pixels": 300.0,
        "verdicts": {"paper": {"unknown": 10}, "exact": {"front": 9, "unknown": 1}},
        "final": {"paper": "unknown", "exact": "front"},
        "first_call_s": {"paper": None, "exact": 0.08 if cell["seed"] % 2 else 0.6},
    }
    rules = {"paper": counts(70), "exact": counts(99)}
    scores = {"pixels": 120, "unknown": 20, "falsely_moving": 1, "distance_error": 0.01}
    return {**cell, "frames": 10, "rules": rules, "objects": [item], **scores}


def test_a_run_gives_rows_votes_and_alarms_and_resumes(tmp_path):
    config = ScenariosConfig(instances=2, film=False)
    summary = measure(config, tmp_path, fake_run)
    for scene in SCENES:
        rows = {(row["variant"], row["rule"]): row for row in summary["scenes"][scene]}
        assert rows["all", "exact"]["sign_accuracy"] == pytest.approx(0.99)
        assert rows["all", "paper"]["sign_accuracy"] == pytest.approx(0.70)
        assert rows["plain", "exact"]["front_recall"] == pytest.approx(0.95)
        assert rows["plain", "exact"]["image_behind"] is None
        assert rows["all", "exact"]["object_vote_accuracy"] == 1.0
        assert rows["all", "exact"]["instances"] == 10
    groups = {(row["group"], row["rule"]): row for row in summary["objects"]}
    opaque = groups["opaque, in front", "exact"]
    assert (opaque["objects"], opaque["called_front"], opaque["first_call_in_time"]) == (32, 32, 0.5)
    assert groups["opaque, in front", "paper"]["called_unknown"] == 32
    assert summary["clear"]["minutes"] == pytest.approx(1.0)
    assert summary["clear"]["map_alarms_per_minute"] == pytest.approx(4.0)
    assert summary["clear"]["path_alarms"] == 0
    assert "exact" in format_table(summary)
    with (tmp_path / CSV_FILE).open() as file:
        table = list(csv.DictReader(file))
    assert len(table) == 4 * 6 * 2
    assert float(table[0]["sign_accuracy_ci95_low"]) == pytest.approx(0.70)

    lines = (tmp_path / RUNS_FILE).read_text().splitlines(keepends=True)
    (tmp_path / RUNS_FILE).write_text("".join(lines[:5]) + lines[5][:20])  # killed while writing
    done = []

    def counting(cell):
        done.append(cell_key(cell))
        return fake_run(cell)

    again = measure(config, tmp_path, counting)
    assert (again["runs_resumed"], len(done)) == (5, len(lines) - 5)
    assert again["scenes"] == summary["scenes"]
    json.loads((tmp_path / "summary.json").read_text())


def test_instances_differ_by_seed_scene_and_variant():
    cells = ScenariosConfig(instances=3).cells()
    assert len(cells) == 3 * (len(SCENES) * len(VARIANTS) + 1)
    assert len({instance_rng(cell).random() for cell in cells.values()}) == len(cells)
    assert ScenariosConfig(quick=True).instance_count == 3
    assert ScenariosConfig().instance_count == 20


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"noise": "loud"}, "nominal"),
        ({"seed": -1}, "--seed must be 0 or more"),
        ({"instances": 0}, "--instances must be within"),
        ({"workers": 0}, "--workers must be at least 1"),
    ],
)
def test_bad_options_are_refused_with_what_is_allowed(options, message):
    with pytest.raises(UsageError, match=message):
        ScenariosConfig(**options).check()


def test_the_command_line_ends_with_one_line_on_bad_input(capsys):
    assert cli.main(["scenarios", "--noise", "loud"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_runs_in_which_the_target_was_never_seen_leave_the_distance_error_out():
    rules = {rule: {"right": 1, "asked": 1} for rule in ("paper", "exact")}
    run = {"scene": "opaque", "variant": "lateral", "rules": rules, "objects": [], "unknown": 0, "pixels": 1}
    runs = [run | {"falsely_moving": 0, "distance_error": error} for error in (None, 0.02, 0.01)]
    row = summarise(runs)["scenes"]["opaque"][0]
    assert row["distance_error_worst"] == 0.02
    assert row["distance_error_median"] == pytest.approx(0.015)


def test_the_interval_of_a_ratio_holds_it_and_is_none_without_data():
    ratio, interval = bootstrap_ratio([(9, 10), (5, 10), (10, 10), (0, 0)])
    assert ratio == pytest.approx(0.8)
    assert interval is not None
    assert interval[0] < 0.8 < interval[1]
    assert bootstrap_ratio([(0, 0)]) == (None, None)
