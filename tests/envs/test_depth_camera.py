"""The stereo depth camera: known disparities come back as depth, and what it cannot see are holes or phantoms."""

import gymnasium as gym
import numpy as np
import pytest

import fixation_gym  # noqa: F401
from fixation_gym.envs import depth_camera
from fixation_gym.geometry.camera import Intrinsics

CAMERA = Intrinsics.from_fovy(240, 320, np.radians(42.5))
WIDE = depth_camera.imager(CAMERA)
FOCAL_M = CAMERA.fx * depth_camera.BASELINE_M


def texture(seed=0):
    return np.random.default_rng(seed).integers(0, 255, (WIDE.height, WIDE.width), np.uint8)


def pair(disparity):
    """Pictures of a textured wall that faces the camera at a whole disparity."""
    left = texture()
    return left, np.roll(left, -disparity, axis=1)


@pytest.mark.parametrize("disparity", [5, 16, 40, 120])
def test_wall_is_measured_within_the_quantum_of_disparity(disparity):
    depth = depth_camera.stereo_depth(*pair(disparity), CAMERA)
    known = depth > 0
    assert known.mean() > 0.95
    true = FOCAL_M / disparity
    quantum = true**2 / FOCAL_M / 16
    assert np.median(np.abs(depth[known] - true)) <= quantum
    assert np.mean(np.abs(depth[known] - true) <= quantum * 1.01) > 0.95


def test_nothing_nearer_than_the_nearest_distance_is_measured():
    beyond = depth_camera.disparity_range(CAMERA) + 6
    assert FOCAL_M / beyond < depth_camera.nearest_m(CAMERA)
    depth = depth_camera.stereo_depth(*pair(beyond), CAMERA)
    assert np.mean(depth == 0) > 0.9
    assert not np.any((depth > 0) & (depth < depth_camera.nearest_m(CAMERA)))


def test_nearest_distance_at_the_default_size_is_that_of_the_page():
    assert depth_camera.nearest_m(CAMERA) == pytest.approx(0.12, abs=0.002)
    assert np.degrees(2 * np.arctan(0.5 * WIDE.width / CAMERA.fx)) == pytest.approx(87, abs=2)


def test_nothing_is_known_of_a_plain_wall():
    plain = np.full((WIDE.height, WIDE.width), 120, np.uint8)
    noisy = [np.clip(plain + np.random.default_rng(i).normal(0, 1, plain.shape), 0, 255) for i in range(2)]
    depth = depth_camera.stereo_depth(*(picture.astype(np.uint8) for picture in noisy), CAMERA)
    assert np.mean(depth > 0) < 0.1


def test_what_only_one_imager_sees_is_a_hole():
    wall, board = pair(8), texture(1)
    left, right = wall
    columns = np.arange(WIDE.width)
    middle = WIDE.width // 2
    on_left, on_right = ((columns >= middle - shift) & (columns < middle + 40 - shift) for shift in (0, 30))
    left, right = left.copy(), right.copy()
    left[:, on_left] = right[:, on_right] = board[:, :40]
    depth = depth_camera.stereo_depth(left, right, CAMERA)
    side = depth_camera.disparity_range(CAMERA)
    shadow = depth[:, middle - side - 18 : middle - side - 6]  # 22 columns left of the board, without its windows
    assert np.mean(shadow == 0) > 0.6
    assert np.median(depth[:, middle - side + 5 : middle - side + 35]) == pytest.approx(FOCAL_M / 30, rel=0.01)


def test_pictures_of_another_size_are_refused():
    with pytest.raises(ValueError, match="the right picture must be of shape"):
        depth_camera.stereo_depth(texture(), np.zeros((4, 4), np.uint8), CAMERA)


def first_look(scenario, seed):
    """Depth of the first picture of an episode, and the truth of that picture."""
    from fixation_gym.envs.truth_view import TruthView

    env = gym.make("FixationPick-v0", scenario=scenario, image_size=(240, 320), depth_camera=True)
    depth = env.reset(seed=seed)[0]["depth"]
    base = env.unwrapped
    view = TruthView(base.model, base.intrinsics)
    truth = view.look(base.picture_qpos)
    owners = np.array([*(base.model.body(body).name for body in base.model.geom_bodyid), ""])
    view.close()
    env.close()
    return depth, truth, np.char.startswith(owners[truth.geom], "obstacle")


def share_at(depth, surface, where):
    """Share of the known pixels where the depth is that of a surface, to 5 %."""
    known = where & (depth > 0)
    return np.mean(np.abs(depth - surface)[known] < 0.05 * surface[known])


@pytest.mark.sim
def test_table_is_where_it_is():
    depth, truth, _ = first_look("clear", 3)
    near = truth.depth < 1.0
    assert np.mean(depth[near] > 0) > 0.5
    assert share_at(depth, truth.depth, near) > 0.95


@pytest.mark.sim
def test_mirror_gives_a_false_surface_behind_it():
    depth, truth, _ = first_look("mirror", 0)
    face = np.isfinite(truth.image_depth) & (truth.image_depth > 1.2 * truth.depth)
    assert share_at(depth, truth.image_depth, face) > 0.5
    assert share_at(depth, truth.depth, face) < 0.5


@pytest.mark.sim
def test_see_through_pane_is_missed_for_what_is_behind_it():
    depth, truth, obstacle = first_look("translucent", 7)
    pane = obstacle & (truth.depth_behind_glass > 1.2 * truth.depth)
    assert share_at(depth, truth.depth_behind_glass, pane) > 0.7
    assert share_at(depth, truth.depth, pane) < 0.2


@pytest.mark.sim
def test_environment_repeats_itself_and_its_picture_is_that_without_depth():
    env = gym.make("FixationPick-v0", image_size=(120, 160), depth_camera=True)
    first = env.reset(seed=3)[0]
    np.testing.assert_array_equal(first["depth"], env.reset(seed=3)[0]["depth"])
    assert env.observation_space.contains(first)
    plain = gym.make("FixationPick-v0", image_size=(120, 160))
    np.testing.assert_array_equal(plain.reset(seed=3)[0]["rgb"], first["rgb"])  # noise of depth is its own
    env.close()
    plain.close()


@pytest.mark.sim
def test_depth_goes_on_from_a_state():
    env = gym.make("FixationPickZFC-v0", observation="depth", image_size=(64, 80))
    env.reset(seed=1)
    state = env.unwrapped.get_state()
    action = np.array([0.4, 0.2, 0.1, -1], np.float32)
    first = [env.step(action)[0]["depth"] for _ in range(3)]
    env.reset(seed=2)
    env.unwrapped.set_state(state)
    np.testing.assert_array_equal([env.step(action)[0]["depth"] for _ in range(3)], first)
    env.close()


def test_bad_values_are_refused():
    with pytest.raises(ValueError, match="depth_camera=True needs an image_size"):
        gym.make("FixationPick-v0", image_size=None, depth_camera=True)
    with pytest.raises(ValueError, match="depth_camera must be true or false, got 'yes'"):
        gym.make("FixationPick-v0", depth_camera="yes")


@pytest.mark.sim
def test_policy_sees_the_depth_of_its_environment():
    from fixation_policies.catalogue import make_policy, needed_environment

    name = "servo:depth"
    env = gym.make("FixationPick-v0", scenario="opaque", image_size=(120, 160), **needed_environment(name).arguments)
    policy, observation = make_policy(name, env), env.reset(seed=1)[0]
    policy.reset()
    for _ in range(25):
        observation = env.step(policy.act(observation))[0]
    assert policy.percept.zfc.supported.mean() > 0.3
    env.close()
