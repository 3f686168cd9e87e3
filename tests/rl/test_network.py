"""The networks in NumPy against SB3's own, and agents where there is no PyTorch."""

import subprocess
import sys
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
import torch
from stable_baselines3.common.vec_env import DummyVecEnv

from fixation_policies.rl.agent_file import AgentCard, write_agent
from fixation_policies.rl.config import CONFIGS, TrainConfig
from fixation_policies.rl.inputs import input_space
from fixation_policies.rl.network import action, weight_shapes
from fixation_policies.rl.train import agent_weights, make_model


class InputsOnly(gym.Env):
    """Has the spaces that a learner sees, and is never stepped."""

    def __init__(self, learner):
        self.observation_space = input_space(learner)
        self.action_space = gym.spaces.Box(-1.0, 1.0, (2 if learner.residual else 4,), np.float32)


@pytest.mark.parametrize("algorithm", ["sac", "ppo"])
@pytest.mark.parametrize("name", CONFIGS)
def test_actions_are_those_of_sb3(name, algorithm):
    learner = CONFIGS[name]
    config = replace(TrainConfig(buffer_size=10), config=name, algorithm=algorithm)
    model = make_model(config, DummyVecEnv([lambda: InputsOnly(learner)]), None)
    torch.manual_seed(0)
    with torch.no_grad():  # weights as large as those of trained agents, so that actions cover their range
        for weights in model.policy.parameters():
            weights.normal_(0.0, 1.0 / max(weights.shape[-1], 16) ** 0.5)
    weights = agent_weights(config, model)
    space = model.observation_space
    space.seed(0)
    actions = []
    for _ in range(50):
        inputs = space.sample()
        inputs["vector"] = np.random.default_rng(len(actions)).normal(size=inputs["vector"].shape).astype(np.float32)
        expected = model.predict(inputs, deterministic=True)[0]
        actions.append(action(algorithm, learner, weights, inputs))
        np.testing.assert_allclose(actions[-1], expected, atol=1e-5)
    assert np.ptp(actions, axis=0).max() > 0.5
    assert all(array.dtype == np.float32 for array in (*weights.values(), *actions))


def test_shapes_are_those_of_the_weights():
    for name, learner in CONFIGS.items():
        for algorithm in ("sac", "ppo"):
            config = replace(TrainConfig(buffer_size=10), config=name, algorithm=algorithm)
            model = make_model(config, DummyVecEnv([lambda learner=learner: InputsOnly(learner)]), None)
            shapes = {key: array.shape for key, array in agent_weights(config, model).items()}
            assert shapes == weight_shapes(algorithm, learner, 2 if learner.residual else 4)


WITHOUT_TORCH = """
import sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("torch", "stable_baselines3", "tensorboard"):
            raise ModuleNotFoundError(name, name=name)

sys.meta_path.insert(0, Absent())
import importlib.util
real = importlib.util.find_spec
absent = ("torch", "stable_baselines3", "tensorboard")
importlib.util.find_spec = lambda name, *rest: None if name in absent else real(name, *rest)
from fixation_gym.cli import main
sys.exit(main(sys.argv[1:]))
"""


def without_torch(*arguments):
    command = [sys.executable, "-c", WITHOUT_TORCH, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("command", ["train", "compare", "transfer"])
def test_training_without_pytorch_ends_in_one_line(command, tmp_path):
    result = without_torch(command, "--out", str(tmp_path / "out"))
    assert result.returncode == 2
    assert result.stderr.strip() == (
        "fixation-gym: error: training needs the package torch, which is not installed: pip install 'fixation-gym[rl]'"
    )
    assert not (tmp_path / "out").exists()


@pytest.mark.sim
def test_an_agent_is_evaluated_without_pytorch(tmp_path):
    rng, shapes = np.random.default_rng(0), weight_shapes("sac", CONFIGS["zfc"], 4)
    weights = {name: rng.normal(0.0, 0.05, shape).astype(np.float32) for name, shape in shapes.items()}
    agent = tmp_path / "agent.zip"
    write_agent(agent, AgentCard("zfc", "sac", (48, 64), "clear", 0, 1, 9, {"numpy": "2"}), weights)
    options = ("--scenario", "clear", "--episodes", "1", "--out", str(tmp_path / "out"))
    result = without_torch("evaluate", "--policy", str(agent), *options)
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "out" / "summary.json").exists()
