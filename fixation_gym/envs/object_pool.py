"""Shapes of targets and of single things, and the pool of bodies that a compiled model holds for them.

Targets live in the compiled model from the start; a scene shows and scales the one it needs, and scale 1 is the
largest. Obstacles are put together at reset out of a pool of parts.
"""

from __future__ import annotations

from fixation_gym.envs.shapes import Part, Shape, cage, pane, ring

SLOTS = (30, 14, 14, 14, 12, 12, 10, 10, 10)
"""Numbers of parts of the bodies that obstacles can take, the largest first."""
MAX_OBSTACLES = len(SLOTS)

TARGET_SHAPES: tuple[Shape, ...] = (
    Shape("box", (Part("box", (0.035, 0.035, 0.035)),), (0.035, 0.035, 0.035), 0.15),
    Shape("cylinder", (Part("cylinder", (0.035, 0.035, 0.04)),), (0.035, 0.035, 0.04), 0.15),
    Shape("ball", (Part("sphere", (0.035, 0.035, 0.035)),), (0.035, 0.035, 0.035), 0.12),
    Shape("ring", ring(0.035, 0.035, 0.004, 12), (0.035, 0.035, 0.035), 0.10),
    Shape(
        "duck",
        (
            Part("ellipsoid", (0.045, 0.035, 0.026), (-0.005, 0.0, -0.012)),
            Part("sphere", (0.020, 0.020, 0.020), (0.020, 0.0, 0.022)),
            Part("ellipsoid", (0.012, 0.009, 0.005), (0.040, 0.0, 0.018)),
            Part("ellipsoid", (0.014, 0.010, 0.010), (-0.042, 0.0, 0.000), pitch=0.5),
            # A flat foot so that it stands: an ellipsoid alone rolls.
            Part("box", (0.022, 0.018, 0.008), (-0.005, 0.0, -0.034)),
        ),
        (0.055, 0.035, 0.042),
        0.12,
    ),
)


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
    "wire": (Shape("cage", cage(0.055, 0.065, 0.090, 0.003), (0.055, 0.065, 0.090), 0.5),),
}
"""Things of each material that stand on the table, at scale 1."""


def target_shape(name: str) -> Shape:
    """The target shape of that name."""
    return next(shape for shape in TARGET_SHAPES if shape.name == name)
