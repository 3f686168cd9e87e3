"""Random changes of batches of images, as practitioners make them, so that a learner does not learn pixels by heart."""

from __future__ import annotations

import math

import torch
from torch import Tensor
from torch.nn import functional

_SHIFT = 4
"""Largest shift along each axis, px: that of DrQ (Kostrikov et al. 2020)."""
_JITTER = 0.3
"""Largest relative change of brightness, contrast and saturation, and largest turn of the hue as a share of a full
one: those of robomimic's ColorRandomizer (Mandlekar et al. 2021)."""
_YIQ = torch.tensor([[0.299, 0.587, 0.114], [0.5959, -0.2746, -0.3213], [0.2115, -0.5227, 0.3112]])
"""From red, green and blue to brightness and the plane of colours, in which hues turn."""
_RGB = torch.linalg.inv(_YIQ)


def shifted(images: Tensor) -> Tensor:
    """Each image moved by up to 4 px along both axes; its border is repeated. Shape (n, channels, h, w)."""
    count, _, height, width = images.shape
    padded = functional.pad(images, (_SHIFT,) * 4, mode="replicate")
    corners = torch.randint(0, 2 * _SHIFT + 1, (count, 2)).tolist()
    pairs = zip(padded, corners, strict=True)
    return torch.stack([image[:, top : top + height, left : left + width] for image, (top, left) in pairs])


def jittered(images: Tensor) -> Tensor:
    """Each stack of images in other colours, the same for all images of a stack.

    Args:
        images: shape (n, 3 k, h, w), k images of red, green and blue within 0..1.
    """
    count, channels, height, width = images.shape
    brightness, contrast, saturation = 1.0 + _JITTER * _uniform(3, count)
    hue = 2.0 * math.pi * _JITTER * _uniform(count)
    turn = torch.zeros(count, 3, 3)
    turn[:, 0, 0] = 1.0
    turn[:, 1, 1] = turn[:, 2, 2] = saturation * torch.cos(hue)
    turn[:, 2, 1] = saturation * torch.sin(hue)
    turn[:, 1, 2] = -turn[:, 2, 1]
    change = brightness[:, None, None] * (_RGB @ turn @ _YIQ)
    pixels = images.reshape(count, channels // 3, 3, height * width)
    # The mean grey level of the coloured stack stays where it is when its contrast changes: one product does both.
    middle = (change @ pixels.mean(dim=(1, 3))[:, :, None]).mean(dim=(1, 2))
    coloured = (contrast[:, None, None] * change)[:, None] @ pixels
    coloured += ((1.0 - contrast) * middle)[:, None, None, None]
    return coloured.clamp_(0.0, 1.0).reshape(images.shape)


def _uniform(*shape: int) -> Tensor:
    """Random numbers within -1..1."""
    return 2.0 * torch.rand(*shape) - 1.0
