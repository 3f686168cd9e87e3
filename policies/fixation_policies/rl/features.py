"""The feature extractor: a small CNN on the view, joined with the vector."""

from __future__ import annotations

import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import nn

_UNKNOWN = 128.0 / 255.0


class JoinedFeatures(BaseFeaturesExtractor):
    """Vector, and 64 features of the view if there is one. SB3 hands over images in [0, 1]; 0 here is "unknown"."""

    def __init__(self, observation_space: spaces.Dict) -> None:
        """Build for an ``input_space``."""
        vector = observation_space["vector"].shape
        assert vector is not None
        view = observation_space["view"].shape if "view" in observation_space.spaces else None
        super().__init__(observation_space, features_dim=vector[0] + (0 if view is None else 64))
        self.view = None if view is None else _cnn(*view)

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """Features, shape (n, ``features_dim``)."""
        if self.view is None:
            return observations["vector"]
        view = self.view(2.0 * (observations["view"] - _UNKNOWN))
        return torch.cat([observations["vector"], view], dim=1)


def _cnn(channels: int, height: int, width: int) -> nn.Module:
    """One convolution of 4x4 cells and a dense layer.

    A gradient step is most of what learning costs on a CPU, and a second convolution doubles the time of it.
    """
    return nn.Sequential(
        nn.Conv2d(channels, 16, 4, stride=4),
        nn.ReLU(),
        nn.Flatten(),
        nn.Linear(16 * (height // 4) * (width // 4), 64),
        nn.LayerNorm(64),
        nn.Tanh(),
    )
