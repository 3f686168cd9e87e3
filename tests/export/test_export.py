"""A data set of recorded episodes, read back by the libraries that its format belongs to."""

import dataclasses
import json
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest

import fixation_policies
from fixation_gym.errors import UsageError
from fixation_gym.export.config import ExportConfig
from fixation_gym.export.recording import NAMES, VIDEOS

pd = pytest.importorskip("pandas")
SMALL = (64, 80)
AGENT = next((Path(fixation_policies.__file__).parent / "agents").glob("zfc*.zip"))
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
def test_the_card_says_what_was_recorded_and_how(dataset):
    card = (dataset / "README.md").read_text()
    summary = json.loads((dataset / "summary.json").read_text())
    header, text = card.removeprefix("---\n").split("\n---\n")
    assert "- LeRobot" in header.splitlines()
    assert "# 2 episodes of `servo`" in text
    assert f"- Picked: {summary['successes']} of 2" in text
    assert f"Frames: {summary['frames']} at 25 Hz; pictures of 80x64 px" in text
    assert "| `clear` | 2 |" in text
    assert "--sensor-noise nominal --image-size 64 80 --renderer mujoco" in text
    assert f"mujoco {summary['versions']['mujoco']}" in text
    assert all(f"`{name}`" in text for name in (*NAMES, *VIDEOS))


@pytest.mark.sim
def test_more_episodes_come_after_those_that_are_there(dataset):
    from fixation_gym.export.run import export

    before = pd.read_parquet(dataset / "data")
    summary = export(dataclasses.replace(CONFIG, episodes=3), dataset)
    after = pd.read_parquet(dataset / "data")
    assert summary["episodes_resumed"] == 2
    pd.testing.assert_frame_equal(after.iloc[: len(before)], before)
    assert set(after.episode_index) == {0, 1, 2}


def assert_holds_what_the_policy_met(episode, env, policy, pictures):
    """Run the episode again and compare; pictures went through a video and JPEG."""
    seed = int(episode.id)  # episode i of seed 0
    obs, _ = env.reset(seed=seed)
    policy.reset(seed)
    for step in range(len(episode) + 1):
        for key, values in episode.observations.items():
            if key == "rgb":
                assert np.abs(values[step].astype(float) - obs[key]).mean() < 8.0
            else:
                np.testing.assert_array_equal(values[step], obs[key])
        assert ("rgb" in episode.observations) == pictures
        if step < len(episode):
            action = policy.act(obs)
            np.testing.assert_array_equal(episode.actions[step], action)
            percept = getattr(policy, "percept", None) or env.unwrapped.percept
            np.testing.assert_array_equal(episode.infos["zero_flow_map"][step], percept.zfc.cells)
            obs, reward, *_ = env.step(action)
            assert episode.rewards[step] == pytest.approx(reward)


@pytest.mark.sim
def test_minari_gets_the_same_recordings_bit_by_bit_but_for_pictures(dataset, monkeypatch):
    import minari

    from fixation_gym.export.run import export
    from fixation_policies.catalogue import make_policy

    summary = export(dataclasses.replace(CONFIG, format="minari"), dataset)
    assert summary["episodes_resumed"] == 2
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(dataset / "minari"))
    picks = minari.load_dataset("fixation/pick-v0")
    assert (picks.total_episodes, picks.total_steps) == (2, 24)
    assert [meta["seed"] for meta in picks.storage.get_episode_metadata([0, 1])] == [0, 1]
    assert [meta["scenario"] for meta in picks.storage.get_episode_metadata([0, 1])] == ["clear"] * 2
    env = picks.recover_environment(max_episode_steps=12)
    assert env.observation_space == picks.observation_space
    policy = make_policy("servo", env)
    for episode in picks.iterate_episodes():
        assert episode.truncations.tolist() == [False] * 11 + [True]
        assert not episode.terminations.any()
        assert_holds_what_the_policy_met(episode, env, policy, pictures=True)
    env.close()


@pytest.mark.sim
def test_minari_gets_what_an_agent_sees_in_the_environment_for_learners(tmp_path, monkeypatch):
    import gymnasium as gym
    import minari

    from fixation_gym.export.run import export
    from fixation_policies.catalogue import make_policy

    monkeypatch.setattr(gym.spec("FixationPickZFC-v0"), "max_episode_steps", 6)
    config = dataclasses.replace(CONFIG, policy=str(AGENT), episodes=1, format="minari")
    export(config, tmp_path / "set")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "set" / "minari"))
    episode = minari.load_dataset("fixation/pick-v0")[0]
    env = minari.load_dataset("fixation/pick-v0").recover_environment()
    assert episode.actions.shape == (6, 4)
    assert_holds_what_the_policy_met(episode, env, make_policy(str(AGENT), env), pictures=False)
    env.close()


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
