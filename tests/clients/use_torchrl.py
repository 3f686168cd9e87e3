"""TorchRL: its checks, a rollout with all of info, a collector and a replay buffer."""

import torch
from torchrl.collectors import Collector
from torchrl.data import LazyTensorStorage, ReplayBuffer
from torchrl.envs import GymEnv, StepCounter, TransformedEnv
from torchrl.envs.utils import check_env_specs

import fixation_gym  # noqa: F401

TERMS = ("reward_progress", "reward_time", "reward_success", "reward_collision")

if __name__ == "__main__":
    for env_id in ("FixationPick-v0", "FixationPickZFC-v0"):
        registered = GymEnv(env_id, image_size=(64, 80)).auto_register_info_dict()
        env = TransformedEnv(registered, StepCounter(max_steps=8))
        check_env_specs(env)
        after = env.rollout(6)["next"]
        assert after["collision"].shape == (6,)
        assert after["collision"].dtype == torch.bool
        torch.testing.assert_close(sum(after[term] for term in TERMS).float(), after["reward"][:, 0])
        buffer = ReplayBuffer(storage=LazyTensorStorage(32), batch_size=8)
        collector = Collector(env, policy=None, frames_per_batch=8, total_frames=16)
        for batch in collector:
            buffer.extend(batch)
        collector.shutdown()
        assert buffer.sample()["next", "reward"].shape == (8, 1)
