"""The box that tells which thing is the target, and scenes in which only it does."""

import gymnasium as gym
import numpy as np
import pytest

import fixation_gym  # noqa: F401
from fixation_gym.envs.config import SCENARIOS
from fixation_gym.envs.sampling import sample_scene
from fixation_gym.envs.scene import RED, TargetSpec
from fixation_gym.envs.target_box import target_box
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import look_at
from fixation_gym.perception.detection.colour import segment

CAMERA = Intrinsics.from_fovy(240, 320, 0.74)
UP = np.array([0.0, 0.0, 1.0])


def test_the_box_of_a_ball_is_as_wide_as_its_outline():
    centre = np.array([0.55, 0.0, -0.077])
    ball = TargetSpec("ball", (1.0, 1.0, 1.0), tuple(centre), 0.0)
    pose = look_at(centre + np.array([-0.3, 0.0, 0.4]), centre, UP)
    x, y, width, height = target_box(ball, pose, CAMERA)
    radius = CAMERA.fx * 0.035 / np.sqrt(0.5**2 - 0.035**2)
    assert [width, height] == pytest.approx([2 * radius, 2 * radius], abs=1.5)
    assert [x + 0.5 * width, y + 0.5 * height] == pytest.approx([CAMERA.cx, CAMERA.cy], abs=1.5)


def test_a_box_is_cut_at_the_border_and_0_where_the_target_is_not_in_the_image():
    ball = TargetSpec("ball", (1.0, 1.0, 1.0), (0.55, 0.0, -0.077), 0.0)
    eye = np.array([0.25, 0.0, 0.4])
    aside = look_at(eye, np.array([0.55, 0.33, -0.077]), UP)
    x, _, width, _ = target_box(ball, aside, CAMERA)
    assert x + width == 320.0
    assert 0.0 < width < 50.0
    away = look_at(eye, np.array([-0.5, 0.0, 0.4]), UP)
    np.testing.assert_array_equal(target_box(ball, away, CAMERA), np.zeros(4))


@pytest.mark.sim
@pytest.mark.parametrize("seed", [3, 4])
def test_the_box_is_around_the_target_in_the_first_image_and_stays(seed):
    env = gym.make("FixationPick-v0", scenario="clear", sensor_noise="ideal")
    obs, _ = env.reset(seed=seed)
    rows, columns = np.nonzero(segment(obs["rgb"], env.unwrapped.intrinsics).mask)
    x, y, width, height = obs["target_box"]
    assert [x, y] == pytest.approx([columns.min(), rows.min()], abs=2.0)
    assert [x + width, y + height] == pytest.approx([columns.max() + 1, rows.max() + 1], abs=2.0)
    assert env.observation_space.contains(obs)
    for _ in range(3):
        later, *_ = env.step(np.full(7, 0.5, np.float32))
    env.close()
    np.testing.assert_array_equal(later["target_box"], obs["target_box"])


def test_any_colour_changes_looks_and_nothing_else():
    plain = {**SCENARIOS["any_colour"].__dict__, "any_colour": False}
    coloured = [sample_scene(SCENARIOS["any_colour"], np.random.default_rng(seed)) for seed in range(6)]
    others = [sample_scene(type(SCENARIOS["any_colour"])(**plain), np.random.default_rng(seed)) for seed in range(6)]
    assert len({scene.target.rgba for scene in coloured}) == 6
    for scene, other in zip(coloured, others, strict=True):
        assert scene.target.position == other.target.position
        assert [o.position for o in scene.obstacles] == [o.position for o in other.obstacles]
        assert scene.camera_position == other.camera_position
        assert other.target.rgba == RED


@pytest.mark.sim
def test_the_servo_picks_what_the_box_names_whatever_its_colour():
    from fixation_gym.evaluation.rollout import run_episode
    from fixation_policies.catalogue import make_policy

    env = gym.make("FixationPick-v0", scenario="any_colour")
    results = [run_episode(env, make_policy("servo", env), seed=seed) for seed in (8_900_000, 8_900_001, 8_900_003)]
    env.close()
    assert sum(result.success for result in results) >= 2
