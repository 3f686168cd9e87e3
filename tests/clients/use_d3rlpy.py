"""d3rlpy learns off line from recorded steps, and on line; its networks take one vector."""

import d3rlpy
import gymnasium as gym
import numpy as np

import fixation_gym  # noqa: F401

if __name__ == "__main__":
    env = gym.make("FixationPickZFC-v0", image_size=(64, 80), max_episode_steps=10)
    env = gym.wrappers.FlattenObservation(env)
    seen, actions, rewards = [], [], []
    for seed in range(2):
        obs, _ = env.reset(seed=seed)
        for _ in range(10):
            seen.append(obs)
            actions.append(env.action_space.sample())
            obs, reward, *_ = env.step(actions[-1])
            rewards.append(reward)
    ends = np.arange(20) % 10 == 9
    dataset = d3rlpy.dataset.MDPDataset(
        np.array(seen), np.array(actions), np.array(rewards), terminals=np.zeros(20), timeouts=ends
    )
    quiet = {"logger_adapter": d3rlpy.logging.NoopAdapterFactory(), "show_progress": False}
    off_line = d3rlpy.algos.CQLConfig(batch_size=4).create(device="cpu:0")
    off_line.fit(dataset, n_steps=4, n_steps_per_epoch=2, **quiet)
    on_line = d3rlpy.algos.SACConfig(batch_size=4).create(device="cpu:0")
    buffer = d3rlpy.dataset.create_fifo_replay_buffer(100, env=env)
    on_line.fit_online(env, buffer, n_steps=20, n_steps_per_epoch=20, update_start_step=8, **quiet)
    assert off_line.predict(np.array(seen[:1])).shape == (1, 4)
    assert buffer.transition_count >= 10
