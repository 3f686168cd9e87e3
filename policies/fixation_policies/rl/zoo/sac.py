"""SAC for rl-zoo3, with the settings of ``fixation-gym train``; learning and acting alternate, as zoo has it.

``FixationPick-v0`` is for those who want the plain task: twists of the camera at 25 Hz, from image and joints, with no
servo law to help and every control step a decision. Nobody has shown that it is learned this way.
"""

from __future__ import annotations

from typing import Any

from fixation_policies.rl.hyperparameters import GAMMA, SAC_SETTINGS
from fixation_policies.rl.inputs import PERIODS

_COMMON: dict[str, Any] = {
    **SAC_SETTINGS,
    "policy": "MultiInputPolicy",
    "n_envs": 4,
    "buffer_size": 50_000,
    "learning_starts": 1000,
    "gradient_steps": -1,
}
hyperparams: dict[str, dict[str, Any]] = {
    "FixationPickZFC-v0": {
        **_COMMON,
        "env_wrapper": "fixation_policies.rl.decisions.DecisionEnv",
        "env_kwargs": {"scenario": "mixed", "observation": "zfc", "image_size": (96, 128)},
        "n_timesteps": 8_000,
    },
    "FixationPick-v0": {
        **_COMMON,
        "gamma": GAMMA ** (1.0 / PERIODS),  # per control step
        "policy_kwargs": {"net_arch": [256, 256]},
        "env_kwargs": {"scenario": "clear", "image_size": (48, 64)},
        "n_timesteps": 200_000,
    },
}
