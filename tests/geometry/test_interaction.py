import numpy as np
import pytest

from fixation_gym.geometry.interaction import (
    epipolar_direction,
    fixation_coupling,
    image_flow,
    interaction_matrix,
    inverse_depth_rate,
)
from fixation_gym.geometry.rigid import inverse, transform
from fixation_gym.geometry.twist import exp_twist

POINTS = [(0.0, 0.0, 2.0), (0.3, -0.2, 4.0), (-0.5, 0.4, 0.7)]
TWIST = np.array([0.2, -0.1, 0.3, 0.4, -0.5, 0.6])


def seen_after(x, y, d, twist, dt):
    """Image point and inverse depth of a static point after the camera moved."""
    point = transform(inverse(exp_twist(twist, dt)), np.array([x, y, 1.0]) / d)
    return point[:2] / point[2], 1 / point[2]


@pytest.mark.parametrize("point", POINTS)
def test_the_interaction_matrix_is_the_derivative_of_the_projection(point):
    x, y, d = point
    for axis in range(6):
        unit, step = np.eye(6)[axis], 1e-6
        numeric = (seen_after(x, y, d, unit, step)[0] - seen_after(x, y, d, unit, -step)[0]) / (2 * step)
        np.testing.assert_allclose(interaction_matrix(x, y, d)[:, axis], numeric, atol=1e-8)


@pytest.mark.parametrize("point", POINTS)
def test_image_flow_is_the_interaction_matrix_times_the_twist(point):
    x, y, d = point
    flow = image_flow(np.array(x), np.array(y), d, TWIST)
    np.testing.assert_allclose(flow, interaction_matrix(x, y, d) @ TWIST, atol=1e-12)


@pytest.mark.parametrize("point", POINTS)
def test_the_epipolar_direction_is_the_flow_per_inverse_depth(point):
    x, y, d = (np.array(value) for value in point)
    nearer, farther = (np.array(image_flow(x, y, d + step, TWIST)) for step in (0.5, -0.5))
    np.testing.assert_allclose(nearer - farther, epipolar_direction(x, y, TWIST[:3]), atol=1e-12)


@pytest.mark.parametrize("point", POINTS)
def test_the_inverse_depth_rate_is_its_derivative_along_the_motion(point):
    step = 1e-6
    numeric = (seen_after(*point, TWIST, step)[1] - seen_after(*point, TWIST, -step)[1]) / (2 * step)
    assert inverse_depth_rate(*point, TWIST) == pytest.approx(numeric, abs=1e-7)


def test_the_corrected_coupling_holds_the_fixated_point_still_and_the_printed_signs_do_not():
    v, d_f = np.array([0.05, -0.03, 0.1]), 2.5
    w = fixation_coupling(v, d_f)
    zero = np.zeros(1)
    held = image_flow(zero, zero, d_f, np.array([*v, *w, 0.7]))
    printed = image_flow(zero, zero, d_f, np.array([*v, *-w, 0.7]))
    np.testing.assert_allclose(held, 0, atol=1e-15)
    np.testing.assert_allclose(np.ravel(printed), -2 * d_f * v[:2], atol=1e-12)


def test_under_fixation_nearer_and_farther_points_move_in_opposite_directions():
    v, d_f, zero = np.array([0.05, 0.02, 0.0]), 2.0, np.zeros(1)
    twist = np.array([*v, *fixation_coupling(v, d_f), 0.0])
    nearer, farther = (np.ravel(image_flow(zero, zero, d, twist)) for d in (3.0, 1.0))
    assert nearer @ v[:2] < 0 < farther @ v[:2]
