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
    """Two convolutions of 4x4 and 2x2 cells and a dense layer.

    Their windows do not overlap, so that a convolution is a rearrangement and one matrix product, several times as
    fast on a CPU as a small convolution.
    """
    return nn.Sequential(
        nn.PixelUnshuffle(4),
        nn.Conv2d(16 * channels, 16, 1),
        nn.ReLU(),
        nn.PixelUnshuffle(2),
        nn.Conv2d(64, 32, 1),
        nn.ReLU(),
        nn.Flatten(),
        nn.Linear(32 * (height // 8) * (width // 8), 64),
        nn.LayerNorm(64),
        nn.Tanh(),
    )
