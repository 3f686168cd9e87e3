"""Physics of FixationPick-v0: motion, geometry of the image, contacts, success."""

import gymnasium as gym
import numpy as np
import pytest

from fixation_gym.envs.config import SCENARIO_NAMES
from fixation_gym.geometry.rigid import pose_to_matrix
from fixation_gym.perception.pipeline import Perception
from fixation_gym.robots import ROBOT
from fixation_gym.types import Observation

pytestmark = pytest.mark.sim
SMALL = (64, 80)


def test_the_camera_follows_a_commanded_circle_within_five_percent(ideal_env):
    ideal_env.reset(seed=3)
    commanded, measured = [], []
    for k in range(120):
        phase = 2.0 * k / 25.0
        v = 0.05 * np.array([np.cos(phase), np.sin(phase), 0.0])
        twist = np.array([*v, v[1] / 0.45, -v[0] / 0.45, 0.0])
        obs, *_ = ideal_env.step(np.array([*twist / ROBOT.arm.twist_limits, -1.0], np.float32))
        commanded.append(twist)
        measured.append(obs["camera_twist"])
    error = np.array(measured)[10:] - np.array(commanded)[10:]
    for part in (slice(0, 3), slice(3, 6)):
        assert np.linalg.norm(error[:, part]) < 0.05 * np.linalg.norm(np.array(commanded)[10:, part])


def test_measured_twist_is_the_rate_of_the_measured_pose(ideal_env):
    ideal_env.reset(seed=5)
    action = np.array([0.3, -0.2, 0.4, 0.1, 0.2, -0.3, -1.0], np.float32)
    for _ in range(12):
        before, *_ = ideal_env.step(action)
    after, *_ = ideal_env.step(action)
    T_before, T_after = pose_to_matrix(before["camera_pose"]), pose_to_matrix(after["camera_pose"])
    mean_velocity = T_before[:3, :3].T @ (T_after[:3, 3] - T_before[:3, 3]) * 25.0
    assert mean_velocity == pytest.approx(after["camera_twist"][:3], abs=2e-3)


def test_a_point_projects_onto_its_rendered_blob_within_a_pixel():
    # The ball's silhouette centre lies near the projection of its centre.
    scenario = {"target_shapes": ["ball"], "grasp_width": [0.03, 0.03]}
    env = gym.make("FixationPick-v0", scenario=scenario, sensor_noise="ideal")
    for seed in range(3):
        obs, _ = env.reset(seed=seed)
        rgb = obs["rgb"].astype(int)
        # A ratio, so that the ball's shaded side counts as well.
        rows, columns = np.nonzero((rgb[..., 0] > 20) & (3 * rgb[..., 1:].max(axis=-1) < rgb[..., 0]))
        T_base_cam = pose_to_matrix(np.float64(obs["camera_pose"]))
        centre = env.unwrapped.sim.body_position("target")
        pixel = env.unwrapped.intrinsics.project(T_base_cam[:3, :3].T @ (centre - T_base_cam[:3, 3]))
        assert pixel == pytest.approx([columns.mean(), rows.mean()], abs=1.0)
    env.close()


def test_the_wrist_camera_does_not_see_the_robot(ideal_env):
    ideal_env.reset(seed=2)
    unwrapped = ideal_env.unwrapped
    views = (unwrapped._views.view(name, unwrapped.sim) for name in ("observation", "wrist"))
    hidden, with_robot = (view.render(unwrapped.data.qpos, with_reflections=False) for view in views)
    difference = np.abs(hidden.astype(int) - with_robot.astype(int)).max(axis=-1)
    assert np.mean(difference > 60) < 0.01  # shadows differ, a finger in view would be large


