"""Checkpoints: whole or not there, the last good one stays, and a run goes on from it as it was."""

import errno
import json
import resource
from dataclasses import replace

import numpy as np
import pytest
from rl_fakes import FakeZFC
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv

from fixation_gym.cli import main
from fixation_gym.errors import UsageError
from fixation_gym.evaluation.files import write_json
from fixation_gym.evaluation.storage import RUN_FILE
from fixation_policies.rl import train as training
from fixation_policies.rl.checkpoints import Progress, latest_checkpoint, load_model, read_progress, save_checkpoint
from fixation_policies.rl.config import TRAIN_SEEDS, TrainConfig
from fixation_policies.rl.decisions import DecisionEnv, FixedEpisodes
from fixation_policies.rl.environments import closing, draw_new_scenes, worker_deaths
from fixation_policies.rl.overlap import BusyEnvs
from fixation_policies.rl.train import agent_weights, make_model

CONFIG = TrainConfig(buffer_size=50)
PPO_CONFIG = replace(CONFIG, algorithm="ppo")


def fake_env():
    return DecisionEnv(FakeZFC(40))


@pytest.fixture
def model():
    model = make_model(CONFIG, DummyVecEnv([fake_env, fake_env]), None)
    model.learn(20)
    return model


def save(folder, model, decisions):
    return save_checkpoint(folder, model, Progress(decisions, env_steps=5 * decisions, curve=[{"decisions": 1}]))


def test_a_checkpoint_holds_model_buffer_and_progress(tmp_path, model):
    saved = save(tmp_path, model, 20)
    again = load_model(saved, SAC, env=DummyVecEnv([fake_env, fake_env]))
    assert read_progress(saved) == Progress(20, env_steps=100, curve=[{"decisions": 1}])
    assert again.num_timesteps == model.num_timesteps
    inputs = model.get_env().reset()
    np.testing.assert_array_equal(
        again.predict(inputs, deterministic=True)[0], model.predict(inputs, deterministic=True)[0]
    )
    assert (again.replay_buffer.pos, again.replay_buffer.full) == (model.replay_buffer.pos, model.replay_buffer.full)
    for key, array in model.replay_buffer.observations.items():
        np.testing.assert_array_equal(again.replay_buffer.observations[key], array)
    np.testing.assert_array_equal(again.replay_buffer.rewards, model.replay_buffer.rewards)
    assert again.replay_buffer.rewards.any()


def test_ppo_learns_and_its_checkpoint_acts_as_it_does(tmp_path):
    envs = DummyVecEnv([fake_env, fake_env])
    model = make_model(PPO_CONFIG, envs, None)
    before = agent_weights(PPO_CONFIG, model)
    model.learn(1024)
    assert all((weights != before[name]).any() for name, weights in agent_weights(PPO_CONFIG, model).items())
    again = load_model(save(tmp_path, model, 1024), PPO, env=envs)
    inputs = envs.reset()
    np.testing.assert_array_equal(
        again.predict(inputs, deterministic=True)[0], model.predict(inputs, deterministic=True)[0]
    )


@pytest.mark.parametrize("resumed", [False, True])
def test_scenes_of_training_are_those_of_training_alone(tmp_path, resumed):
    # SB3 seeds environments with the run's seed, 0, 1, ..: scenes of `evaluate`, and of other runs.
    envs = DummyVecEnv([lambda: FixedEpisodes(fake_env(), [5]), lambda: FixedEpisodes(fake_env(), [5])])
    busy = BusyEnvs(envs)
    model = make_model(CONFIG, busy, None)
    if resumed:
        model = load_model(save(tmp_path, model, 0), SAC, env=busy)
    draw_new_scenes(busy, CONFIG, 0)
    model.set_env(busy, force_reset=True)
    model.learn(20)
    seeds = [seed for env in envs.envs for seed in env.unwrapped.seeds if seed is not None]
    assert len(seeds) == 2
    assert min(seeds) >= TRAIN_SEEDS


def test_a_newer_checkpoint_replaces_the_older(tmp_path, model):
    save(tmp_path, model, 20)
    (tmp_path / "checkpoint-0000000030.unfinished").mkdir()
    newer = save(tmp_path, model, 40)
    assert latest_checkpoint(tmp_path) == newer
    assert [path.name for path in tmp_path.iterdir()] == [newer.name]


