"""An upright body from its outlines: centre, size and kind of drawn bodies whose truth is known."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import look_at
from fixation_gym.perception.body.upright_body import (
    TANGENTS,
    BodySettings,
    UprightBody,
    _Planes,
    fit_upright_body,
    misfit,
    moved_body,
    outline_of,
    unknown_body,
)

CAMERA = Intrinsics.from_fovy(240, 320, np.radians(42.5))
TABLE = 0.1
UP = np.array([0.0, 0.0, 1.0])


def surface(kind, half_sizes, yaw, centre):
    """Points whose convex hull is the body, shape (n, 3), m."""
    angles = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    if kind == "box":
        points = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    elif kind == "cylinder":
        points = np.array([(np.cos(a), np.sin(a), z) for a in angles for z in (-1, 1)])
    else:
        latitudes = np.linspace(-np.pi / 2, np.pi / 2, 41)
        points = np.array(
            [(np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)) for a in angles for b in latitudes]
        )
    c, s = np.cos(yaw), np.sin(yaw)
    return centre + (points * half_sizes) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def mask_of(points, T_base_cam):
    """What the camera sees of the body, drawn to a sixteenth of a pixel, shape (240, 320)."""
    pixels = CAMERA.project((points - T_base_cam[:3, 3]) @ T_base_cam[:3, :3])
    hull = cv2.convexHull(pixels.astype(np.float32)).reshape(-1, 2)
    fine = np.zeros((240 * 8, 320 * 8), np.uint8)
    cv2.fillConvexPoly(fine, np.rint((hull + 0.5) * 8 - 0.5).astype(np.int32), 255)
    return np.asarray(cv2.resize(fine, (320, 240), interpolation=cv2.INTER_AREA)) > 127


def approach(target, count=14):
    """Camera poses of an approach that climbs from 45 to 72 degrees, as the servo's."""
    poses = []
    for share in np.linspace(0.0, 1.0, count):
        elevation, distance = np.radians(45.0 + 27.0 * share), 0.45 - 0.28 * share
        azimuth = 0.6 + 0.1 * np.sin(8.0 * share)
        direction = np.array(
            [np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)]
        )
        poses.append(look_at(target + distance * direction, target, UP))
    return poses


def fitted(points, centre, poses, guess_error=(0.01, -0.01, 0.01)) -> tuple[UprightBody, list]:
    outlines = [
        outline_of(mask_of(points, pose), CAMERA, pose, float(pose[:3, 2] @ (centre - pose[:3, 3]))) for pose in poses
    ]
    prior = unknown_body(centre + guess_error, BodySettings())
    return fit_upright_body(outlines, prior, TABLE, BodySettings()), outlines


BODIES = [
    ("box", (0.02, 0.02, 0.03), 0.4),
    ("box", (0.035, 0.025, 0.035), 1.2),
    ("cylinder", (0.03, 0.03, 0.04), 0.0),
    ("cylinder", (0.015, 0.015, 0.02), 0.0),
    ("ellipsoid", (0.03, 0.03, 0.03), 0.0),
    ("ellipsoid", (0.04, 0.03, 0.025), -0.7),
]


@pytest.mark.parametrize(("kind", "half_sizes", "yaw"), BODIES)
def test_centre_of_a_drawn_body_to_a_millimetre(kind, half_sizes, yaw):
    centre = np.array([0.5, -0.1, TABLE + half_sizes[2]])
    body, _ = fitted(surface(kind, half_sizes, yaw, centre), centre, approach(centre))
    assert np.linalg.norm(body.centre - centre) < 0.001
    assert body.half_sizes[2] == pytest.approx(half_sizes[2], abs=0.001)
    error = body.centre - centre
    assert error @ np.linalg.solve(body.centre_cov, error) < 11.3  # 99 % of chi-square with 3 degrees of freedom


