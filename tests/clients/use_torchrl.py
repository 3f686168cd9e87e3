"""TorchRL: its checks, a rollout with values of info, a collector and a replay buffer."""

import torch
from torchrl.collectors import Collector
from torchrl.data import LazyTensorStorage, ReplayBuffer, Unbounded
from torchrl.envs import GymEnv, StepCounter, TransformedEnv
from torchrl.envs.libs.gym import default_info_dict_reader
from torchrl.envs.utils import check_env_specs

import fixation_gym  # noqa: F401

if __name__ == "__main__":
    env = TransformedEnv(GymEnv("FixationPickZFC-v0", image_size=(64, 80)), StepCounter(max_steps=8))
    flags = {name: Unbounded((), dtype=torch.bool) for name in ("success", "collision")}
    env.base_env.set_info_dict_reader(default_info_dict_reader(list(flags), spec=flags))
    check_env_specs(env)
    assert env.rollout(6)["next", "zfc_map"].shape == (6, 1, 32, 32)
    buffer = ReplayBuffer(storage=LazyTensorStorage(32), batch_size=8)
    collector = Collector(env, policy=None, frames_per_batch=8, total_frames=16)
    for batch in collector:
        buffer.extend(batch)
    collector.shutdown()
    assert buffer.sample()["next", "reward"].shape == (8, 1)
