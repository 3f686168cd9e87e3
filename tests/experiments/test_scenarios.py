"""Instances of the hard scenes, and what the scenarios experiment runs, resumes and writes; the runs are made up."""

from __future__ import annotations

import csv
import json
import math

import numpy as np
import pytest

from fixation_gym import cli
from fixation_gym.envs.scene import ObstacleSpec
from fixation_gym.errors import UsageError
from fixation_gym.experiments.scenarios.config import ScenariosConfig
from fixation_gym.experiments.scenarios.rules import RULES, plane_front
from fixation_gym.experiments.scenarios.run import CSV_FILE, RUNS_FILE, cell_key, instance_rng, measure
from fixation_gym.experiments.scenarios.scenes import (
    CIRCLE_RADIUS,
    CIRCLE_RATE,
    CLEAR,
    MATERIAL_SCENES,
    SCENES,
    VARIANTS,
    Instance,
    sample_instance,
)
from fixation_gym.experiments.scenarios.statistics import bootstrap_ratio, format_table, summarise
from fixation_gym.experiments.scenarios.view import MARGIN, SceneView
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import inverse, look_at, transform
from fixation_gym.perception.zero_flow.region_vote import VoteSettings
from fixation_gym.robots import ROBOT


def view_of(instance: Instance) -> SceneView:
    scene = instance.scene
    pose = look_at(np.array(scene.camera_position), np.array(scene.gaze_point), np.array([0.0, 0.0, 1.0]))
    depth = float(np.linalg.norm(np.array(scene.gaze_point) - scene.camera_position))
    return SceneView(pose, scene.target, depth)


def asked(instance: Instance) -> tuple[ObstacleSpec, ...]:
    """All obstacles but the stand under the target."""
    return instance.scene.obstacles[: instance.stand]


@pytest.mark.parametrize(
    ("scene", "variant"),
    [(scene, variant) for scene in SCENES[:3] for variant in VARIANTS]
    + [("reflection", "border"), ("glass", "lateral"), ("chrome", "lateral")],
)
def test_every_instance_shows_what_its_scene_promises(scene, variant):
    instance = sample_instance(scene, variant, np.random.default_rng(7))
    view, obstacles = view_of(instance), asked(instance)
    expected = {
        "opaque": ["opaque"] * 4,
        "see_through": ["translucent", "opaque"],
        "mirror": ["mirror", "opaque", "opaque", "opaque"],
        "reflection": ["mirror", "opaque"],
        "glass": ["glass", "opaque"],
        "chrome": ["chrome", "chrome", "opaque", "opaque"],
    }
    assert [obstacle.kind for obstacle in obstacles] == expected[scene]
    depths = [view.sight(obstacle).depths for obstacle in obstacles]
    assert depths[0].max() < 1.0 - MARGIN
    assert scene == "reflection" or depths[-1].min() > 1.0 + MARGIN
    if scene == "see_through" and variant != "border":
        assert view.is_across(obstacles[0])
    if variant == "border":
        assert np.abs(view.sight(obstacles[0]).places[:, 0]).max() > 0.29
    solid = [obstacle.texture for obstacle in obstacles if obstacle.kind == "opaque"]
    assert variant != "plain" or set(solid) <= {"wood_plain"}
    assert instance.bare == (variant == "plain" and scene == "see_through")
    assert (instance.mover is not None) == (variant == "moving")
    assert 0.0199 < math.hypot(*instance.velocity) < 0.101 or variant != "moving"


def test_what_holds_the_target_up_reaches_from_the_table_to_it():
    for seed in range(6):
        instance = sample_instance("see_through", "lateral", np.random.default_rng(seed))
        target = instance.scene.target.box
        low = target.centre[2] - target.half_extent[2]
        if instance.stand is None:
            assert low == pytest.approx(ROBOT.workspace.table_height)
            continue
        stand = instance.scene.obstacles[instance.stand]
        assert stand.position[2] - stand.shape.half_extent[2] == pytest.approx(ROBOT.workspace.table_height)
        assert stand.position[2] + stand.shape.half_extent[2] == pytest.approx(low)
        assert 0.05 <= low - ROBOT.workspace.table_height <= 0.15


def test_the_plane_is_in_front_where_the_table_is_nearer_than_the_target():
    camera = Intrinsics.from_fovy(30, 40, 0.7)
    pose = look_at(np.array([0.0, 0.0, 1.2]), np.array([1.0, 0.0, 0.2]), np.array([0.0, 0.0, 1.0]))
    front = plane_front(pose, camera, table_height=0.2, inverse_distance=1.0 / math.sqrt(2.0))
    np.testing.assert_array_equal(front, camera.grid[1] > 0.0)  # the table is in the image's middle at that distance
    assert not plane_front(pose, camera, 0.2, 1.0 / 0.5).any()  # the target is held up near the camera
    level = look_at(np.array([0.0, 0.0, 1.2]), np.array([1.0, 0.0, 1.2]), np.array([0.0, 0.0, 1.0]))
    assert not plane_front(level, camera, 0.2, 1e-3)[:15].any()  # lines of sight that rise never meet the table


