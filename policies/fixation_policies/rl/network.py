"""The networks of agents in NumPy: the actions of SB3's policies, without PyTorch.

Names of weights are those of SB3's state dicts; ``features`` has the part that looks, as it is trained.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from fixation_policies.rl.config import HIDDEN, UNKNOWN, VIEW_FEATURES, Configuration
from fixation_policies.rl.inputs import input_space

Weights = Mapping[str, NDArray[np.float32]]

_LOOKING = "features_extractor.view"
_LAYERS = {
    "sac": ("latent_pi.0", "latent_pi.2", "mu"),
    "ppo": ("mlp_extractor.policy_net.0", "mlp_extractor.policy_net.2", "action_net"),
}
"""Dense layers from features to action, by algorithm."""
_EPSILON = 1e-5
"""Of the layer norm."""


def acting_weights(algorithm: str, learner: Configuration, weights: Weights) -> Weights:
    """Copies of those of SB3's weights that acting needs."""
    return {name: np.array(weights[name], np.float32) for name in weight_shapes(algorithm, learner, 1)}


def weight_shapes(algorithm: str, learner: Configuration, actions: int) -> dict[str, tuple[int, ...]]:
    """Shapes of all weights of a network that gives so many actions."""
    space = input_space(learner)
    vector, view = (space[key].shape if key in space.spaces else None for key in ("vector", "view"))
    assert vector is not None
    shapes, features = {}, vector[0]
    if view is not None:
        shapes, features = _looking_shapes(view, learner), vector[0] + VIEW_FEATURES
    for layer, (before, after) in zip(
        _LAYERS[algorithm], ((features, HIDDEN), (HIDDEN, HIDDEN), (HIDDEN, actions)), strict=True
    ):
        shapes |= {f"{layer}.weight": (after, before), f"{layer}.bias": (after,)}
    return shapes


def _looking_shapes(view: tuple[int, ...], learner: Configuration) -> dict[str, tuple[int, ...]]:
    channels, height, width = view
    shapes: dict[str, tuple[int, ...]] = {}
    for index, (features, size, stride) in enumerate(learner.convolutions):
        shapes[f"{_LOOKING}.{2 * index}.weight"] = (features, channels, size, size)
        shapes[f"{_LOOKING}.{2 * index}.bias"] = (features,)
        channels, height, width = features, (height - size) // stride + 1, (width - size) // stride + 1
    dense, norm = _dense_and_norm(learner)
    shapes |= {f"{dense}.weight": (VIEW_FEATURES, channels * height * width), f"{dense}.bias": (VIEW_FEATURES,)}
    return shapes | {f"{norm}.weight": (VIEW_FEATURES,), f"{norm}.bias": (VIEW_FEATURES,)}


def _dense_and_norm(learner: Configuration) -> tuple[str, str]:
    """Names of the layers behind the convolutions, each with its ReLU, and the flattening."""
    after = 2 * len(learner.convolutions) + 1
    return f"{_LOOKING}.{after}", f"{_LOOKING}.{after + 1}"


def action(
    algorithm: str, learner: Configuration, weights: Weights, inputs: Mapping[str, NDArray[Any]]
) -> NDArray[np.float32]:
    """The action without noise, within -1..1, for an element of ``input_space``."""
    features = inputs["vector"]
    if "view" in inputs:
        features = np.concatenate([features, _view_features(learner, weights, inputs["view"])])
    first, second, last = _LAYERS[algorithm]
    for layer in (first, second):
        features = _dense(weights, layer, features)
        features = np.maximum(features, 0.0) if algorithm == "sac" else np.tanh(features)
    mean = _dense(weights, last, features)
    return np.tanh(mean) if algorithm == "sac" else np.clip(mean, -1.0, 1.0)


def _view_features(learner: Configuration, weights: Weights, view: NDArray[np.uint8]) -> NDArray[np.float32]:
    layer = 2.0 * (view.astype(np.float32) / np.float32(255.0) - np.float32(UNKNOWN))
    for index, (_, size, stride) in enumerate(learner.convolutions):
        windows = sliding_window_view(layer, (size, size), axis=(1, 2))[:, ::stride, ::stride]
        name = f"{_LOOKING}.{2 * index}"
        layer = np.tensordot(weights[f"{name}.weight"], windows, ((1, 2, 3), (0, 3, 4)))
        layer = np.maximum(layer + weights[f"{name}.bias"][:, None, None], 0.0)
    dense, norm = _dense_and_norm(learner)
    features = _dense(weights, dense, layer.ravel())
    centred = features - features.mean()
    scaled = centred / np.sqrt(np.mean(centred**2) + np.float32(_EPSILON))
    return np.tanh(weights[f"{norm}.weight"] * scaled + weights[f"{norm}.bias"])


def _dense(weights: Weights, layer: str, features: NDArray[np.float32]) -> NDArray[np.float32]:
    return weights[f"{layer}.weight"] @ features + weights[f"{layer}.bias"]
