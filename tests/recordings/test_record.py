"""Episodes that ``record`` wrote are what the policy met, and replay says of them what perception said then."""

import csv
import dataclasses
import math

import numpy as np
import pytest

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.geometry.rigid import inverse, transform
from fixation_gym.perception.detection.colour import ColourDetector
from fixation_gym.perception.distance.pose_filter import DistanceSettings
from fixation_gym.perception.pipeline import Perception
from fixation_gym.perception.settings import PerceptionSettings
from fixation_gym.recording_commands import Record
from fixation_gym.recordings.catalogue import open_recording
from fixation_gym.replay.config import ReplayConfig
from fixation_gym.replay.run import replay
from fixation_gym.types import Observation

pytestmark = pytest.mark.sim
SMALL, STEPS = (96, 128), 14
CONFIG = EvaluationConfig(policy="servo", scenarios=("opaque",), episodes=1, sensor_noise="nominal", image_size=SMALL)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Folder of recordings, of episodes that are cut short."""
    import gymnasium as gym

    import fixation_gym  # noqa: F401
    from fixation_gym.gl import select_backend
    from fixation_gym.recordings.record import record

    select_backend()
    spec = gym.spec("FixationPick-v0")
    before, spec.max_episode_steps = spec.max_episode_steps, STEPS
    out = tmp_path_factory.mktemp("recorded") / "set"
    try:
        record(CONFIG, out)
        yield out
    finally:
        spec.max_episode_steps = before


@pytest.fixture(scope="module")
def met(recorded):
    """What the policy met in the same episode: observations, the camera, and the target's true centre in ``cam``."""
    import gymnasium as gym

    from fixation_policies.catalogue import make_policy

    env = gym.make("FixationPick-v0", scenario="opaque", image_size=SMALL, max_episode_steps=STEPS)
    policy = make_policy("servo", env)
    obs, _ = env.reset(seed=0)
    policy.reset(0)
    observations, centres = [], []
    for _ in range(STEPS):
        observations.append(obs)
        base = env.unwrapped
        T_cam_base = inverse(base.sim.arm_state().camera_pose)
        centres.append(transform(T_cam_base, base.sim.body_position("target")))
        obs, *_ = env.step(policy.act(obs))
    yield observations, env.unwrapped.intrinsics, centres
    env.close()


def test_pictures_poses_and_joints_are_bit_by_bit_those_of_the_episode(recorded, met):
    observations, camera, _ = met
    recording = open_recording(recorded / "opaque-000000")
    assert recording.camera == camera
    np.testing.assert_array_equal(recording.target_box, observations[0]["target_box"])
    for frame, obs in zip(recording, observations, strict=True):
        np.testing.assert_array_equal(frame.image(), obs["rgb"])
        np.testing.assert_array_equal(frame.camera_pose, obs["camera_pose"].astype(float))
        np.testing.assert_array_equal(frame.joint_pos, obs["joint_pos"].astype(float))
        assert frame.time == float(obs["time"][0])


def test_depth_and_mask_are_those_of_the_target(recorded, met):
    _, camera, centres = met
    for frame, centre in zip(open_recording(recorded / "opaque-000000"), centres, strict=True):
        mask, depth = frame.mask(), frame.depth()
        assert mask.sum() > 30
        rows, columns = np.nonzero(mask)
        assert np.hypot(*(camera.project(centre) - [columns.mean(), rows.mean()])) < 6.0
        assert np.median(depth[mask]) == pytest.approx(centre[2], abs=0.06)  # of the surface, not of the centre
        assert frame.distance_true_m == pytest.approx(np.median(depth[mask]), abs=1e-3)


def test_replay_says_what_perception_says_of_the_observations(recorded, met, tmp_path):
    observations, camera, _ = met
    replay(ReplayConfig(recording=recorded / "opaque-000000", detector="colour", estimator="pose"), tmp_path)
    with (tmp_path / "estimates.csv").open() as file:
        rows = list(csv.DictReader(file))
    noise = DistanceSettings(position_std_m=3e-3, rotation_std_rad=math.radians(0.5))  # replay's, by default
    perception = Perception(camera, PerceptionSettings(distance=noise), detector=ColourDetector(camera))
    for row, obs in zip(rows, observations, strict=True):
        percept = perception.update(Observation.from_dict(obs))
        assert float(row["distance_m"]) == percept.fixation.distance_m
        assert float(row["distance_std_m"]) == percept.fixation.distance_std_m
        if not row["no_map"]:
            assert float(row["map_front"]) == np.mean(percept.zfc.cells > 128)


def test_a_finished_episode_is_not_recorded_again(recorded):
    from fixation_gym.recordings.record import record

    before = (recorded / "opaque-000000" / "frames.csv").stat().st_mtime_ns
    summary = record(dataclasses.replace(CONFIG, episodes=2), recorded)
    assert summary["episodes_resumed"] == 1
    assert summary["recordings"] == ["opaque-000000", "opaque-000001"]
    assert summary["pictures"] == 2 * STEPS
    assert (recorded / "opaque-000000" / "frames.csv").stat().st_mtime_ns == before
    assert len(open_recording(recorded / "opaque-000001")) == STEPS


def test_clips_end_after_their_seconds_and_are_not_mixed_with_others(tmp_path):
    from fixation_gym.recordings.record import record

    config = dataclasses.replace(CONFIG, scenarios=("clear",))
    assert record(config, tmp_path / "set", seconds=0.4)["pictures"] == 10
    times = [frame.time for frame in open_recording(tmp_path / "set" / "clear-000000")]
    np.testing.assert_allclose(times, 0.04 * np.arange(10), atol=1e-6)
    with pytest.raises(UsageError):
        record(config, tmp_path / "set", seconds=0.8)


def test_bad_lengths_are_refused_with_what_is_allowed():
    for seconds in (0.0, -1.0, 30.0):
        with pytest.raises(UsageError, match=r"--seconds must be above 0 and at most 25"):
            Record(seconds=seconds).check()


def test_late_pictures_are_recorded_once_with_the_pose_and_truth_of_their_time(tmp_path):
    import gymnasium as gym

    from fixation_gym.recordings.record import record

    spec = gym.spec("FixationPick-v0")
    before, spec.max_episode_steps = spec.max_episode_steps, STEPS
    try:
        record(dataclasses.replace(CONFIG, sensor_noise="realistic"), tmp_path / "set")
    finally:
        spec.max_episode_steps = before
    frames = list(open_recording(tmp_path / "set" / "opaque-000000"))
    times = np.array([frame.time for frame in frames])
    assert np.all(np.diff(times) > 0.02)  # 30 pictures per second
    assert times[0] < 0.0
    assert all(frame.joint_pos is None for frame in frames)
    assert frames[0].image().shape == (*SMALL, 3)
    # The truth is that of the picture: red where the mask is, also while the camera swings.
    for frame in frames:
        red = frame.image()[frame.mask()].astype(float)
        assert np.median(red[:, 0] - red[:, 1]) > 60
