import re
from dataclasses import replace
from functools import cache, partial

import cv2
import numpy as np
import pytest
from pinhole_scene import Rectangle, Scene, fixating_pose, noise_texture, observe, upright

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception import Perception, draw_overlay, obstacle_centre
from fixation_gym.perception.drawing import distance_text
from fixation_gym.perception.zero_flow.zero_flow import CELLS, UNKNOWN

CAMERA = Intrinsics.from_fovy(160, 214, np.deg2rad(42.5))
RED = (0.85, 0.08, 0.08)
TARGET = np.array([0.4, 0.0, 0.0])


def poster_scene():
    """A red disc at 0.4 m before a wall; two things nearer, two farther, all facing the camera."""
    return Scene(
        [
            upright([0.8, 0, 0], 2, 2, noise_texture(1)),
            upright(TARGET, 0.025, 0.025, noise_texture(2, RED, 0.2), round=True),
            upright([0.24, 0.06, 0.03], 0.03, 0.03, noise_texture(3, (0.4, 0.6, 0.4))),
            upright([0.34, -0.08, 0.05], 0.03, 0.03, noise_texture(4, (0.5, 0.5, 0.8))),
            upright([0.46, 0.09, -0.07], 0.04, 0.03, noise_texture(5, (0.8, 0.8, 0.4))),
            upright([0.5, -0.1, -0.07], 0.04, 0.03, noise_texture(6)),
        ]
    )


def frames(scene, pose_at, camera=CAMERA):
    """Function of the frame number: observation, true depth, visible rectangle and pose, each rendered once."""

    @cache
    def frame(k):
        pose = pose_at(0.04 * k)
        return (*observe(scene, pose, 0.04 * k, camera), pose)

    return frame


def run(frame, steps, camera=CAMERA, start=0, perception=None, **options):
    """Feed frames; returns perception, last percept, last observation and the truth of the filter-centre frame."""
    perception = perception or Perception(camera, **options)
    truth = []
    for k in range(start, start + steps):
        observation, *true = frame(k)
        percept = perception.update(observation)
        truth = [*truth[-1:], true]
    return perception, percept, observation, truth[0]


def on_grid(values, percept):
    shape = percept.zfc.p_nearer.shape
    return cv2.resize(values.astype(np.float32), shape[::-1], interpolation=cv2.INTER_NEAREST)


def circling(t, v_z=0.0):
    return fixating_pose([v_z * t, 0.05 * np.cos(t) - 0.05, 0.05 * np.sin(t)], TARGET)


POSTERS = frames(poster_scene(), circling)
POSTERS_APPROACHED = frames(poster_scene(), partial(circling, v_z=0.05))


def sign_scores(percept, truth):
    depth, _, pose = truth
    fixated = pose[:3, 2] @ (TARGET - pose[:3, 3])
    depth = on_grid(depth, percept)
    used = percept.zfc.supported & (np.abs(depth / fixated - 1) > 0.1)
    front = depth < fixated
    right = (percept.zfc.p_nearer > 0.5) == front
    return right[used].mean(), right[used & front].mean(), used.mean()


@pytest.mark.parametrize("frame", [POSTERS, POSTERS_APPROACHED], ids=["circling", "approaching"])
def test_the_sign_is_right_also_while_approaching(frame):
    scores = []
    perception, start = None, 0
    for steps in (16, 4):
        perception, percept, _, truth = run(frame, steps, start=start, perception=perception)
        start += steps
        scores.append(sign_scores(percept, truth))
    accuracy, recall, share = np.mean(scores, axis=0)
    assert accuracy > 0.97
    assert (
        recall > 0.8
    )  # at rims before the textured wall windows show the wall, and those that do not have no evidence
    assert share > 0.6
    assert percept.zfc.moving.mean() < 0.02


def test_the_inverse_depth_of_each_pixel_is_right_within_its_stated_error():
    _, percept, _, (depth, index, _) = run(POSTERS, 18)
    patches = [on_grid(index == number, percept) > 0 for number in (0, 2, 3)]
    for patch, margin in zip(patches, (9, 9, 9), strict=True):
        inner = cv2.erode(patch.astype(np.uint8), np.ones((margin, margin), np.uint8)).astype(bool)
        inner &= percept.zfc.supported
        error = percept.zfc.inverse_depth - 1 / on_grid(depth, percept)
        assert np.abs(np.median(error[inner])) < 0.06
        assert np.mean((error[inner] / percept.zfc.inverse_depth_std[inner]) ** 2) < 3.0


