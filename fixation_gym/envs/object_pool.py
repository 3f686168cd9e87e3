"""Shapes of targets, and the pool of bodies that a compiled model holds for them.

Targets live in the compiled model from the start; a scene shows and scales the one it needs, and scale 1 is the
largest. Obstacles are put together at reset out of a pool of parts.
"""

from __future__ import annotations

from fixation_gym.envs.shapes import Part, Shape, ring

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


_BY_NAME = {shape.name: shape for shape in TARGET_SHAPES}


def target_shape(name: str) -> Shape:
    """The target shape of that name."""
    return _BY_NAME[name]
