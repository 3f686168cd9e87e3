"""What things are made of, as values, and as descriptions of Mitsuba's materials.

Colours are those that the simulator shows, sRGB within 0..1; Mitsuba computes with linear ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from fixation_gym.types import FloatArray

Finish = Literal["matt", "gloss", "lacquer", "glass", "mirror", "chrome", "brushed", "plastic"]
AIR, WATER, GLASS, ACRYLIC = 1.0, 1.333, 1.5, 1.49
"""Indices of refraction."""
_TINT = 0.25
"""How much of its colour a thing of clear glass takes from the simulator's see-through one."""
_GLOSS, _SATIN = 0.25, 0.3
"""Roughness of glossy surfaces and of thin plastic: width of the distribution of their normals."""
_BRUSHED = (0.08, 0.35)
"""Roughness of brushed metal along its scratches and across."""
_SILVER = 0.85
"""Share of light that mirrors reflect, as in the simulator."""


@dataclass(frozen=True)
class Material:
    """One material; equal ones are made once."""

    finish: Finish
    rgb: tuple[float, float, float] = (1.0, 1.0, 1.0)
    texture: int = -1
    """Index of the model's texture, which ``rgb`` tints; -1 for none."""
    inside: float = GLASS
    """Index of refraction behind the surface, of what is see-through."""
    outside: float = AIR
    """Index of refraction where its normals point to."""


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
    tint = _colour(1.0 - _TINT + _TINT * np.array(material.rgb))
    described: dict[Finish, dict[str, Any]] = {
        "matt": {"type": "diffuse", "reflectance": colour},
        "gloss": {"type": "roughplastic", "diffuse_reflectance": colour, "alpha": _GLOSS, "nonlinear": True},
        "lacquer": {"type": "plastic", "diffuse_reflectance": colour, "nonlinear": True},
        "glass": {"type": "dielectric", "specular_transmittance": tint},
        "mirror": {"type": "conductor", "material": "none", "specular_reflectance": _colour(np.full(3, _SILVER))},
        "chrome": {"type": "conductor", "material": "Cr"},
        "brushed": {"type": "roughconductor", "material": "Al", "alpha_u": _BRUSHED[0], "alpha_v": _BRUSHED[1]},
        "plastic": {"type": "principledthin", "base_color": colour, "roughness": _SATIN, "diff_trans": 1.0},
    }
    return described[material.finish] | _refraction(material)


def _refraction(material: Material) -> dict[str, Any]:
    if material.finish == "glass":
        return {"int_ior": material.inside, "ext_ior": material.outside}
    if material.finish in ("gloss", "lacquer"):
        return {"int_ior": ACRYLIC}
    return {"eta": ACRYLIC, "spec_trans": 0.3} if material.finish == "plastic" else {}


def _colour(rgb: FloatArray) -> dict[str, Any]:
    return {"type": "rgb", "value": linear(rgb).tolist()}
