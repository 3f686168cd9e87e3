import cv2
import numpy as np
import pytest
from pinhole_scene import noise_texture

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.interaction import image_flow
from fixation_gym.geometry.rigid import inverse
from fixation_gym.geometry.twist import exp_twist
from fixation_gym.perception.flow import gradients
from fixation_gym.perception.flow.optic_flow import estimate_flow, flow_grid, invalid_flow, plane_homography

CAMERA = Intrinsics.from_fovy(120, 160, np.deg2rad(42.5))
TIMES = (0.0, 0.04, 0.08)
TEXTURE = noise_texture(7, size=512)[..., 0]


def seen_plane(T_cam_start, distance, camera=CAMERA, noise=2.0, seed=0, contrast=1.0):
    """Image of the plane Z = distance of the starting camera, after the camera moved; 3x supersampled."""
    fine = camera.scaled(3 * camera.height, 3 * camera.width)
    texture_camera = np.array([[700.0, 0, 256], [0, 700.0, 256], [0, 0, 1]]) @ np.diag([0.33, 0.33, 1])
    to_image = plane_homography(T_cam_start, 1 / distance, fine) @ fine.matrix @ np.linalg.inv(texture_camera)
    image = cv2.warpPerspective(TEXTURE, to_image, (fine.width, fine.height), borderMode=cv2.BORDER_WRAP)
    image = cv2.resize(image, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    image = 100.0 + contrast * (image - 100.0)
    return (image + noise * np.random.default_rng(seed).standard_normal(image.shape)).astype(np.float32)


def flow_of(twist, distance=0.5, noise=2.0, warp=None, seed=0, contrast=1.0, noise_share=1.0):
    """Flow estimated from three noisy frames and the true flow in px/s, both shape (h, w, 2)."""
    motions = [exp_twist(np.asarray(twist, float), t - TIMES[1]) for t in TIMES]
    frames = [
        seen_plane(inverse(motion), distance, noise=noise, seed=seed + i, contrast=contrast)
        for i, motion in enumerate(motions)
    ]
    maps = None
    if warp is not None:
        maps = tuple(plane_homography(inverse(motions[i]), warp, CAMERA) for i in (0, 2))
    flow = estimate_flow(frames, TIMES, CAMERA, maps, warp or 0.0, noise_share=noise_share)
    grid = flow.intrinsics
    truth = np.stack(image_flow(*grid.grid, 1 / distance, np.asarray(twist, float)), -1) * [grid.fx, grid.fy]
    return flow, truth


def test_filters_are_unit_so_a_ramp_has_slope_one_in_space_and_time():
    for prefilter, derivative in (
        (gradients.SPACE_PREFILTER, gradients.SPACE_DERIVATIVE),
        (gradients.TIME_PREFILTER, gradients.TIME_DERIVATIVE),
    ):
        ramp = np.arange(prefilter.size) - prefilter.size // 2 + 5.0
        assert prefilter @ ramp == pytest.approx(5.0, rel=1e-6)
        assert derivative @ ramp == pytest.approx(1.0, rel=1e-6)
        assert derivative @ np.ones(prefilter.size) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("speed_px", [0.1, 0.5, 1.0, 2.0, 4.0])
@pytest.mark.parametrize("direction", [0.0, 0.7, 1.6])
def test_the_gain_of_lateral_flow_is_one_within_a_few_percent(speed_px, direction):
    speed = speed_px * 0.5 / CAMERA.fx / 0.04
    flow, truth = flow_of([speed * np.cos(direction), speed * np.sin(direction), 0, 0, 0, 0])
    inside = flow.overlap
    gain = (flow.flow[inside] * truth[inside]).sum() / (truth[inside] ** 2).sum()
    assert gain == pytest.approx(1.0, abs=0.035 if speed_px <= 1 else 0.09)


def test_weak_texture_moves_as_much_as_it_does_once_the_noise_was_measured():
    """With more noise taken out of the gradients than there is, the weakest would seem to move twice as much."""
    first_gains = []
    for noise, contrast in ((2.0, 0.3), (1.0, 0.1), (0.3, 0.05)):
        share, gains = 1.0, []
        for seed in (0, 10):
            flow, truth = flow_of([0.06, 0.03, 0, 0, 0, 0], 0.5, noise, 1.4, seed, contrast, share)
            inside, beyond = flow.overlap, truth * (1.0 - 1.4 * 0.5)
            moved = np.moveaxis(flow.residual, 0, -1)[inside] / 0.04
            gains.append(float((moved * beyond[inside]).sum() / (beyond[inside] ** 2).sum()))
            share = flow.noise_share
        assert gains[1] == pytest.approx(1.0, abs=0.12)
        assert 0.3 < share / (noise / 2.0) ** 2 < 1.0  # of windows with little noise, and interpolation smooths it
        first_gains.append(gains[0])
    assert first_gains[2] > 1.8


def test_the_flow_of_a_general_motion_is_right_with_and_without_a_warp():
    twist = [0.02, -0.03, 0.1, 0.1, 0.05, 0.2]
    for warp in (None, 0.0, 1.6, 2.0):
        flow, truth = flow_of(twist, warp=warp)
        error = np.linalg.norm((flow.flow - truth)[flow.overlap], axis=-1) * 0.04
        assert np.median(error) < 0.05  # px per frame


def test_a_warp_makes_fast_rotation_harmless():
    twist = [0.01, 0, 0, 0.0, 1.2, 0]  # 7.5 px per frame
    flow, truth = flow_of(twist, warp=0.0)
    error = np.linalg.norm((flow.flow - truth)[flow.overlap], axis=-1) * 0.04
    assert flow.overlap.mean() > 0.6
    assert np.median(error) < 0.05


def test_the_covariance_is_consistent_with_the_errors():
    nees = []
    for seed in range(4):
        flow, truth = flow_of([0.01, 0.02, 0.02, 0.01, 0, 0], seed=10 * seed, warp=1.9)
        error = (flow.flow - truth)[flow.overlap]
        xx, xy, yy = np.moveaxis(flow.cov[flow.overlap], -1, 0)
        x, y = error.T
        nees.append(((yy * x**2 - 2 * xy * x * y + xx * y**2) / (xx * yy - xy**2)).mean())
    assert 0.5 < np.mean(nees) < 3.0  # 2 degrees of freedom


def test_a_plain_image_has_no_flow_but_a_huge_covariance():
    noise = np.random.default_rng(0)
    frames = [np.full((120, 160), 100, np.float32) + noise.normal(0, 2, (120, 160)).astype(np.float32) for _ in TIMES]
    flow = estimate_flow(frames, TIMES, CAMERA)
    assert np.isfinite(flow.flow[flow.overlap]).all()
    assert np.sqrt(np.median(flow.residual_cov[0])) > 0.25  # px


def test_the_first_frames_have_no_flow_rather_than_zero_flow():
    flow = invalid_flow(0.3, CAMERA)
    grid = flow_grid(CAMERA)
    assert not flow.valid
    assert flow.flow.shape == (grid.height, grid.width, 2)
    assert np.isnan(flow.flow).all()
    assert np.isnan(flow.cov).all()


def test_the_plane_homography_moves_points_of_the_plane_like_the_projection():
    T_other_centre = inverse(exp_twist(np.array([0.1, -0.05, 0.08, 0.1, 0.2, -0.3]), 1.0))
    point = np.array([0.05, -0.03, 0.5])
    mapped = plane_homography(T_other_centre, 2.0, CAMERA) @ [*CAMERA.project(point), 1.0]
    expected = CAMERA.project(T_other_centre[:3, :3] @ point + T_other_centre[:3, 3])
    np.testing.assert_allclose(mapped[:2] / mapped[2], expected)


def test_a_weak_edge_never_makes_the_information_indefinite():
    columns = np.arange(160, dtype=np.float32)
    stripes = np.tile(100 + 3 * np.sin(0.5 * columns), (120, 1))  # 1-D texture, hardly above the noise
    rng = np.random.default_rng(1)
    turned = cv2.warpAffine(stripes, cv2.getRotationMatrix2D((80, 60), 30, 1.5), (160, 120), borderMode=cv2.BORDER_WRAP)
    frames = [(turned + rng.normal(0, 2, turned.shape)).astype(np.float32) for _ in TIMES]
    flow = estimate_flow(frames, TIMES, CAMERA)
    xx, xy, yy = flow.information
    assert (xx * yy - xy**2 > 0).all()
    # Where nothing moves, what is stated must cover what is found.
    nis = np.square(flow.residual[0]) / flow.residual_cov[0]
    assert np.mean(nis[flow.overlap] > 15) < 0.02


def test_shading_that_stays_while_a_weak_texture_moves_through_it_hardly_changes_the_flow():
    x, y = CAMERA.grid
    highlight = 60 * np.exp(-(x**2 + y**2) / 0.06)
    motions = [exp_twist(np.array([0.02, 0, 0, 0, 0, 0]), t - TIMES[1]) for t in TIMES]
    frames = [
        (0.3 * seen_plane(inverse(motion), 0.5, noise=2.0, seed=i) + highlight).astype(np.float32)
        for i, motion in enumerate(motions)
    ]
    flow = estimate_flow(frames, TIMES, CAMERA)
    grid = flow.intrinsics
    truth = image_flow(*grid.grid, 2.0, np.array([0.02, 0, 0, 0, 0, 0]))[0] * grid.fx
    gain = flow.flow[flow.overlap][:, 0] / truth[flow.overlap]
    assert np.median(gain) == pytest.approx(1.0, abs=0.06)


def test_a_strong_edge_does_not_move_weak_texture_farther_away_than_the_window():
    rng = np.random.default_rng(2)
    texture = cv2.GaussianBlur(rng.normal(0, 30, (120, 160)).astype(np.float32), (0, 0), 1.5) + 100
    frames = []
    for k in (-1, 0, 1):
        frame = texture + rng.normal(0, 0.5, texture.shape).astype(np.float32)
        frame[:, : 60 + k] = 10  # a dark plain thing moves by 1 px over a resting texture
        frames.append(frame.astype(np.float32))
    flow = estimate_flow(frames, TIMES, CAMERA)
    column = 30 + 5  # window of 5 px of the grid and filters of 5 px of the frame
    rest = flow.residual[0][10:-10, column : column + 4]
    assert np.abs(np.median(rest)) < 0.03
