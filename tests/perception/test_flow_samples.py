"""Flow samples on the outline of a target that moves by a known amount."""

import cv2
import numpy as np
import pytest

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.distance.flow_samples import FLOW_NAMES, SAMPLE_COUNT, CutOut, sample_flow

CAMERA = Intrinsics.from_fovy(480, 640, np.radians(42.5))
DT = 0.04


def cut_out(k, shift, centre=(150.0, 120.0), radius=40.0, times=(0.0, DT, 2 * DT)):
    """Disc that moves by ``shift`` px per frame, near a corner of the image and far from the principal point."""
    height, width, scale = 220, 260, 4
    canvas = np.full((height * scale, width * scale), 220, np.uint8)
    place = [round(scale * (c + (k - 1) * s) * 16) for c, s in zip(centre, shift, strict=True)]
    cv2.circle(canvas, place, round(scale * radius * 16), 60, -1, cv2.LINE_AA, 4)
    grey = np.asarray(cv2.resize(canvas, (width, height), interpolation=cv2.INTER_AREA), np.uint8)
    return CutOut(times[k], grey, (10, 20), grey < 140, np.eye(4))


def frames(shift, **options):
    return tuple(cut_out(k, shift, **options) for k in range(3))


def sample(triple, seed=0):
    return sample_flow(triple, CAMERA, 0.0, np.random.default_rng(seed))


@pytest.mark.parametrize("name", FLOW_NAMES)
@pytest.mark.parametrize("shift", [(0.6, 0.0), (0.4, -0.5)])
def test_a_known_motion_is_measured_on_average(name, shift):
    samples = sample(frames(shift))[name]
    assert samples.flow.shape == samples.points.shape == (SAMPLE_COUNT, 2)
    weight = np.linalg.inv(samples.cov)
    flow = np.linalg.solve(weight.sum(0), (weight @ samples.flow[..., None]).sum(0)[:, 0])
    np.testing.assert_allclose(flow * DT * CAMERA.fx, shift, atol=0.15)


def test_points_lie_on_the_outline():
    for name, samples in sample(frames((0.5, 0.0))).items():
        pixels = samples.points * CAMERA.fx + [CAMERA.cx, CAMERA.cy]
        radius = np.linalg.norm(pixels - [160.0 - 0.5, 140.0 - 0.5], axis=1)
        assert np.all(np.abs(radius - 40.0) < 4.0), name


def test_a_fast_motion_needs_pyramid_or_prediction():
    shift = (14.0, 0.0)
    plane = 1.0
    pose = np.eye(4)
    triple = []
    for k in range(3):
        moved = pose.copy()
        moved[0, 3] = -(k - 1) * shift[0] / (CAMERA.fx * plane)
        part = cut_out(k, shift)
        triple.append(CutOut(part.time, part.grey, part.corner, part.mask, moved))
    found = sample_flow(tuple(triple), CAMERA, plane, np.random.default_rng(0))
    errors = {}
    for name, samples in found.items():
        weight = np.linalg.inv(samples.cov)
        flow = np.linalg.solve(weight.sum(0), (weight @ samples.flow[..., None]).sum(0)[:, 0])
        errors[name] = np.linalg.norm(flow * DT * CAMERA.fx - shift)
    assert errors["warped"] < 0.2
    assert errors["gradient"] > 2.0


def test_covariances_are_positive_and_wide_along_the_edge():
    samples = sample(frames((0.5, 0.0)))["warped"]
    variances, axes = np.linalg.eigh(samples.cov)
    assert variances.min() > 0
    middle = (np.array([160.0, 140.0]) - [CAMERA.cx, CAMERA.cy]) / CAMERA.fx
    out = samples.points - middle
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    along = np.abs(np.einsum("ni,ni->n", axes[:, :, 1], out))
    assert np.median(along) < 0.3


def test_without_target_or_in_order_there_is_no_flow():
    triple = frames((0.5, 0.0))
    empty = CutOut(DT, triple[1].grey, (10, 20), np.zeros_like(triple[1].mask), np.eye(4))
    assert sample((triple[0], empty, triple[2])) is None
    assert sample(frames((0.5, 0.0), times=(0.0, DT, 0.5))) is None
    assert sample(frames((0.5, 0.0), times=(0.0, DT, DT))) is None
    elsewhere = CutOut(2 * DT, triple[2].grey, (400, 300), triple[2].mask, np.eye(4))
    assert sample((triple[0], triple[1], elsewhere)) is None
