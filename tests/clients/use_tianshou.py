"""PPO of Tianshou, in its vector environments: one process and several."""

import gymnasium as gym
import torch
from tianshou.algorithm import PPO
from tianshou.algorithm.modelfree.reinforce import ProbabilisticActorPolicy
from tianshou.algorithm.optim import AdamOptimizerFactory
from tianshou.data import Collector, VectorReplayBuffer
from tianshou.env import DummyVectorEnv, SubprocVectorEnv
from tianshou.utils.net.common import Net
from tianshou.utils.net.continuous import ContinuousActorProbabilistic, ContinuousCritic
from tianshou.utils.torch_utils import policy_within_training_step

import fixation_gym  # noqa: F401


def make():
    return gym.wrappers.FlattenObservation(gym.make("FixationPickZFC-v0", image_size=(64, 80), max_episode_steps=10))


def normal(parameters):
    return torch.distributions.Independent(torch.distributions.Normal(*parameters), 1)


if __name__ == "__main__":
    env = make()
    shape = env.observation_space.shape
    actor = ContinuousActorProbabilistic(
        preprocess_net=Net(state_shape=shape, hidden_sizes=[32]), action_shape=env.action_space.shape
    )
    policy = ProbabilisticActorPolicy(actor=actor, dist_fn=normal, action_space=env.action_space)
    critic = ContinuousCritic(preprocess_net=Net(state_shape=shape, hidden_sizes=[32]))
    algorithm = PPO(policy=policy, critic=critic, optim=AdamOptimizerFactory())
    before = next(actor.parameters()).clone()
    for vector in (DummyVectorEnv, SubprocVectorEnv):
        envs = vector([make, make])
        collector = Collector(algorithm, envs, VectorReplayBuffer(100, 2))
        collector.reset()
        assert collector.collect(n_step=20).n_collected_steps == 20
        with policy_within_training_step(policy):
            algorithm.update(collector.buffer, batch_size=10, repeat=1)
        envs.close()
    assert not torch.equal(before, next(actor.parameters()))