def test_the_map_shows_the_nearer_things_where_they_are_and_the_obstacle_centre_lies_among_them():
    _, percept, _, (_, index, _) = run(POSTERS, 18)
    near = cv2.resize(np.isin(index, (2, 3)).astype(np.float32), (CELLS, CELLS), interpolation=cv2.INTER_AREA)
    cells = percept.zfc.cells
    assert (cells[near > 0.9] > 200).mean() > 0.9
    assert (cells[cv2.dilate(near, np.ones((3, 3))) == 0] > 160).mean() < 0.02
    centre, weight = obstacle_centre(percept.zfc, CAMERA)
    x, y = CAMERA.scaled(CELLS, CELLS).grid
    weights = near * (cells != UNKNOWN)  # the border of the image is unknown
    expected = np.array([(weights * x).sum(), (weights * y).sum()]) / weights.sum()
    np.testing.assert_allclose(centre, expected, atol=0.05)
    assert weight == pytest.approx(weights.mean(), rel=0.3)


def tabletop():
    """Textured table at height 0, a red patch on it, a post of 12 cm beside the line of sight."""
    across, forward = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])
    return Scene(
        [
            Rectangle(np.array([0.5, 0, 0]), 2 * forward, 2 * across, noise_texture(1, (0.75, 0.6, 0.45), 0.3), 0.4),
            Rectangle(np.array([0.5, 0, 0.001]), 0.03 * forward, 0.03 * across, noise_texture(2, RED, 0.15)),
            upright([0.36, 0.06, 0.06], 0.02, 0.06, noise_texture(3, (0.4, 0.6, 0.4))),
        ]
    )


def over_the_table(t):
    return fixating_pose([0.1, 0.05 * np.cos(t), 0.38 + 0.05 * np.sin(t)], [0.5, 0, 0])


def test_the_table_is_nearer_than_the_target_but_known_by_its_height():
    fronts = {}
    frame = frames(tabletop(), over_the_table)
    for height in (None, 0.0):
        _, percept, _, (_, index, _) = run(frame, 18, support_height_m=height)
        front = percept.zfc.p_nearer > 0.9
        fronts[height] = [front[on_grid(index == number, percept) > 0].mean() for number in (0, 2)]
    assert fronts[None][0] > 0.2
    assert fronts[0.0][0] < 0.01
    assert fronts[0.0][1] > 0.4


def test_a_thing_that_moves_by_itself_is_flagged_and_counts_as_near():
    scene, indices = poster_scene(), []
    perception = Perception(CAMERA)
    for k in range(16):
        t = 0.04 * k
        pose = fixating_pose([0.0, 0.05 * t, 0.0], TARGET)
        moved = replace(scene.rectangles[5], centre=np.array([0.5, -0.1, -0.07 + 0.1 * t]))
        observation, _, index = observe(Scene([*scene.rectangles[:5], moved]), pose, t, CAMERA)
        percept = perception.update(observation)
        indices.append(index)
    own = on_grid(indices[-2] == 5, percept) > 0
    assert percept.zfc.moving[own].mean() > 0.6
    assert percept.zfc.moving[~own].mean() < 0.03


@pytest.mark.parametrize("speed_rad_s", [0.0, 0.1])
def test_without_translation_everything_is_unknown(speed_rad_s):
    def pose(t):
        matrix = fixating_pose([0.0, 0.0, 0.0], TARGET)
        turn = speed_rad_s * t
        return matrix @ np.array(
            [[np.cos(turn), 0, np.sin(turn), 0], [0, 1, 0, 0], [-np.sin(turn), 0, np.cos(turn), 0], [0, 0, 0, 1]]
        )

    _, percept, _, _ = run(frames(poster_scene(), pose), 6)
    assert percept.flow.valid
    assert not percept.zfc.supported.any()
    assert (percept.zfc.p_nearer == 0.5).all()
    assert (percept.zfc.cells == UNKNOWN).all()
    np.testing.assert_array_equal(obstacle_centre(percept.zfc, CAMERA)[0], 0)
    assert obstacle_centre(percept.zfc, CAMERA)[1] == 0


