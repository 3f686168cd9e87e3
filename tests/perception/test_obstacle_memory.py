from dataclasses import replace

import numpy as np
import pytest

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import look_at
from fixation_gym.perception.zero_flow.obstacle_memory import MemorySettings, ObstacleMemory, believed_points, remember
from fixation_gym.perception.zero_flow.zero_flow import ZeroFlow, unknown_zero_flow

CAMERA = Intrinsics.from_fovy(40, 60, 0.74)
SETTINGS = MemorySettings()
POSE = look_at(np.array([0.0, 0.0, 0.5]), np.array([0.5, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))


def patch(p_nearer: float, depth: float = 0.3, relative_std: float = 0.02, half: int = 5) -> ZeroFlow:
    """A test that has evidence in a square patch in the image centre."""
    empty = unknown_zero_flow(40, 60)
    probability, inverse_depth, std = (a.copy() for a in (empty.p_nearer, empty.inverse_depth, empty.inverse_depth_std))
    supported = empty.supported.copy()
    where = np.s_[20 - half : 20 + half, 30 - half : 30 + half]
    probability[where], inverse_depth[where], std[where] = p_nearer, 1.0 / depth, relative_std / depth
    supported[where] = True
    changed = {"p_nearer": probability, "supported": supported, "inverse_depth": inverse_depth}
    return replace(empty, **changed, inverse_depth_std=std)


def see(zero_flow, frames, memory=None, start=0.0):
    memory = memory or ObstacleMemory.empty()
    for k in range(frames):
        memory = remember(memory, zero_flow, CAMERA, POSE, start + 0.04 * k, SETTINGS)
    return memory


def test_what_is_in_front_for_several_frames_is_remembered_where_it_is():
    points, evidence = believed_points(see(patch(1.0), 7), SETTINGS)
    assert len(points) > 3
    assert evidence.min() >= SETTINGS.min_evidence
    in_camera = (points - POSE[:3, 3]) @ POSE[:3, :3]
    assert in_camera[:, 2] == pytest.approx(np.full(len(points), 0.3), abs=SETTINGS.voxel_m)
    assert np.abs(in_camera[:, :2]).max() < 0.06


def test_points_lie_on_the_surface_and_within_the_outline():
    half = 5
    points, _ = believed_points(see(patch(1.0, half=half), 7), SETTINGS)
    in_camera = (points - POSE[:3, 3]) @ POSE[:3, :3]
    assert in_camera[:, 2] == pytest.approx(np.full(len(points), 0.3), abs=1e-6)
    # The flow's window smears a thing over its outline, so the outermost pixels are left out.
    pixels = CAMERA.project(in_camera)
    assert np.all(pixels[:, 0] >= 30 - half + 1 - 1e-6)
    assert np.all(pixels[:, 0] <= 30 + half - 2 + 1e-6)
    assert np.all(pixels[:, 1] >= 20 - half + 1 - 1e-6)
    assert np.all(pixels[:, 1] <= 20 + half - 2 + 1e-6)


def test_a_single_frame_a_doubtful_or_an_inexact_one_is_not_believed():
    for zero_flow, frames in ((patch(1.0), 1), (patch(0.9), 20), (patch(1.0, relative_std=0.3), 20)):
        points, _ = believed_points(see(zero_flow, frames), SETTINGS)
        assert len(points) == 0


def test_what_the_camera_sees_through_is_forgotten_at_once():
    memory = see(patch(1.0), 8)
    memory = see(patch(0.0, depth=0.9, half=9), 8, memory, start=0.4)
    assert len(believed_points(memory, SETTINGS)[0]) == 0


@pytest.mark.parametrize(("depth", "forgotten"), [(0.30, False), (0.36, True)])
def test_a_point_is_forgotten_where_something_clearly_behind_it_is_seen_though_still_in_front(depth, forgotten):
    memory = see(patch(1.0), 8)
    before = len(believed_points(memory, SETTINGS)[0])
    memory = see(patch(1.0, depth=depth, half=9), 8, memory, start=0.4)
    points, _ = believed_points(memory, SETTINGS)
    near = (points - POSE[:3, 3]) @ POSE[:3, 2] < 0.32
    assert near.sum() == 0 if forgotten else near.sum() >= before


LOOKS_AWAY = look_at(np.array([0.0, 0.0, 0.5]), np.array([-0.5, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))


@pytest.mark.parametrize(
    ("pose", "known", "decay"),
    [(POSE, True, SETTINGS.decay_in_view_s), (POSE, False, SETTINGS.decay_s), (LOOKS_AWAY, True, SETTINGS.decay_s)],
)
def test_what_is_not_seen_again_fades_sooner_where_something_is_known(pose, known, decay):
    memory = see(patch(1.0), 8)
    before = memory.evidence.max()
    test = patch(0.5) if known else unknown_zero_flow(40, 60)
    later = remember(memory, test, CAMERA, pose, memory.time + 0.3 * decay, SETTINGS)
    assert later.evidence.max() == pytest.approx(before * np.exp(-0.3))
    assert len(believed_points(later, SETTINGS)[0]) > 0
    later = remember(memory, test, CAMERA, pose, memory.time + 3.0 * decay, SETTINGS)
    assert len(believed_points(later, SETTINGS)[0]) == 0