def test_a_full_disk_leaves_the_earlier_checkpoint_intact(tmp_path, model):
    earlier = save(tmp_path, model, 20)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, limits[1]))  # as if the disk had so much room
    try:
        with pytest.raises(UsageError, match=rf"cannot write a checkpoint .*; the last one, {earlier.name}, is intact"):
            save(tmp_path, model, 40)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert [path.name for path in tmp_path.iterdir()] == [earlier.name]
    assert load_model(earlier, SAC).num_timesteps == model.num_timesteps


def test_a_kill_amid_a_save_leaves_what_counts_as_none(tmp_path, model):
    earlier = save(tmp_path, model, 20)
    (tmp_path / "checkpoint-0000000040.unfinished").mkdir()
    assert latest_checkpoint(tmp_path) == earlier


@pytest.mark.parametrize("file", ["model.zip", "replay.npz", "progress.json"])
def test_a_damaged_checkpoint_is_named(tmp_path, model, file):
    saved = save(tmp_path, model, 20)
    (saved / file).write_bytes((saved / file).read_bytes()[:100])
    read = read_progress if file == "progress.json" else lambda path: load_model(path, SAC)
    with pytest.raises(UsageError, match=f"the checkpoint .*{saved.name} is damaged"):
        read(saved)


def train(*options):
    return main(["train", "--steps", "2000", *options])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--config", "sonar"), "unknown configuration 'sonar'; choose one of zfc, ways, blind, rgb, depth, "),
        (("--algorithm", "dqn"), "choose one of sac, ppo"),
        (("--workers", "0"), "--workers must be at least 1"),
        (("--seed", "-1"), "--seed must be within 0..999"),
        (("--steps", "1004"), "--steps must be above 1004, since SAC learns after so many random ones, got 1004"),
        (("--resume",), "holds no training run to resume"),
    ],
)
def test_bad_options_end_in_one_line(tmp_path, options, message, capsys):
    assert train(*options, "--out", str(tmp_path / "run")) == 2
    error = capsys.readouterr().err
    assert message in error
    assert len(error.splitlines()) == 1
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "add --resume to go on with it"),
        (("--config", "blind", "--resume"), "holds another run, with config zfc instead of blind"),
    ],
)
def test_a_folder_with_a_run_is_not_mixed_with_another(tmp_path, options, message, capsys):
    write_json(tmp_path / RUN_FILE, TrainConfig(steps=99).identity())
    before = json.loads((tmp_path / RUN_FILE).read_text())
    assert train(*options, "--out", str(tmp_path)) == 2
    assert message in capsys.readouterr().err
    assert json.loads((tmp_path / RUN_FILE).read_text()) == before


@pytest.mark.parametrize("options", [(), ("--resume",)])
def test_checkpoints_of_a_run_that_is_not_described_are_left_alone(tmp_path, options, capsys, model):
    earlier = save(tmp_path, model, 20)
    assert train(*options, "--out", str(tmp_path)) == 2
    assert f"has {earlier.name} but no run.json" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [earlier]


@pytest.mark.parametrize("curve", [[], [{"decisions": 1500}]])
def test_no_more_steps_than_a_run_has_are_refused_if_its_agent_was_not_evaluated_since(tmp_path, capsys, model, curve):
    write_json(tmp_path / RUN_FILE, TrainConfig().identity())
    save_checkpoint(tmp_path, model, Progress(2000, curve=curve))
    assert train("--resume", "--out", str(tmp_path)) == 2
    assert "has 2000 decisions already; --steps must be above that" in capsys.readouterr().err


def test_a_disk_that_fills_up_is_reported_in_one_line_with_what_is_left(tmp_path, monkeypatch, capsys):
    def learn(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(training, "_learn", learn)
    assert train("--out", str(tmp_path / "run")) == 2
    error = capsys.readouterr().err
    assert "cannot write to" in error
    assert "(No space left on device); there is no checkpoint yet" in error
    assert len(error.splitlines()) == 1


def dying_env():
    return DecisionEnv(FakeZFC(40, dies_at=7))


def step_until_death(envs):
    with worker_deaths(lambda: "go on"), closing(envs):
        envs.reset()
        for _ in range(3):
            envs.step(np.zeros((2, 4), np.float32))


def test_a_killed_worker_is_reported_and_the_others_end():
    envs = SubprocVecEnv([fake_env, dying_env], start_method="spawn")
    with pytest.raises(UsageError, match=r"a worker process ended.*; go on"):
        step_until_death(envs)
    assert not any(process.is_alive() for process in envs.processes)
