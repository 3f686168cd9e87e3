import numpy as np
import pytest

from fixation_gym.geometry.camera import Intrinsics


def test_the_principal_point_is_the_image_centre_with_pixel_zero_at_the_top_left_pixel_centre():
    camera = Intrinsics.from_fovy(240, 320, np.deg2rad(42.5))
    assert (camera.cx, camera.cy) == (159.5, 119.5)
    np.testing.assert_allclose(camera.project(np.array([0.0, 0.0, 2.0])), [159.5, 119.5])


def test_the_vertical_field_of_view_spans_the_image_edges():
    camera = Intrinsics.from_fovy(240, 320, np.deg2rad(42.5))
    top = camera.normalise(np.array([159.5, -0.5]))
    bottom = camera.normalise(np.array([159.5, 239.5]))
    assert np.arctan(bottom[1]) - np.arctan(top[1]) == pytest.approx(np.deg2rad(42.5))


def test_normalise_inverts_project():
    camera = Intrinsics(100, 80, 90.0, 95.0, 48.0, 41.0)
    points = np.random.default_rng(0).uniform([-1, -1, 0.5], [1, 1, 3], (20, 3))
    np.testing.assert_allclose(camera.normalise(camera.project(points)), points[:, :2] / points[:, 2:], atol=1e-12)


def test_points_behind_the_camera_have_no_pixel():
    camera = Intrinsics.from_fovy(80, 100, 1.0)
    assert np.isnan(camera.project(np.array([[0.1, 0.1, -1.0], [0.1, 0.1, 0.0]]))).all()


def test_the_grid_is_the_normalised_position_of_every_pixel():
    camera = Intrinsics(7, 5, 9.0, 8.0, 3.2, 1.9)
    x, y = camera.grid
    assert x.shape == y.shape == (5, 7)
    np.testing.assert_allclose([x[4, 6], y[4, 6]], camera.normalise(np.array([6.0, 4.0])))


def test_scaling_keeps_rays_through_image_corners():
    camera = Intrinsics(320, 240, 300.0, 310.0, 150.0, 125.0)
    half = camera.scaled(120, 160)
    np.testing.assert_allclose(half.normalise(np.array([-0.5, -0.5])), camera.normalise(np.array([-0.5, -0.5])))
    np.testing.assert_allclose(half.normalise(np.array([159.5, 119.5])), camera.normalise(np.array([319.5, 239.5])))


@pytest.mark.parametrize("values", [(0, 5, 1.0, 1.0), (5, -1, 1.0, 1.0), (5, 5, 0.0, 1.0), (5, 5, 1.0, float("nan"))])
def test_impossible_intrinsics_are_refused(values):
    with pytest.raises(ValueError, match="must be positive"):
        Intrinsics(*values, 2.0, 2.0)