def test_cut_outlines_do_not_draw_the_centre_away():
    half_sizes = (0.025, 0.025, 0.035)
    centre = np.array([0.5, -0.1, TABLE + half_sizes[2]])
    points, poses = surface("box", half_sizes, 0.3, centre), approach(centre)
    outlines = []
    for index, pose in enumerate(poses):
        mask = mask_of(points, pose)
        if index in (3, 4):  # something covers the left half
            mask[:, : int(np.flatnonzero(mask.any(axis=0)).mean())] = False
        outlines.append(outline_of(mask, CAMERA, pose, float(pose[:3, 2] @ (centre - pose[:3, 3]))))
    body = fit_upright_body(outlines, unknown_body(centre, BodySettings()), TABLE, BodySettings())
    assert np.linalg.norm(body.centre - centre) < 0.002
    assert np.abs(misfit(body, outlines[3], TABLE)).max() > 5.0
    assert np.abs(misfit(body, outlines[-1], TABLE)).max() < 1.5


def test_widths_of_a_box_along_its_sides_and_askew():
    half_sizes, yaw = (0.025, 0.02, 0.035), 0.4
    centre = np.array([0.5, -0.1, TABLE + half_sizes[2]])
    body, _ = fitted(surface("box", half_sizes, yaw, centre), centre, approach(centre))
    across = np.array([[np.cos(a), np.sin(a), 0.0] for a in (yaw, yaw + np.pi / 2, yaw + np.pi / 4)])
    truth = [0.050, 0.040, 2.0 * (0.025 + 0.020) / np.sqrt(2.0)]
    np.testing.assert_allclose(body.widths(across), truth, atol=0.003)


def test_depth_of_the_centre_with_its_standard_deviation():
    centre = np.array([0.5, -0.1, 0.13])
    pose = approach(centre)[-1]
    body = UprightBody(centre, np.diag([1e-6, 1e-6, 4e-6]), np.zeros(8))
    depth, std = body.depth(pose)
    axis = pose[:3, 2]
    assert depth == pytest.approx(np.linalg.norm(centre - pose[:3, 3]))
    assert std == pytest.approx(np.sqrt(1e-6 * (axis[0] ** 2 + axis[1] ** 2) + 4e-6 * axis[2] ** 2))


def test_one_look_finds_a_known_body_that_was_moved():
    settings, half_sizes, shift = BodySettings(), (0.025, 0.02, 0.035), np.array([0.05, -0.03, 0.0])
    centre = np.array([0.5, -0.1, TABLE + half_sizes[2]])
    body, _ = fitted(surface("box", half_sizes, 0.3, centre), centre, approach(centre))
    pose = approach(centre)[-4]
    mask = mask_of(surface("box", half_sizes, 0.5, centre + shift), pose)
    seen = outline_of(mask, CAMERA, pose, float(pose[:3, 2] @ (centre - pose[:3, 3])))
    prior = moved_body(body.parameters, centre + 0.8 * shift, settings)
    found = fit_upright_body([seen], prior, TABLE, settings)
    assert np.linalg.norm(found.centre - centre - shift) < 0.002


def test_tangents_at_the_image_border_are_left_out():
    pose = approach(np.array([0.5, -0.1, 0.13]))[0]
    mask = np.zeros((240, 320), np.bool_)
    mask[100:140, :50] = True
    outline = outline_of(mask, CAMERA, pose, 0.4)
    assert 0 < len(outline.normals) < TANGENTS
    to_the_left = (outline.normals @ pose[:3, :3])[:, 0] < -1e-9
    assert not to_the_left.any()


def test_jacobian_is_the_derivative_of_the_misfit():
    rng = np.random.default_rng(0)
    count = 40
    origin, depth, pixel = rng.normal(size=(count, 3)), rng.uniform(0.2, 0.5, count), np.full(count, 1 / 308)
    planes = _Planes(origin, rng.normal(size=(count, 3)), depth, pixel)
    for _ in range(10):
        sizes = np.log(rng.uniform(0.01, 0.05, 3))
        parameters = np.array([*rng.normal(size=2), rng.uniform(-2.0, 2.0), *sizes, *rng.uniform(-2.0, 2.0, 2)])
        steps = 1e-6 * np.eye(8)
        numeric = [planes.misfit(parameters + step, TABLE) - planes.misfit(parameters - step, TABLE) for step in steps]
        np.testing.assert_allclose(planes.jacobian(parameters), np.array(numeric).T / 2e-6, atol=1e-6)
