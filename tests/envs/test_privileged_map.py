"""The map of privileged observations against the scene."""

import numpy as np
import pytest

from fixation_gym.envs.config import SCENARIOS
from fixation_gym.envs.privileged_map import nearer_map
from fixation_gym.envs.zfc_env import FixationPickZFC

pytestmark = pytest.mark.sim
SIZE = (96, 128)


def test_cells_hold_the_share_that_is_nearer():
    depth = np.full((128, 128), 9.0, np.float32)
    depth[:4, :4], depth[4:6, 4:8] = 0.3, 0.3
    expected = np.zeros((32, 32))
    expected[0, 0], expected[1, 1] = 255, 128
    np.testing.assert_array_equal(nearer_map(depth, 0.4), expected)
    assert not nearer_map(depth, 0.2).any()


def test_obstacles_are_seen_at_their_distance_whatever_they_are_made_of_and_nothing_else_is():
    kinds = ("mirror", "opaque", "translucent")
    scenario = {"obstacle_materials": kinds, "obstacle_count": (2, 6), "alpha": (0.3, 0.3)}
    env = FixationPickZFC(scenario, "privileged", image_size=SIZE)
    looked = set()
    for seed in range(32):
        obs, info = env.reset(seed=seed)
        pose = env.sim.arm_state().camera_pose
        depth = env._truth.depth(env.data)
        camera = env.intrinsics.scaled(*depth.shape)
        for obstacle in env.scene.obstacles:
            if obstacle.shape.name != "thing":
                continue  # the middle of others may be hollow
            centre = pose[:3, :3].T @ (np.array(obstacle.position) - pose[:3, 3])
            column, row = np.rint(camera.project(centre)).astype(int)
            if not (0 <= column < camera.width and 0 <= row < camera.height):
                continue
            looked.add(obstacle.kind)
            reach = np.linalg.norm(obstacle.box.half_extent)
            assert depth[row, column] < centre[2] + reach
            if depth[row, column] < info["distance_true_m"]:
                assert obs["true_map"][0, row * 32 // camera.height, column * 32 // camera.width] > 0
    assert looked == set(kinds)
    env.scenario = SCENARIOS["clear"]
    obs, _ = env.reset(seed=0)
    assert not obs["true_map"].any()
    env.close()
