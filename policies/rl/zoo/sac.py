"""SAC for rl-zoo3, with the settings of ``fixation-gym train``; learning and acting alternate, as zoo has it."""

from __future__ import annotations

from typing import Any

from policies.rl.hyperparameters import SAC_SETTINGS

hyperparams: dict[str, dict[str, Any]] = {
    "FixationPickZFC-v0": {
        **SAC_SETTINGS,
        "policy": "MultiInputPolicy",
        "env_wrapper": "policies.rl.decisions.DecisionEnv",
        "env_kwargs": {"scenario": "mixed", "observation": "zfc", "image_size": (96, 128)},
        "n_timesteps": 8_000,
        "n_envs": 4,
        "buffer_size": 50_000,
        "learning_starts": 1000,
        "gradient_steps": -1,
    }
}
