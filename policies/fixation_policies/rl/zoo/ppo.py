"""PPO for rl-zoo3, with the settings of ``fixation-gym train``. ``sac`` says what ``FixationPick-v0`` is for."""

from __future__ import annotations

from typing import Any

from fixation_policies.rl.hyperparameters import GAMMA, PPO_SETTINGS
from fixation_policies.rl.inputs import PERIODS

_COMMON: dict[str, Any] = {**PPO_SETTINGS, "policy": "MultiInputPolicy", "n_envs": 4}
hyperparams: dict[str, dict[str, Any]] = {
    "FixationPickZFC-v0": {
        **_COMMON,
        "env_wrapper": "fixation_policies.rl.decisions.DecisionEnv",
        "env_kwargs": {"scenario": "mixed", "observation": "zfc", "image_size": (96, 128)},
        "n_timesteps": 200_000,
    },
    "FixationPick-v0": {
        **_COMMON,
        "gamma": GAMMA ** (1.0 / PERIODS),  # per control step
        "policy_kwargs": {"net_arch": [256, 256], "log_std_init": -0.5},
        "env_kwargs": {"scenario": "clear", "image_size": (48, 64)},
        "n_timesteps": 1_000_000,
    },
}
