import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from fixation_gym.geometry.rigid import (
    cross,
    inverse,
    look_at,
    matrix_to_pose,
    pose_to_matrix,
    rotation_vector,
    transform,
)
from fixation_gym.geometry.twist import adjoint, crosses, exp_twist, mean_twist, skew, skews

RNG = np.random.default_rng(1)


def random_pose():
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.random(rng=RNG).as_matrix()
    matrix[:3, 3] = RNG.normal(size=3)
    return matrix


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-7, 1e-6, 2e-6, 1e-4, 0.01, 0.3, 2.0, 3.1, 7.0])
@pytest.mark.parametrize("duration", [1.0, -0.04])
def test_exp_twist_is_the_matrix_exponential(angle, duration):
    axis, v = np.random.default_rng(2).normal(size=(2, 3))
    w = angle * axis / np.linalg.norm(axis) / duration
    generator = np.zeros((4, 4))
    generator[:3, :3], generator[:3, 3] = skew(w), v
    np.testing.assert_allclose(exp_twist(np.array([*v, *w]), duration), expm(generator * duration), rtol=0, atol=5e-14)


@pytest.mark.parametrize("size", [1e-9, 1e-5, 1e-3, 0.1, 2.9])
def test_mean_twist_inverts_exp_twist(size):
    direction = RNG.normal(size=3)
    twist = np.array([*RNG.normal(size=3), *(size * direction / np.linalg.norm(direction))])
    start = random_pose()
    recovered = mean_twist(start, start @ exp_twist(twist, 1.0), 1.0)
    np.testing.assert_allclose(recovered, twist, atol=1e-7)


def test_mean_twist_is_the_rate_of_the_motion():
    twist = np.array([0.1, -0.2, 0.3, 0.4, 0.5, -0.6])
    np.testing.assert_allclose(mean_twist(np.eye(4), exp_twist(twist, 0.08), 0.08), twist, atol=1e-12)


@pytest.mark.parametrize("duration", [0.0, -0.04])
def test_mean_twist_refuses_a_duration_that_is_not_positive(duration):
    with pytest.raises(ValueError, match="positive"):
        mean_twist(np.eye(4), np.eye(4), duration)


def test_the_adjoint_moves_a_twist_to_another_frame():
    T_a_b, twist = random_pose(), RNG.normal(size=6)
    moved = T_a_b @ exp_twist(twist, 1.0) @ inverse(T_a_b)
    np.testing.assert_allclose(moved, exp_twist(adjoint(T_a_b) @ twist, 1.0), atol=1e-9)


def test_skew_and_cross_are_the_cross_product():
    many_a, many_b = RNG.normal(size=(2, 20, 3))
    np.testing.assert_array_equal(crosses(many_a, many_b), np.cross(many_a, many_b))
    np.testing.assert_array_equal(skews(many_a), [skew(a) for a in many_a])
    for a, b in zip(many_a, many_b, strict=True):
        np.testing.assert_allclose(skew(a) @ b, np.cross(a, b))
        np.testing.assert_array_equal(cross(a, b), np.cross(a, b))


def test_inverse_undoes_a_transform():
    pose, points = random_pose(), RNG.normal(size=(4, 5, 3))
    np.testing.assert_allclose(transform(inverse(pose), transform(pose, points)), points, atol=1e-12)


def test_pose_vectors_and_matrices_are_the_same_thing():
    pose = random_pose()
    vector = matrix_to_pose(pose)
    assert vector[3] >= 0
    np.testing.assert_allclose(pose_to_matrix(vector), pose, atol=1e-12)
    np.testing.assert_allclose(
        pose_to_matrix([0, 0, 0, np.sqrt(0.5), 0, 0, np.sqrt(0.5)])[:3, 0], [0, 1, 0], atol=1e-12
    )


def test_look_at_puts_the_target_on_the_optical_axis_with_up_at_the_top():
    pose = look_at(np.array([1.0, 2.0, 3.0]), np.array([2.0, 2.5, 1.0]), np.array([0.0, 0.0, 1.0]))
    in_camera = transform(inverse(pose), np.array([2.0, 2.5, 1.0]))
    np.testing.assert_allclose(in_camera[:2], 0, atol=1e-12)
    assert in_camera[2] > 0
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    assert pose[2, 1] < 0  # image y points down


def test_look_at_refuses_a_line_of_sight_along_up():
    with pytest.raises(ValueError, match="parallel"):
        look_at(np.zeros(3), np.array([0.0, 0.0, 2.0]), np.array([0.0, 0.0, 1.0]))


@pytest.mark.parametrize("angle", [0.0, 1e-14, 1e-9, 1e-4, 0.3, 1.5, 2.5, 3.1, np.pi - 1e-7, np.pi])
@pytest.mark.parametrize("seed", range(5))
def test_the_rotation_vector_is_the_one_of_scipy(angle, seed):
    axis = np.random.default_rng(seed).normal(size=3) * np.array([1.0, 10.0 * (seed == 1) + 1, 10.0 * (seed == 2) + 1])
    rotation = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix()
    ours = rotation_vector(rotation)
    np.testing.assert_allclose(np.linalg.norm(ours), angle, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(Rotation.from_rotvec(ours).as_matrix(), rotation, atol=1e-12)
    if angle < np.pi - 1e-9:  # at pi both signs are right
        np.testing.assert_allclose(ours, Rotation.from_matrix(rotation).as_rotvec(), rtol=1e-7, atol=1e-12)


def test_a_zero_quaternion_is_refused():
    with pytest.raises(ValueError, match="quaternion"):
        pose_to_matrix(np.zeros(7))
