"""Materials against optics: where the image of a bright dot appears through glass and in mirrors, within half a pixel.

The camera is at (-L, 0, 0) and looks along +x, y to its left. What is round stands in the origin, its axis along z, so
that everything happens in one plane.
"""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from fixation_gym.envs.photoreal import build, engine, meshes
from fixation_gym.envs.photoreal.materials import GLASS, WATER, Material
from fixation_gym.envs.photoreal.solids import vessel

pytest.importorskip("mitsuba")
pytest.importorskip("pyoidn")
L, SIZE, FOV = 0.5, 96, math.radians(16.0)
FOCAL = 0.5 * SIZE / math.tan(0.5 * FOV)
CENTRE = 0.5 * (SIZE - 1)
DOT_RADIUS = 0.0015


def about_z(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def picture(pieces, dot):
    """Intensities of a dark scene with a luminous dot, shape (h, w); pieces are meshes in world with materials."""
    mitsuba = engine.load()
    pose = np.eye(4)
    pose[:3, :3], pose[0, 3] = np.array([(0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)]).T, -L
    shapes = {
        f"piece{index}": build.shape(mitsuba, mesh, build.material(mitsuba, material, None))
        for index, (mesh, material) in enumerate(pieces)
    }
    light = {"type": "area", "radiance": {"type": "rgb", "value": [1.0] * 3}}
    shapes["dot"] = {"type": "sphere", "center": list(dot), "radius": DOT_RADIUS, "emitter": light}
    integrator = {"type": "path", "max_depth": 16, "rr_depth": 16}
    sensor = build.camera(mitsuba, pose, FOV, (SIZE, SIZE), 64)
    scene = mitsuba.load_dict({"type": "scene", "integrator": integrator, "sensor": sensor, **shapes})
    return np.array(mitsuba.render(scene, seed=0)).mean(axis=-1)


def column_of_dot(image):
    """Mean column of what is at least half as bright as the brightest pixel; it is at the height of the camera."""
    bright = np.where(image > 0.5 * image.max(), image, 0.0)
    rows, columns = np.indices(image.shape)
    assert np.sum(rows * bright) / bright.sum() == pytest.approx(CENTRE, abs=0.5)
    return np.sum(columns * bright) / bright.sum()


def column_at(angle):
    """Column that shows the direction at an angle to the left of the optical axis, rad."""
    return CENTRE - FOCAL * math.tan(angle)


def cross(p, q):
    return p[0] * q[1] - p[1] * q[0]


def unit(angle):
    return np.array([math.cos(angle), math.sin(angle)])


def angle_through_layers(layers, dot):
    """Angle of the ray to the dot through concentric round layers of (radius, index), from the outside inwards.

    n r sin(angle to the radius) stays the same along a ray (Snell, Bouguer).
    """

    def miss(angle):
        impact, before, turned = L * math.sin(angle), 1.0, 0.0
        for radius, index in layers:
            turned += 2.0 * (math.asin(impact / (before * radius)) - math.asin(impact / (index * radius)))
            before = index
        return cross(dot, unit(angle - turned)) + impact

    return brentq(miss, -0.03, 0.03)


def angle_by_round_mirror(radius, dot):
    """Angle of the ray that a round mirror throws to the dot."""

    def miss(angle):
        ray, eye = unit(angle), np.array([-L, 0.0])
        along = -eye @ ray
        hit = eye + (along - math.sqrt(radius**2 - (eye @ eye - along**2))) * ray
        normal = hit / radius
        return cross(dot - hit, ray - 2.0 * (ray @ normal) * normal)

    return brentq(miss, 0.0, 0.055)


def test_dot_in_the_open_is_where_the_pinhole_camera_puts_it():
    dot = np.array([0.1, 0.03])
    assert column_of_dot(picture([], (*dot, 0.0))) == pytest.approx(column_at(math.atan2(dot[1], L + dot[0])), abs=0.2)


@pytest.mark.parametrize("turn", [0.0, 0.5, -0.8])
def test_thick_slab_shifts_the_dot_as_snell_says(turn):
    thickness, dot = 0.03, np.array([0.15, 0.01])

    def miss(angle):
        incidence = angle - turn  # to the slab's normal
        inside = math.asin(math.sin(incidence) / GLASS)
        shift = thickness * math.sin(incidence - inside) / math.cos(inside)  # of the parallel ray behind it, rightwards
        return cross((dot[0] + L, dot[1]), unit(angle)) - shift

    slab = meshes.box(np.array([0.5 * thickness, 0.08, 0.08])).placed(about_z(turn), np.zeros(3))
    found = column_of_dot(picture([(slab, Material("glass"))], (*dot, 0.0)))
    expected = column_at(brentq(miss, -0.1, 0.1))
    assert found == pytest.approx(expected, abs=0.5)
    if turn:  # by four times the tolerance and more
        assert abs(expected - column_at(math.atan2(dot[1], L + dot[0]))) > 2.0


def test_ball_turns_the_picture_around_as_a_thick_lens():
    dot = np.array([0.25, 0.02])
    angle = angle_through_layers([(0.045, GLASS)], dot)
    assert angle < -0.01  # on the other side
    found = column_of_dot(picture([(meshes.ellipsoid(np.full(3, 0.045)), Material("glass"))], (*dot, 0.0)))
    assert found == pytest.approx(column_at(angle), abs=0.5)


@pytest.mark.parametrize("level", [0.0, 0.7])
def test_bottle_bends_rays_by_its_walls_alone_or_by_the_water_in_it(level):
    dot = np.array([0.25, 0.01])
    layers = [(0.036, GLASS), (0.0335, WATER if level else 1.0)]
    angle = angle_through_layers(layers, dot)
    assert (angle < -0.005) == bool(level)  # water makes a lens of it
    for is_open in (True, False):
        found = column_of_dot(
            picture(vessel(0.036, 0.075, Material("glass"), is_open=is_open, level=level), (*dot, 0.0))
        )
        assert found == pytest.approx(column_at(angle), abs=0.5)


@pytest.mark.parametrize("finish", ["mirror", "chrome", "lacquer"])
def test_flat_mirror_shows_the_dot_as_far_behind_it(finish):
    turn, dot = math.radians(140.0), np.array([-0.05, 0.3])
    normal = unit(turn)
    image = dot - 2.0 * (dot @ normal) * normal
    upright = about_z(turn) @ np.array([(0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)])  # its +z along the normal
    face = meshes.box(np.array([0.08, 0.08, 0.0]), meshes.TOP).placed(upright, np.zeros(3))
    found = column_of_dot(picture([(face, Material(finish, (0.0, 0.0, 0.0)))], (*dot, 0.0)))
    assert found == pytest.approx(column_at(math.atan2(image[1], L + image[0])), abs=0.5)


def test_chrome_cylinder_shows_the_dot_where_a_convex_mirror_does():
    dot = np.array([-0.2, 0.15])
    found = column_of_dot(picture([(meshes.cylinder(0.03, 0.1), Material("chrome"))], (*dot, 0.0)))
    assert found == pytest.approx(column_at(angle_by_round_mirror(0.03, dot)), abs=0.5)


def test_thin_plastic_lets_light_through_but_no_picture():
    sheet = meshes.box(np.array([0.003, 0.08, 0.08]))
    clear = picture([(sheet, Material("glass"))], (0.05, 0.0, 0.0))
    cloudy = picture([(sheet, Material("plastic"))], (0.05, 0.0, 0.0))
    assert cloudy.max() < 0.05 * clear.max()
    assert 0.2 < cloudy.sum() / clear.sum() < 1.0


def test_normals_are_those_of_the_smooth_surface_after_a_move_too():
    mitsuba, mesh = engine.load(), meshes.cylinder(0.03, 0.1)
    shape = build.shape(mitsuba, mesh, build.material(mitsuba, Material("chrome"), None))
    parameters = mitsuba.traverse(shape)
    moved = mesh.placed(about_z(0.7), np.array([0.1, 0.2, 0.3]))
    for expected in (mesh, moved):
        build.move(parameters, {"": expected})
        found = np.array(parameters["vertex_normals"]).reshape(-1, 3)
        np.testing.assert_allclose(found, expected.normals, atol=1e-6)
