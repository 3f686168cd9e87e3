"""Single things that stand on the table, of every material, at scale 1."""

from __future__ import annotations

from fixation_gym.envs.part_rows import pane
from fixation_gym.envs.shapes import Part, Shape, cage


def _framed(material: str, half_width: float, half_height: float) -> tuple[Part, ...]:
    """A standing pane with a foot wide enough not to topple."""
    foot = Part("box", (0.035, half_width, 0.006), (0.0, 0.0, 0.006 - half_height), finish="rim")
    return (*pane(material, half_width, half_height, (0.0, 0.0, 0.0)), foot)


THINGS: dict[str, tuple[Shape, ...]] = {
    "opaque": (
        Shape("block", (Part("box", (0.030, 0.045, 0.100)),), (0.030, 0.045, 0.100), 0.6),
        Shape("post", (Part("cylinder", (0.030, 0.030, 0.110)),), (0.030, 0.030, 0.110), 0.6),
        Shape("brick", (Part("box", (0.035, 0.070, 0.070)),), (0.035, 0.070, 0.070), 0.8),
    ),
    "translucent": (
        Shape(
            "bottle",
            (
                Part("cylinder", (0.033, 0.033, 0.075), (0.0, 0.0, -0.030), finish="glass"),
                Part("cylinder", (0.013, 0.013, 0.025), (0.0, 0.0, 0.070), finish="glass"),
                Part("cylinder", (0.015, 0.015, 0.008), (0.0, 0.0, 0.097), finish="rim"),
                Part("cylinder", (0.0335, 0.0335, 0.022), (0.0, 0.0, -0.030), finish="label"),
            ),
            (0.033, 0.033, 0.105),
            0.5,
        ),
        Shape(
            "tumbler",
            (
                Part("cylinder", (0.040, 0.040, 0.065), finish="glass"),
                Part("cylinder", (0.0405, 0.0405, 0.004), (0.0, 0.0, 0.063), finish="rim"),
                Part("cylinder", (0.0405, 0.0405, 0.006), (0.0, 0.0, -0.061), finish="rim"),
            ),
            (0.040, 0.040, 0.067),
            0.4,
        ),
        Shape("panel", _framed("translucent", 0.075, 0.090), (0.035, 0.075, 0.090), 0.6),
    ),
    "mirror": (Shape("mirror", _framed("mirror", 0.075, 0.100), (0.035, 0.075, 0.100), 0.7),),
    "glass": (
        Shape("tumbler", (Part("cylinder", (0.040, 0.040, 0.060), finish="cup"),), (0.040, 0.040, 0.060), 0.4),
        Shape(
            "water_bottle",
            (
                Part("cylinder", (0.036, 0.036, 0.075), (0.0, 0.0, -0.030), finish="water"),
                Part("cylinder", (0.013, 0.013, 0.025), (0.0, 0.0, 0.070), finish="glass"),
                Part("cylinder", (0.015, 0.015, 0.008), (0.0, 0.0, 0.097), finish="rim"),
            ),
            (0.036, 0.036, 0.105),
            0.7,
        ),
        Shape(
            "ball",
            (
                Part("sphere", (0.045, 0.045, 0.045), (0.0, 0.0, 0.013), finish="glass"),
                Part("cylinder", (0.030, 0.030, 0.015), (0.0, 0.0, -0.043), finish="rim"),
            ),
            (0.045, 0.045, 0.058),
            0.6,
        ),
        Shape("slab", (Part("box", (0.015, 0.060, 0.090), finish="glass"),), (0.015, 0.060, 0.090), 0.8),
    ),
    "chrome": (
        Shape("chrome_post", (Part("cylinder", (0.030, 0.030, 0.110), finish="chrome"),), (0.030, 0.030, 0.110), 0.8),
        Shape("brushed_post", (Part("cylinder", (0.035, 0.035, 0.090), finish="brushed"),), (0.035, 0.035, 0.090), 0.8),
        Shape(
            "chrome_ball",
            (
                Part("sphere", (0.045, 0.045, 0.045), (0.0, 0.0, 0.013), finish="chrome"),
                Part("cylinder", (0.030, 0.030, 0.015), (0.0, 0.0, -0.043), finish="rim"),
            ),
            (0.045, 0.045, 0.058),
            0.6,
        ),
    ),
    "lacquer": (
        Shape("block", (Part("box", (0.030, 0.045, 0.090), finish="lacquer"),), (0.030, 0.045, 0.090), 0.6),
        Shape("post", (Part("cylinder", (0.030, 0.030, 0.100), finish="lacquer"),), (0.030, 0.030, 0.100), 0.6),
    ),
    "plastic": (
        Shape("can", (Part("cylinder", (0.035, 0.035, 0.085), finish="plastic"),), (0.035, 0.035, 0.085), 0.4),
        Shape("case", (Part("box", (0.030, 0.050, 0.080), finish="plastic"),), (0.030, 0.050, 0.080), 0.4),
    ),
    "wire": (Shape("cage", cage(0.055, 0.065, 0.090, 0.003), (0.055, 0.065, 0.090), 0.5),),
}
"""Things of each material that stand on the table, at scale 1."""
