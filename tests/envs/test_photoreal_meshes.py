"""Triangles of the photoreal renderer: closed, of the right size, with normals that point out of what they enclose."""

import math

import numpy as np
import pytest

from fixation_gym.envs.photoreal import meshes
from fixation_gym.envs.photoreal.materials import linear, srgb

HALF = np.array([0.02, 0.03, 0.05])


def volume(mesh):
    """What the surface encloses: positive if its faces run counter-clockwise, seen from outside."""
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return float(np.sum(a * np.cross(b, c)) / 6.0)


@pytest.mark.parametrize(
    ("mesh", "expected"),
    [
        (meshes.box(HALF), 8.0 * HALF.prod()),
        (meshes.cylinder(0.03, 0.05), math.pi * 0.03**2 * 0.1),
        (meshes.ellipsoid(HALF), 4.0 / 3.0 * math.pi * HALF.prod()),
    ],
)
def test_meshes_enclose_the_volume_of_what_they_stand_for(mesh, expected):
    assert volume(mesh) == pytest.approx(expected, rel=0.01)
    assert volume(mesh.turned_inside_out()) == pytest.approx(-expected, rel=0.01)


@pytest.mark.parametrize("mesh", [meshes.box(HALF), meshes.cylinder(0.03, 0.05), meshes.ellipsoid(HALF)])
def test_normals_have_unit_length_and_agree_with_the_faces(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    flat = np.cross(b - a, c - a)
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0)
    for corner in range(3):
        assert np.sum(flat * mesh.normals[mesh.faces[:, corner]], axis=1).min() > 0.9


def test_round_outlines_stay_within_a_twentieth_of_a_millimetre():
    mesh = meshes.cylinder(0.04, 0.05)
    middles = mesh.vertices[mesh.faces[:, :2]].mean(axis=1)
    rim = middles[np.abs(np.linalg.norm(mesh.vertices[mesh.faces[:, 0], :2], axis=1) - 0.04) < 1e-9]
    off = 0.04 - np.linalg.norm(rim[np.linalg.norm(rim[:, :2], axis=1) > 0.03][:, :2], axis=1)
    assert 0.0 < off.max() < 5e-5


def test_placed_mesh_moves_rigidly():
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    mesh = meshes.box(HALF)
    placed = mesh.placed(quarter, np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(placed.vertices[0], quarter @ mesh.vertices[0] + [1.0, 2.0, 3.0])
    np.testing.assert_allclose(placed.normals[0], quarter @ mesh.normals[0])
    assert volume(placed) == pytest.approx(volume(mesh))


def test_linear_intensities_and_srgb_are_inverse():
    values = np.linspace(0.0, 1.0, 256)
    np.testing.assert_allclose(srgb(linear(values)), values, atol=1e-6)
    assert srgb(np.array([0.214]))[0] == pytest.approx(0.5, abs=0.001)
    np.testing.assert_allclose(srgb(np.array([-1.0, 7.0])), [0.0, 1.0])
