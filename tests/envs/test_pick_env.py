"""Contracts of FixationPick-v0 in the simulator: checkers, determinism, arguments, observations, views."""

import json
import subprocess
import sys
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import fixation_gym
from fixation_gym.envs.info import reward_terms
from fixation_gym.perception import Perception
from fixation_gym.types import Observation

pytestmark = pytest.mark.sim
SMALL = (64, 80)
INFO_KEYS = {
    "is_success",
    "success",
    "collision",
    "clearance_m",
    "distance_true_m",
    "fixation_error_px",
    "reward_progress",
    "reward_time",
    "reward_success",
    "reward_collision",
}


def rollout(env, seed, steps=12):
    rng = np.random.default_rng(0)
    obs, _ = env.reset(seed=seed)
    trail = [obs]
    for _ in range(steps):
        obs, reward, *_ = env.step(rng.uniform(-1, 1, 7).astype(np.float32))
        trail.append({**obs, "reward": np.array(reward)})
    return trail


def assert_same(first, second):
    for a, b in zip(first, second, strict=True):
        for key in a:
            np.testing.assert_array_equal(a[key], b[key], err_msg=key)


def test_the_environment_passes_gymnasiums_checker(env):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)


def test_the_environment_passes_stable_baselines_checker(env):
    from stable_baselines3.common.env_checker import check_env as check_sb3_env

    check_sb3_env(env.unwrapped, warn=False)
    assert env.spec.max_episode_steps == 625


def test_the_same_seed_gives_the_same_trajectory_bit_by_bit_after_another_episode(env):
    first = rollout(env, seed=4)
    rollout(env, seed=9)
    assert_same(first, rollout(env, seed=4))


def test_a_scene_leaves_nothing_behind_in_the_model():
    env, other = (gym.make("FixationPick-v0", scenario=name, image_size=SMALL) for name in ("mirror", "translucent"))
    for environment in (env, other):
        environment.reset(seed=0)
    sim, scene, in_between = env.unwrapped.sim, env.unwrapped.scene, other.unwrapped.scene

    def snapshot():
        model = sim.model
        arrays = {name: getattr(model, name) for name in dir(model) if not name.startswith("_")}
        arrays = {name: value.copy() for name, value in arrays.items() if isinstance(value, np.ndarray)}
        return {**arrays, "meaninertia": np.array(model.stat.meaninertia), "qpos": sim.data.qpos.copy()}

    sim.reset(scene)
    before = snapshot()
    sim.reset(in_between)
    assert any(not np.array_equal(before[name], value) for name, value in snapshot().items())
    sim.reset(scene)
    for name, value in snapshot().items():
        np.testing.assert_array_equal(value, before[name], err_msg=name)
    env.close()
    other.close()


def test_another_process_gives_the_same_trajectory(env):
    code = (
        "import json, numpy as np, gymnasium as gym, fixation_gym\n"
        f"env = gym.make('FixationPick-v0', scenario='opaque', image_size={SMALL})\n"
        "obs, _ = env.reset(seed=4)\n"
        "for _ in range(8): obs, *_ = env.step(np.full(7, 0.3, np.float32))\n"
        "print(json.dumps({k: int(v.sum()) if k == 'rgb' else v.tolist() for k, v in obs.items()}))"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    obs, _ = env.reset(seed=4)
    for _ in range(8):
        obs, *_ = env.step(np.full(7, 0.3, np.float32))
    other = json.loads(result.stdout.splitlines()[-1])
    assert other.pop("rgb") == int(obs["rgb"].sum())
    for key, value in other.items():
        assert value == obs[key].tolist(), key


def test_seeds_change_target_and_obstacles(env):
    scenes = []
    for seed in (0, 1):
        env.reset(seed=seed)
        scenes.append(env.unwrapped.scene)
    assert scenes[0].target.position != scenes[1].target.position
    assert scenes[0].obstacles != scenes[1].obstacles


def test_reset_and_step_give_the_same_info_keys_and_terms_that_sum_to_the_reward(env):
    _, info = env.reset(seed=0)
    assert set(info) == INFO_KEYS
    _, reward, terminated, truncated, after = env.step(np.zeros(7, np.float32))
    assert set(after) == INFO_KEYS
    assert set(reward_terms(info).values()) == {0.0}
    assert sum(reward_terms(after).values()) == pytest.approx(reward)
    assert (terminated, truncated) == (False, False)


@pytest.mark.parametrize(
    "action", [np.full(7, np.nan), np.zeros(6), np.zeros((1, 7)), np.array([np.inf, 0, 0, 0, 0, 0, 0])]
)
def test_bad_actions_are_refused_with_what_is_allowed(env, action):
    env.reset(seed=0)
    with pytest.raises(ValueError, match="7 finite numbers"):
        env.unwrapped.step(action)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"scenario": "fog"}, "clear, opaque, translucent, mirror"),
        ({"image_size": (0, 320)}, "height, width"),
        ({"image_size": "big"}, "height, width"),
        ({"sensor_noise": "none"}, "nominal"),
        ({"control_frequency": 30}, "10, 20, 25, 50 or 100"),
        ({"render_mode": "ansi"}, "rgb_array"),
        ({"render_view": "top"}, "overlay"),
        ({"reward": "huge"}, "dense"),
        ({"image_size": None, "render_view": "overlay"}, "needs an image_size"),
    ],
)
def test_bad_arguments_are_refused_before_anything_is_built(arguments, message):
    with pytest.raises(ValueError, match=message):
        gym.make("FixationPick-v0", **arguments)


def test_nothing_private_reaches_the_observation(env):
    obs, _ = env.reset(seed=0)
    vectors = {"joint_pos", "joint_vel", "gripper_width", "camera_pose", "camera_twist", "time", "target_box"}
    vectors |= {"image_time"}
    assert set(obs) == {"rgb", *vectors}
    assert env.observation_space.contains(obs)


def test_observations_do_not_share_memory(env):
    first, _ = env.reset(seed=0)
    copies = {key: value.copy() for key, value in first.items()}
    env.step(np.ones(7, np.float32))
    for key, value in copies.items():
        np.testing.assert_array_equal(first[key], value)


@pytest.mark.parametrize("view", ["wrist", "front", "overlay"])
def test_rendered_views_show_something(view):
    env = gym.make("FixationPick-v0", image_size=SMALL, render_mode="rgb_array", render_view=view)
    env.reset(seed=0)
    frame = env.render()
    assert frame.dtype == np.uint8
    assert frame.ndim == 3
    assert frame.std() > 10.0
    env.close()
    env.close()


def test_human_mode_without_a_display_says_what_to_use(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    env = gym.make("FixationPick-v0", image_size=SMALL, render_mode="human")
    with pytest.raises(RuntimeError, match="rgb_array"):
        env.reset(seed=0)
    env.close()


def test_importing_the_package_registers_the_environment():
    assert fixation_gym.__name__ in gym.spec("FixationPick-v0").entry_point


def test_the_overlay_draws_what_whoever_acts_perceived_and_nothing_without():
    env = gym.make("FixationPick-v0", scenario="clear", render_mode="rgb_array", render_view="overlay")
    obs, _ = env.reset(seed=1)
    plain = env.render()
    perception = Perception(env.unwrapped.intrinsics, support_height_m=-0.112)
    env.unwrapped.percept = perception.update(Observation.from_dict(obs))
    drawn = env.render()
    env.reset(seed=1)
    forgotten = env.render()
    env.close()
    assert np.any(drawn[:, :480] != plain[:, :480])
    np.testing.assert_array_equal(drawn[:, 480:], plain[:, 480:])
    np.testing.assert_array_equal(forgotten, plain)
