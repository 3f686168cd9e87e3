"""Settings of the algorithms, the same for every configuration but for its network. rl-zoo3 reads them, too."""

from __future__ import annotations

from typing import Any

from fixation_policies.rl.config import HIDDEN, Configuration
from fixation_policies.rl.features import JoinedFeatures

GAMMA = 0.98
"""Per decision: what lies 10 s ahead counts a third."""

SAC_SETTINGS: dict[str, Any] = {
    "gamma": GAMMA,
    "learning_rate": 5e-4,
    "batch_size": 128,
    "tau": 0.01,
    "train_freq": 1,
    "gradient_steps": 0,  # those of fixation_policies.rl.overlap take place while the environments step
    "ent_coef": "auto_0.1",
    "policy_kwargs": {"features_extractor_class": JoinedFeatures, "net_arch": [HIDDEN, HIDDEN]},
}
PPO_SETTINGS: dict[str, Any] = {
    "gamma": GAMMA,
    "learning_rate": 3e-4,
    "n_steps": 512,
    "batch_size": 256,
    "n_epochs": 10,
    "gae_lambda": 0.95,
    "ent_coef": 0.002,
    "policy_kwargs": {"features_extractor_class": JoinedFeatures, "net_arch": [HIDDEN, HIDDEN], "log_std_init": -0.5},
}


def settings_of(algorithm: str, learner: Configuration) -> dict[str, Any]:
    """Settings of an algorithm with the network of a configuration."""
    settings = PPO_SETTINGS if algorithm == "ppo" else SAC_SETTINGS
    network = {"convolutions": learner.convolutions, "augmented": learner.augmented}
    return {**settings, "policy_kwargs": {**settings["policy_kwargs"], "features_extractor_kwargs": network}}
