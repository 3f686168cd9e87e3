"""A data set of recorded episodes, read back by the libraries that its format belongs to."""

import dataclasses
import json

import imageio_ffmpeg
import numpy as np
import pytest

from fixation_gym.errors import UsageError
from fixation_gym.export.config import ExportConfig
from fixation_gym.export.recording import NAMES, VIDEOS

pd = pytest.importorskip("pandas")
SMALL = (64, 80)
CONFIG = ExportConfig(policy="servo", scenarios=("clear",), episodes=2, image_size=SMALL)


def frames_of(path):
    frames = imageio_ffmpeg.read_frames(str(path))
    width, height = next(frames)["size"]
    return np.array([np.frombuffer(frame, np.uint8).reshape(height, width, 3) for frame in frames])


@pytest.fixture(scope="module")
def short():
    """Episodes of twelve steps, so that recording takes seconds."""
    import gymnasium as gym

    from fixation_gym.gl import select_backend

    select_backend()
    spec = gym.spec("FixationPick-v0")
    before = spec.max_episode_steps
    spec.max_episode_steps = 12
    yield
    spec.max_episode_steps = before


@pytest.fixture(scope="module")
def dataset(tmp_path_factory, short):
    from fixation_gym.export.run import export

    out = tmp_path_factory.mktemp("export") / "set"
    export(CONFIG, out)
    return out


@pytest.mark.sim
def test_rows_and_videos_are_what_the_policy_met(dataset):
    import gymnasium as gym

    from fixation_policies.catalogue import make_policy

    table = pd.read_parquet(dataset / "data")
    env = gym.make("FixationPick-v0", scenario="clear", image_size=SMALL, max_episode_steps=12)
    policy = make_policy("servo", env)
    images = frames_of(dataset / "videos" / VIDEOS[0] / "chunk-000" / "file-001.mp4")
    rows = table[table.episode_index == 1]
    assert len(rows) == len(images) == 12
    obs, _ = env.reset(seed=1)
    policy.reset(1)
    for image, (_, row) in zip(images, rows.iterrows(), strict=True):
        np.testing.assert_array_equal(row["observation.state"], [*obs["joint_pos"], *obs["gripper_width"]])
        np.testing.assert_array_equal(row["observation.camera_pose"], obs["camera_pose"])
        assert np.abs(image.astype(float) - obs["rgb"]).mean() < 6.0  # the video is lossy
        action = policy.act(obs)
        np.testing.assert_array_equal(row["action"], action)
        obs, reward, *_ = env.step(action)
        assert row["next.reward"] == pytest.approx(reward)
    assert rows["next.done"].tolist() == [False] * 11 + [True]
    env.close()


@pytest.mark.sim
def test_meta_data_describe_the_columns_the_episodes_and_the_videos(dataset):
    info = json.loads((dataset / "meta" / "info.json").read_text())
    table, episodes = pd.read_parquet(dataset / "data"), pd.read_parquet(dataset / "meta" / "episodes")
    assert set(info["features"]) == {*table.columns, *VIDEOS}
    assert (info["total_episodes"], info["total_frames"], info["fps"]) == (2, len(table), 25)
    assert episodes.scene_seed.tolist() == [0, 1]
    assert episodes.dataset_to_index.tolist() == episodes.length.cumsum().tolist()
    assert table["index"].tolist() == list(range(len(table)))
    tasks = pd.read_parquet(dataset / "meta" / "tasks.parquet")
    assert tasks.iloc[0].task_index == 0
    assert "pick up" in tasks.index[0]
    stats = json.loads((dataset / "meta" / "stats.json").read_text())
    state = np.stack(table["observation.state"])
    np.testing.assert_allclose(stats["observation.state"]["mean"], state.mean(axis=0), atol=1e-5)
    assert len(stats["observation.state"]["std"]) == len(NAMES["observation.state"])
    assert np.shape(stats[VIDEOS[0]]["mean"]) == (3, 1, 1)
    assert 0.0 < stats[VIDEOS[0]]["mean"][0][0][0] < 1.0


@pytest.mark.sim
def test_more_episodes_come_after_those_that_are_there(dataset):
    from fixation_gym.export.run import export

    before = pd.read_parquet(dataset / "data")
    summary = export(dataclasses.replace(CONFIG, episodes=3), dataset)
    after = pd.read_parquet(dataset / "data")
    assert summary["episodes_resumed"] == 2
    pd.testing.assert_frame_equal(after.iloc[: len(before)], before)
    assert set(after.episode_index) == {0, 1, 2}


@pytest.mark.parametrize(
    ("change", "message"), [({"format": "rlds"}, "choose one of lerobot"), ({"policy": "nobody"}, "unknown policy")]
)
def test_bad_input_is_refused_before_anything_is_recorded(change, message):
    with pytest.raises(UsageError, match=message):
        dataclasses.replace(CONFIG, **change).check()


@pytest.mark.sim
def test_a_folder_of_other_episodes_is_not_touched(dataset):
    from fixation_gym.export.run import export

    with pytest.raises(UsageError, match="holds another run, with seed 0 instead of 5"):
        export(dataclasses.replace(CONFIG, seed=5), dataset)
