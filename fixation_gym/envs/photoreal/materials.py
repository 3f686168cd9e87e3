"""What things are made of, as values, and as descriptions of Mitsuba's materials.

Colours are those that the simulator shows, sRGB within 0..1; Mitsuba computes with linear ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from fixation_gym.types import FloatArray

Finish = Literal["matt", "gloss", "glass", "mirror"]
GLASS_IOR, PLASTIC_IOR = 1.5, 1.49
"""Indices of refraction of window glass and of acrylic glass."""
_TINT = 0.25
"""How much of its colour a thing of clear glass takes from the simulator's see-through one."""
_ROUGHNESS = 0.25
"""Of glossy surfaces: width of the distribution of their normals (Beckmann)."""
_SILVER = 0.85
"""Share of light that mirrors reflect, as in the simulator."""


@dataclass(frozen=True)
class Material:
    """One material; equal ones are made once."""

    finish: Finish
    rgb: tuple[float, float, float]
    texture: int = -1
    """Index of the model's texture, which ``rgb`` tints; -1 for none."""


def linear(srgb: FloatArray) -> FloatArray:
    """Linear intensities of sRGB values within 0..1, of the same shape."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def srgb(intensities: FloatArray) -> FloatArray:
    """Linear intensities as sRGB values within 0..1; what is brighter than 1 is cut off."""
    clipped = np.clip(intensities, 0.0, 1.0)
    return np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)


def bsdf(material: Material, texture: Any = None) -> dict[str, Any]:
    """Description of the material for ``mitsuba.load_dict``.

    Args:
        material: what to describe.
        texture: Mitsuba's texture of it, if it has one.
    """
    colour = texture if texture is not None else _colour(np.array(material.rgb))
    if material.finish == "matt":
        return {"type": "diffuse", "reflectance": colour}
    if material.finish == "gloss":
        gloss = {"type": "roughplastic", "distribution": "beckmann", "alpha": _ROUGHNESS, "int_ior": PLASTIC_IOR}
        return gloss | {"diffuse_reflectance": colour, "nonlinear": True}
    if material.finish == "mirror":
        return {"type": "conductor", "material": "none", "specular_reflectance": _colour(np.full(3, _SILVER))}
    tint = 1.0 - _TINT + _TINT * np.array(material.rgb)
    return {"type": "dielectric", "int_ior": GLASS_IOR, "ext_ior": 1.0, "specular_transmittance": _colour(tint)}


def _colour(rgb: FloatArray) -> dict[str, Any]:
    return {"type": "rgb", "value": linear(rgb).tolist()}
