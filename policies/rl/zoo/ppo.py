"""PPO for rl-zoo3, with the settings of ``fixation-gym train``."""

from __future__ import annotations

from typing import Any

from policies.rl.hyperparameters import PPO_SETTINGS

hyperparams: dict[str, dict[str, Any]] = {
    "FixationPickZFC-v0": {
        **PPO_SETTINGS,
        "policy": "MultiInputPolicy",
        "env_wrapper": "policies.rl.decisions.DecisionEnv",
        "env_kwargs": {"scenario": "mixed", "observation": "zfc", "image_size": (96, 128)},
        "n_timesteps": 200_000,
        "n_envs": 4,
    }
}
