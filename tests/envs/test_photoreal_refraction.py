"""How images in glass move when the camera does: where a moving observer believes that they are."""

import numpy as np
import pytest
from test_photoreal_optics import FOCAL, L, picture

from fixation_gym.envs.photoreal import meshes
from fixation_gym.envs.photoreal.materials import GLASS, WATER, Material
from fixation_gym.envs.photoreal.solids import vessel

BALL_M, BOTTLE_M, WALL_M = 0.045, 0.036, 0.0025
STEP_M = 0.005
SIDEWAYS, UPWARDS = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])


def place_of_bright(image, reach_px):
    """Mean row and column of the light around the brightest pixel, to a part of a pixel."""
    brightest = np.unravel_index(image.argmax(), image.shape)
    indices = np.indices(image.shape)
    near = np.all([np.abs(axis - at) <= reach_px for axis, at in zip(indices, brightest, strict=True)], axis=0)
    light = np.where(near, image, 0.0)
    return np.array([np.sum(axis * light) for axis in indices]) / light.sum()


def believed_depth(pieces, behind, direction, reach_px=6):
    """Depth of a dot's image by triangulation from both sides of the axis; the dot is so far behind the origin."""
    dot = np.array([behind, 0.0, 0.0])
    places = []
    for sign in (-1.0, 1.0):  # in place of the camera, everything else moves
        shift = -sign * STEP_M * direction
        moved = [(mesh.placed(np.eye(3), shift), material) for mesh, material in pieces]
        places.append(place_of_bright(picture(moved, dot + shift), reach_px))
    motion = places[1] - places[0]  # rows go down, columns to the right: against z and y
    return 2.0 * STEP_M * FOCAL / float(motion[0] if direction is UPWARDS else motion[1])


def lens_image(focal, behind):
    """How far before a thin lens the image of something behind it is, m; negative: behind it."""
    return 1.0 / (1.0 / focal - 1.0 / behind)


def ball():
    return [(meshes.ellipsoid(np.full(3, BALL_M)), Material("glass"))]


def bottle(level):
    return vessel(BOTTLE_M, 0.075, Material("glass"), is_open=False, level=level)


def test_in_the_open_the_dot_is_where_it_is():
    assert believed_depth([], 0.15, SIDEWAYS) == pytest.approx(L + 0.15, rel=0.02)
    assert believed_depth([], 0.15, UPWARDS) == pytest.approx(L + 0.15, rel=0.02)


@pytest.mark.parametrize("direction", [SIDEWAYS, UPWARDS], ids=["sideways", "upwards"])
def test_what_is_behind_a_ball_seems_to_be_before_it(direction):
    focal = GLASS * BALL_M / (2.0 * (GLASS - 1.0))  # of a ball, from its centre
    expected = L - lens_image(focal, 0.25)
    assert expected < L - BALL_M  # nearer than the ball's surface
    assert believed_depth(ball(), 0.25, direction) == pytest.approx(expected, rel=0.05)


def test_what_touches_a_ball_from_behind_seems_to_be_farther():
    focal = GLASS * BALL_M / (2.0 * (GLASS - 1.0))
    expected = L - lens_image(focal, 0.047)
    assert expected > L + 0.1
    assert believed_depth(ball(), 0.047, SIDEWAYS, reach_px=12) == pytest.approx(expected, rel=0.1)


def test_bottle_of_water_is_a_lens_sideways_alone():
    inner = BOTTLE_M - WALL_M
    focal = 1.0 / (2.0 * ((GLASS - 1.0) / (GLASS * BOTTLE_M) - (GLASS - WATER) / (GLASS * WATER * inner)))
    sideways, upwards = (believed_depth(bottle(0.7), 0.25, direction) for direction in (SIDEWAYS, UPWARDS))
    assert sideways == pytest.approx(L - lens_image(focal, 0.25), rel=0.05)
    assert sideways < L
    assert L + 0.2 < upwards < L + 0.25  # water brings it a little nearer


def test_empty_bottle_and_slab_leave_what_is_behind_nearly_where_it_is():
    slab = [(meshes.box(np.array([0.015, 0.08, 0.08])), Material("glass"))]
    assert believed_depth(slab, 0.15, SIDEWAYS) == pytest.approx(L + 0.15 - 0.03 * (1.0 - 1.0 / GLASS), rel=0.03)
    assert L + 0.1 < believed_depth(bottle(0.0), 0.15, SIDEWAYS) < L + 0.16
