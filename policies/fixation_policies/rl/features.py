"""The feature extractor: a small CNN on the view, joined with the vector. ``network`` runs the same in NumPy."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import nn

from fixation_policies.rl.augmentation import jittered, shifted
from fixation_policies.rl.config import UNKNOWN, VIEW_FEATURES, Configuration, Convolution


class JoinedFeatures(BaseFeaturesExtractor):
    """Vector, and 64 features of the view if there is one. SB3 hands over images in [0, 1]; 0 here is "unknown"."""

    def __init__(
        self,
        observation_space: spaces.Dict,
        convolutions: Sequence[Convolution] = Configuration.convolutions,
        augmented: bool = False,
    ) -> None:
        """Build for an ``input_space``.

        Args:
            observation_space: of the inputs.
            convolutions: of the view.
            augmented: whether views are images that change at random while a network learns.
        """
        vector = observation_space["vector"].shape
        assert vector is not None
        view = observation_space["view"].shape if "view" in observation_space.spaces else None
        super().__init__(observation_space, features_dim=vector[0] + (0 if view is None else VIEW_FEATURES))
        self.view = None if view is None else _cnn(view[0], view[1], view[2], convolutions)
        self._augmented = augmented

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """Features, shape (n, ``features_dim``)."""
        if self.view is None:
            return observations["vector"]
        pixels = observations["view"]
        if self._augmented and self.training:  # not while it acts, and never in SAC's target networks
            pixels = jittered(shifted(pixels))
        view = self.view(2.0 * (pixels - UNKNOWN))
        return torch.cat([observations["vector"], view], dim=1)


def _cnn(channels: int, height: int, width: int, convolutions: Sequence[Convolution]) -> nn.Module:
    """Convolutions and a dense layer."""
    layers: list[nn.Module] = []
    for features, size, stride in convolutions:
        layers += [nn.Conv2d(channels, features, size, stride=stride), nn.ReLU()]
        channels, height, width = features, (height - size) // stride + 1, (width - size) // stride + 1
    dense = nn.Linear(channels * height * width, VIEW_FEATURES)
    return nn.Sequential(*layers, nn.Flatten(), dense, nn.LayerNorm(VIEW_FEATURES), nn.Tanh())
