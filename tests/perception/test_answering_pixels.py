"""Which pixels answer for themselves: on made-up pictures whose depths are known, and on made-up evidence."""

from dataclasses import replace

import numpy as np
import pytest
from pinhole_scene import Scene, noise_texture, plain_texture, upright
from test_pipeline_and_zero_flow import TARGET, circling, frames, on_grid, poster_scene, run

from fixation_gym.perception.zero_flow.answering_pixels import AnswerSettings, answering_pixels
from fixation_gym.perception.zero_flow.zero_flow import unknown_zero_flow

GREY = np.full((60, 80), 120, np.uint8)


def evidence(nearness, std=0.02):
    """A test whose pixels all have evidence: inverse depths beyond that of the fixated object, 1/m."""
    nearness = np.asarray(nearness, np.float32)
    fixated = 2.0
    return replace(
        unknown_zero_flow(*nearness.shape),
        supported=np.isfinite(nearness),
        inverse_depth=np.float32(fixated) + nearness,
        inverse_depth_std=np.full(nearness.shape, std, np.float32),
        fixated_inverse_depth=fixated,
    )


def seen(*things, steps=18):
    """Percept, picture of its zero-flow test and true rectangle of every pixel: the target and things before a wall."""
    scene = Scene([*poster_scene().rectangles[:2], *things])
    frame = frames(scene, circling)
    _, percept, _, (depth, index, pose) = run(frame, steps)
    picture = frame(steps - 2)[0].rgb  # flow and test are of the frame before the last
    fixated = pose[:3, 2] @ (TARGET - pose[:3, 3])
    return percept, picture, on_grid(index, percept).astype(int), on_grid(depth, percept) / fixated


def test_only_pixels_with_evidence_answer_and_not_those_whose_depth_may_be_on_either_side():
    nearness = np.full((30, 40), -0.5)
    nearness[:, :10], nearness[:, 10:20] = np.nan, -0.015
    answering = answering_pixels(evidence(nearness), GREY)
    np.testing.assert_array_equal(answering[0], np.arange(40) >= 20)
    assert not answering_pixels(unknown_zero_flow(30, 40), GREY).any()


def test_behind_beside_surely_in_front_does_not_answer_but_in_front_does():
    nearness = np.full((30, 40), -0.5)
    nearness[:, 20:] = 0.5
    np.testing.assert_array_equal(answering_pixels(evidence(nearness), GREY)[0], ~np.isin(np.arange(40), range(14, 20)))
    nearness[:, 20:] = 0.03  # in front, but not surely: it silences nobody
    assert answering_pixels(evidence(nearness), GREY).all()


@pytest.mark.parametrize("scale", [1, 2, 4])
def test_overexposed_pixels_and_their_neighbours_do_not_answer_whatever_the_size_of_the_picture(scale):
    picture = np.full((30 * scale, 40 * scale, 3), 200, np.uint8)
    picture[10 * scale : 20 * scale, 10 * scale : 20 * scale] = 255
    rows, columns = np.nonzero(~answering_pixels(evidence(np.full((30, 40), 0.5)), picture))
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (9, 20, 9, 20)
    assert len(rows) == 12 * 12


def test_a_plain_thing_in_front_of_texture_is_not_called_behind_by_pixels_that_answer():
    plain = upright([0.26, 0.06, 0.02], 0.03, 0.03, plain_texture((0.45, 0.45, 0.45)))
    percept, picture, index, _ = seen(plain)
    zfc, thing = percept.zfc, index == 2
    with np.errstate(invalid="ignore"):
        behind = zfc.inverse_depth < zfc.fixated_inverse_depth
    answering = answering_pixels(zfc, picture)
    wrong_before, wrong = (zfc.supported & behind & thing).sum(), (answering & behind & thing).sum()
    assert wrong_before > 20  # the wall's texture is stronger than the outline
    assert wrong < wrong_before / 3
    front = zfc.supported & thing & (zfc.p_nearer > 0.95)
    assert (answering & front).sum() > 0.95 * front.sum()


def test_a_white_hole_in_a_frame_in_front_does_not_answer_with_the_motion_of_the_frame():
    frame = upright([0.26, 0.06, 0.02], 0.035, 0.035, noise_texture(3, (0.4, 0.4, 0.4)))
    hole = upright([0.259, 0.06, 0.02], 0.02, 0.02, plain_texture((1.0, 1.0, 1.0)))
    percept, picture, index, _ = seen(frame, hole)
    answering, white = answering_pixels(percept.zfc, picture), index == 3
    assert (percept.zfc.supported & white).sum() > 50
    assert not (answering & white).any()
    assert (answering & (index == 2)).sum() > 0.7 * (percept.zfc.supported & (index == 2)).sum()


@pytest.mark.parametrize("half_width", [0.003, 0.006])
def test_a_thin_post_keeps_its_evidence_in_front(half_width):
    post = upright([0.26, 0.05, 0.0], half_width, 0.08, noise_texture(3, (0.3, 0.3, 0.3)))
    percept, picture, index, _ = seen(post)
    surely = percept.zfc.supported & (percept.zfc.p_nearer > 0.95) & (index == 2)
    assert surely.sum() > 0.5 * (index == 2).sum()
    assert (answering_pixels(percept.zfc, picture) & surely).sum() > 0.95 * surely.sum()


def test_pixels_that_answer_are_right_more_often_than_those_with_evidence():
    percept, picture, _, relative = seen(*poster_scene().rectangles[2:])
    zfc, asked = percept.zfc, np.abs(relative - 1.0) > 0.1
    with np.errstate(invalid="ignore"):
        right = (zfc.inverse_depth > zfc.fixated_inverse_depth) == (relative < 1.0)
    answering = answering_pixels(zfc, picture)
    assert not (answering & ~zfc.supported).any()
    assert answering.sum() > 0.75 * zfc.supported.sum()
    wrong = [(asked & mask & ~right).sum() / (asked & mask).sum() for mask in (zfc.supported, answering)]
    assert wrong[1] < 0.7 * wrong[0]


def test_settings_say_how_strict_the_question_is():
    nearness = np.full((30, 40), 0.03)
    assert answering_pixels(evidence(nearness), GREY).all()
    assert not answering_pixels(evidence(nearness), GREY, AnswerSettings(decided_stds=2.0)).any()
