"""Objects that the scenario moves, in the simulator, without pictures."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

from fixation_gym.envs.config import SCENARIOS
from fixation_gym.envs.motion import Motion, planned

pytestmark = pytest.mark.sim
STILL = np.zeros(7, np.float32)


@pytest.fixture(scope="module")
def env():
    env = gym.make("FixationPick-v0", image_size=None, sensor_noise="ideal").unwrapped
    yield env
    env.close()


def start(env, scenario, seed, **changes):
    """Reset to a scene of that scenario with some of its values replaced."""
    env.scenario = SCENARIOS[scenario]
    env.reset(seed=seed)
    if changes:
        env.scene = replace(env.scene, **changes)
        env.sim.reset(env.scene)
    return env.sim


def with_motion(env, motion):
    env.scenario = SCENARIOS["opaque"]
    env.reset(seed=1)
    return start(env, "opaque", 1, obstacles=(replace(env.scene.obstacles[0], motion=motion),))


def test_a_driven_obstacle_keeps_to_its_way_at_its_speed_upright_and_is_no_collision(env):
    motion = Motion(0.0, (0.06, 0.08), 0.1, to_and_fro=True)
    sim = with_motion(env, motion)
    body = sim.obstacles[0]
    home, attitude, ways = sim.body_position(body).copy(), sim.data.body(body).xquat.copy(), []
    for _ in range(60):
        *_, info = env.step(STILL)
        ways.append(sim.body_position(body)[:2] - home[:2])
        assert ways[-1] == pytest.approx(planned(motion, sim.data.time)[0], abs=4e-3)
        assert sim.data.body(body).xquat == pytest.approx(attitude, abs=0.02)
    speeds = np.linalg.norm(np.diff(ways, axis=0), axis=1) * env.control_frequency
    assert np.median(speeds) == pytest.approx(0.1, rel=0.02)
    assert not info["collision"]


def test_a_driven_obstacle_is_solid_and_yields_to_the_robot(env):
    sim = with_motion(env, Motion(0.0, (0.0, 0.0), 0.1, to_and_fro=True))
    body, collided = sim.obstacles[0], False
    for _ in range(150):
        pose = sim.arm_state().camera_pose
        towards = pose[:3, :3].T @ (sim.body_position(body) - sim.tool_position())
        velocity = 0.6 * towards / np.linalg.norm(towards)
        *_, info = env.step(np.array([*velocity, 0.0, 0.0, 0.0, -1.0], np.float32))
        collided = collided or info["collision"]
        assert np.linalg.norm(sim.data.xfrc_applied, axis=1).max() < 20.0
    assert collided
    assert info["clearance_m"] > -5e-3  # not pushed through
    assert np.linalg.norm(sim.tool_position() - sim.body_position(body)) > 0.01  # the fingers may stand astride of it


def test_a_pushed_obstacle_sleeps_moves_once_and_rests_displaced(env):
    motion = Motion(1.0, (0.07, -0.03), 0.15)
    sim = with_motion(env, motion)
    body = sim.obstacles[0]
    home = sim.body_position(body).copy()
    for _ in range(24):
        env.step(STILL)
    assert np.linalg.norm(sim.body_position(body) - home) < 1e-3
    for _ in range(40):
        *_, info = env.step(STILL)
    assert sim.body_position(body)[:2] - home[:2] == pytest.approx(motion.displacement, abs=2e-3)
    assert np.abs(sim.data.joint(f"{body}_joint").qvel).max() < 1e-3
    assert not sim.data.xfrc_applied.any()
    assert not info["collision"]
    sim.data.joint(f"{body}_joint").qpos[0] += 0.02
    *_, info = env.step(STILL)
    assert info["collision"]


@pytest.mark.parametrize("shape", ["ball", "cylinder"])
def test_a_pushed_target_rests_where_the_push_ends(env, shape):
    scenario = SCENARIOS["moving_target"]
    env.scenario = replace(scenario, target_shapes=(shape,), push_time=(0.2, 0.2))
    env.reset(seed=2)
    sim, motion = env.sim, env.scene.target.motion
    home = sim.body_position("target").copy()
    for _ in range(60):
        env.step(STILL)
    assert 0.03 <= motion.length <= 0.08
    assert sim.body_position("target")[:2] - home[:2] == pytest.approx(motion.displacement, abs=3e-3)
    assert np.linalg.norm(sim.data.joint("target_joint").qvel[:3]) < 1e-3
    assert abs(sim.target_rise()) < 2e-3


def test_a_target_that_was_taken_away_is_not_pushed(env):
    env.scenario = replace(SCENARIOS["moving_target"], push_time=(0.2, 0.2))
    env.reset(seed=2)
    sim = env.sim
    sim.data.joint("target_joint").qpos[0] += 0.03
    before = sim.body_position("target")[0]
    for _ in range(20):
        env.step(STILL)
    assert not sim.data.xfrc_applied.any()
    assert sim.body_position("target")[0] - before == pytest.approx(0.03, abs=5e-3)


def test_the_distractor_is_red_apart_from_the_target_and_lifting_it_is_no_success(env):
    sim = start(env, "distractor", 3)
    model = sim.model
    colours = []
    for name in ("target", "distractor"):
        shown = (model.geom_bodyid == model.body(name).id) & (model.geom_contype > 0)
        assert shown.any()
        colours.append(np.unique(model.geom_rgba[shown], axis=0))
    np.testing.assert_array_equal(*colours)
    assert np.linalg.norm(sim.body_position("distractor") - sim.body_position("target")) > 0.1
    assert "distractor" not in sim.obstacles
    sim.data.joint("distractor_joint").qpos[2] += 0.12
    model.body_gravcomp[model.body("distractor").id] = 1.0
    for _ in range(20):
        *_, terminated, _, info = env.step(STILL)
    assert sim.body_position("distractor")[2] > 0.0
    assert not terminated
    assert not info["is_success"]
    env.scenario = SCENARIOS["clear"]
    env.reset(seed=0)
    assert not model.geom_contype[model.geom_bodyid == model.body("distractor").id].any()


@pytest.mark.parametrize("scenario", ["moving_obstacle", "mixed"])
def test_the_same_seed_moves_the_same_things_bit_by_bit_after_another_episode(env, scenario):
    def trail(seed):
        env.scenario = replace(SCENARIOS[scenario], push_time=(0.1, 0.2), target_moves=1.0)
        env.reset(seed=seed)
        states = [env.sim.data.qpos.copy()]
        for _ in range(20):
            env.step(STILL)
            states.append(env.sim.data.qpos.copy())
        return np.array(states)

    first = trail(4)
    assert np.ptp(first[:, 9:], axis=0).max() > 0.01
    trail(9)
    np.testing.assert_array_equal(first, trail(4))