def test_neither_the_table_nor_the_place_in_the_image_tells_the_sides():
    settings = VoteSettings()
    rows: dict[bool, list[float]] = {True: [], False: []}
    right = []
    for scene in SCENES[:2]:
        for variant in ("lateral", "border", "plain"):
            for seed in range(1, 4):
                instance = sample_instance(scene, variant, np.random.default_rng(seed))
                view = view_of(instance)
                for obstacle in asked(instance):
                    sight = view.sight(obstacle)
                    in_front = bool(np.median(sight.depths) < 1.0)
                    assert in_front or sight.low_share == 0.0  # above the table it cannot be otherwise
                    rows[in_front].append(float(np.median(sight.places[:, 1])))
                    right.append((sight.low_share >= settings.front_share) == in_front)
    assert 0.4 < np.mean(right) < 0.6
    assert 0.4 < len(rows[True]) / len(right) < 0.6
    assert abs(np.median(rows[True]) - np.median(rows[False])) < 0.08


def test_a_reflected_thing_has_its_image_behind_the_target_in_the_direction_of_the_mirror():
    for seed in range(3):
        instance = sample_instance("reflection", "border", np.random.default_rng(seed))
        view, (mirror, solid) = view_of(instance), asked(instance)
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
    halves |= {"on_obstacle": 20, "on_obstacle_right": right // 5, "on_room": 80, "on_room_right": right - right // 5}
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
        "verdicts": {rule: {"unknown": 10} for rule in RULES} | {"exact": {"front": 9, "unknown": 1}},
        "final": dict.fromkeys(RULES, "unknown") | {"exact": "front"},
        "first_call_s": dict.fromkeys(RULES) | {"exact": 0.08 if cell["seed"] % 2 else 0.6},
    }
    rules = {"plane": counts(50), "behind": counts(40), "paper": counts(70), "exact": counts(99)}
    scores = {"pixels": 120, "unknown": 20, "falsely_moving": 1, "distance_error": 0.01}
    return {**cell, "frames": 10, "rules": rules, "objects": [item], **scores}


def test_a_run_gives_rows_votes_and_alarms_and_resumes(tmp_path):
    config = ScenariosConfig(count=2, film=False)
    summary = measure(config, tmp_path, fake_run)
    for scene in SCENES:
        rows = {(row["variant"], row["rule"]): row for row in summary["scenes"][scene]}
        assert rows["all", "exact"]["sign_accuracy"] == pytest.approx(0.99)
        assert rows["all", "paper"]["sign_accuracy"] == pytest.approx(0.70)
        assert rows["all", "plane"]["sign_accuracy"] == pytest.approx(0.50)
        assert rows["all", "exact"]["obstacle_sign_accuracy"] == pytest.approx(0.95)
        assert rows["all", "exact"]["room_sign_accuracy"] == pytest.approx(1.0)
        assert rows["all", "exact"]["table_sign_accuracy"] is None
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
    assert [row["instances"] for row in summary["scenes"]["all"]] == [40] * len(RULES)
    assert all(rule in format_table(summary) for rule in RULES)
    with (tmp_path / CSV_FILE).open() as file:
        table = list(csv.DictReader(file))
    assert len(table) == (4 * 6 + 1) * len(RULES)
    paper = RULES.index("paper")
    assert float(table[paper]["sign_accuracy_ci95_low"]) == pytest.approx(0.70)

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
    cells = ScenariosConfig(count=3).cells()
    assert len(cells) == 3 * (len(SCENES) * len(VARIANTS) + 1)
    assert len({instance_rng(cell).random() for cell in cells.values()}) == len(cells)
    assert ScenariosConfig(quick=True).repetitions == 3
    assert ScenariosConfig().repetitions == 20


def test_mitsuba_adds_glass_and_chrome_and_leaves_the_clear_scene_out():
    cells = ScenariosConfig(count=2, variants=("lateral",), renderer="mitsuba").cells()
    scenes = {scene for scene, _, _ in cells}
    assert scenes == {*SCENES, *MATERIAL_SCENES}
    assert len(cells) == 2 * len(scenes)
    assert {cell["renderer"] for cell in cells.values()} == {"mitsuba"}
    plain = ScenariosConfig(count=2).cells()
    shared = {key: instance_rng(cell).random() for key, cell in cells.items() if key in plain}
    assert shared == {key: instance_rng(plain[key]).random() for key in shared}  # the same instances by both renderers


def test_surfaces_in_front_are_counted_whatever_is_seen_in_them():
    counts = {"right": 1, "asked": 1, "front_curved_mirror": 10, "front_curved_mirror_called": 9}
    run = {"scene": "chrome", "variant": "lateral", "rules": dict.fromkeys(RULES, counts), "objects": []}
    run |= {"unknown": 0, "pixels": 1, "falsely_moving": 0, "distance_error": 0.01}
    rows = summarise([run])["scenes"]["chrome"]
    assert {row["variant"] for row in rows} == {"lateral", "all"}
    assert rows[0]["curved_mirror_called_front"] == pytest.approx(0.9)
    assert rows[0]["flat_mirror_called_front"] is None


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"noise": "loud"}, "nominal"),
        ({"variants": ("sideways",)}, "lateral, approach"),
        ({"renderer": "blender"}, "mujoco, mitsuba"),
        ({"seed": -1}, "--seed must be 0 or more"),
        ({"count": 0}, "--instances must be within"),
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
    rules = {rule: {"right": 1, "asked": 1} for rule in RULES}
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