def test_a_lost_target_makes_everything_unknown_and_its_distance_less_certain():
    perception, before, _, _ = run(POSTERS, 12)
    hidden = Scene([r for number, r in enumerate(poster_scene().rectangles) if number != 1])
    _, percept, _, _ = run(frames(hidden, circling), 6, start=12, perception=perception)
    assert not percept.fixation.visible
    assert (percept.zfc.cells == UNKNOWN).all()
    assert percept.fixation.distance_std_m > before.fixation.distance_std_m
    assert np.isfinite(percept.fixation.point_base).all()
    _, percept, _, _ = run(POSTERS, 12, start=18, perception=perception)
    assert percept.fixation.visible
    assert percept.fixation.distance_m == pytest.approx(0.4, abs=0.02)


def test_the_robot_itself_is_no_obstacle():
    mask = np.zeros((CAMERA.height, CAMERA.width), bool)
    mask[:, :107] = True
    _, percept, _, _ = run(POSTERS, 12, self_mask=mask)
    assert not percept.zfc.supported[:, :53].any()
    assert (percept.zfc.cells[:, :15] == UNKNOWN).all()
    assert percept.zfc.supported[:, 60:].any()


def test_the_first_two_frames_and_those_after_a_gap_have_no_flow():
    perception, first, _, _ = run(POSTERS, 1)
    assert not first.flow.valid
    assert (first.zfc.cells == UNKNOWN).all()
    assert first.fixation.initialised
    _, third, _, _ = run(POSTERS, 2, start=1, perception=perception)
    assert third.flow.valid
    assert third.flow.time == pytest.approx(0.04)
    assert third.time == pytest.approx(0.08)
    _, after_gap, _, _ = run(POSTERS, 2, start=9, perception=perception)
    assert not after_gap.flow.valid


def test_time_must_increase_until_reset():
    perception, _, observation, _ = run(POSTERS, 2)
    with pytest.raises(ValueError, match=r"time must increase.*call reset\(\) first"):
        perception.update(observation)
    perception.reset()
    assert perception.update(observation).time == observation.time


def test_input_of_the_wrong_kind_is_refused_with_what_is_asked_for():
    perception, _, observation, _ = run(POSTERS, 1)
    later = replace(observation, time=1.0)
    with pytest.raises(ValueError, match=r"ask for uint8 of shape"):
        perception.update(replace(later, rgb=observation.rgb[:-1]))
    with pytest.raises(ValueError, match=r"rgb is float64 .* ask for uint8"):
        perception.update(replace(later, rgb=observation.rgb / 255.0))
    for pose in (np.full(7, np.nan), np.zeros(7), np.ones(6)):
        with pytest.raises(ValueError, match="camera_pose must be a finite position and quaternion"):
            perception.update(replace(later, camera_pose=pose))
    with pytest.raises(ValueError, match="self_mask has shape"):
        Perception(CAMERA, self_mask=np.zeros((3, 3), bool))


@pytest.mark.parametrize(("height", "width"), [(64, 64), (97, 131), (480, 640)])
def test_any_image_size_works(height, width):
    camera = Intrinsics.from_fovy(height, width, np.deg2rad(42.5))
    scene = Scene(poster_scene().rectangles[:3])
    _, percept, observation, _ = run(frames(scene, circling, camera), 3, camera=camera)
    assert percept.flow.valid
    assert percept.zfc.cells.shape == (CELLS, CELLS)
    assert percept.segmentation.mask.shape == (height, width)
    assert np.isfinite(percept.flow.flow[percept.flow.overlap]).all()
    assert draw_overlay(observation.rgb, percept).shape == (height, width, 3)


def test_the_overlay_is_a_new_image_that_shows_the_evidence():
    _, percept, observation, _ = run(POSTERS, 14)
    before = observation.rgb.copy()
    picture = draw_overlay(observation.rgb, percept, scale=2.0)
    np.testing.assert_array_equal(observation.rgb, before)
    assert picture.dtype == np.uint8
    assert picture.shape == (320, 428, 3)
    front = cv2.resize((percept.zfc.p_nearer > 0.95).astype(np.uint8), (428, 320)).astype(bool)
    front[:100, 330:] = False
    assert picture[front].mean(axis=0)[0] > picture[front].mean(axis=0)[2] + 60  # orange


def test_the_overlay_says_in_words_what_is_known_of_the_distance():
    percept = run(POSTERS, 14)[1]
    assert re.fullmatch(r"\d+\.\d \+- \d\.\d cm", distance_text(percept.fixation))
    hidden = replace(percept.fixation, visible=False)
    assert distance_text(hidden) == f"{distance_text(percept.fixation)} (lost)"
    assert distance_text(replace(percept.fixation, distance_m=1000.0, distance_std_m=2e5)) == "distance unknown"
    assert distance_text(replace(percept.fixation, initialised=False)) == "target not seen yet"