@pytest.mark.parametrize("scenario", SCENARIO_NAMES)
def test_objects_rest_where_the_scene_puts_them(scenario):
    env = gym.make("FixationPick-v0", scenario=scenario, image_size=SMALL)
    for seed in range(3):
        env.reset(seed=seed)
        for _ in range(15):
            _, _, _, _, info = env.step(np.zeros(7, np.float32))
        sim, scene = env.unwrapped.sim, env.unwrapped.scene
        assert np.linalg.norm(sim.body_position("target") - scene.target.position) < 2e-3
        assert sim.obstacle_push() < 2e-3
        assert not info["collision"]
        if scene.obstacles:
            assert 0.0 < info["clearance_m"] < 0.5
    env.close()


def test_pushing_an_obstacle_counts_as_a_collision(env):
    env.reset(seed=0)
    sim = env.unwrapped.sim
    body = sim.obstacles[0]
    sim.data.joint(f"{body}_joint").qpos[0] += 0.05
    _, reward, _, _, info = env.step(np.zeros(7, np.float32))
    assert info["collision"]
    assert info["reward_collision"] < 0.0
    assert reward < -4.0


def test_driving_the_hand_into_an_obstacle_is_a_collision_by_force():
    env = gym.make("FixationPick-v0", scenario="opaque", image_size=SMALL)
    hits = []
    for seed in range(3):
        env.reset(seed=seed)
        sim, hit = env.unwrapped.sim, False
        for _ in range(150):
            pose = sim.arm_state().camera_pose
            board = sim.data.geom(f"{sim.obstacles[0]}_0").xpos - sim._base_position
            offset = pose[:3, :3].T @ (board - sim.tool_position())
            velocity = 0.1 * offset / np.linalg.norm(offset)
            _, hit = sim.step(np.array([*velocity, 0.0, 0.0, 0.0]), -1.0)
            if hit:
                assert sim.obstacle_push() < 0.01  # the force was felt before it had moved a centimetre
                break
        hits.append(hit)
    assert any(hits)
    env.close()


def test_the_path_of_a_period_tells_where_the_arm_was(ideal_env):
    sim = ideal_env.unwrapped.sim
    ideal_env.reset(seed=1)
    twist = np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.0])
    for _ in range(10):
        sim.step(twist, -1.0)
    path, _ = sim.step(twist, -1.0)
    np.testing.assert_array_equal(path[-1], sim.data.qpos)
    travelled = (sim.data.qpos - path[-6])[:7]  # 10 ms
    assert sim.arm_state().jacobian @ travelled == pytest.approx(0.01 * twist, abs=2e-4)


def test_success_needs_the_target_lifted_for_half_a_second(env):
    env.reset(seed=0)
    sim = env.unwrapped.sim
    joint = sim.data.joint("target_joint")
    joint.qpos[2] += 0.12
    sim.model.body_gravcomp[sim.model.body("target").id] = 1.0
    outcomes = [env.step(np.zeros(7, np.float32)) for _ in range(13)]
    assert [terminated for _, _, terminated, _, _ in outcomes] == [False] * 12 + [True]
    assert outcomes[-1][1] > 5.0
    assert outcomes[-1][4]["is_success"]


@pytest.mark.parametrize("frequency", [10, 50])
def test_other_control_frequencies_move_as_far_per_second_and_keep_the_flow_valid(frequency):
    env = gym.make("FixationPick-v0", image_size=SMALL, control_frequency=frequency, sensor_noise="ideal")
    perception = Perception(env.unwrapped.intrinsics)
    first, _ = env.reset(seed=0)
    perception.update(Observation.from_dict(first))
    valid = []
    for _ in range(frequency):
        obs, *_ = env.step(np.array([0.4, 0, 0, 0, 0, 0, 0], np.float32))
        valid.append(perception.update(Observation.from_dict(obs)).flow.valid)
    assert obs["time"][0] == pytest.approx(1.0)
    assert np.linalg.norm(obs["camera_pose"][:3] - first["camera_pose"][:3]) == pytest.approx(0.06, abs=0.006)
    assert all(valid[2:])
    env.close()
