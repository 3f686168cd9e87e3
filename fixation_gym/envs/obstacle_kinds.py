"""Kinds of obstacles: where each of them stands. ``obstacle_parts.py`` has what they look like."""

from __future__ import annotations

from dataclasses import dataclass

from fixation_gym.envs.shapes import MATERIALS


@dataclass(frozen=True)
class ObstacleKind:
    """One kind of obstacle."""

    name: str
    distance: tuple[float, float]
    """Range of the horizontal distance between its place and the target, m; 0 for what stands around it."""
    steepness: tuple[float, float]
    """Range of the sine of the elevation in which it is seen from the target, for what stands beside it."""
    around: bool = False
    """Whether it stands around the target."""
    materials: tuple[str, ...] = MATERIALS


def kinds_of(material: str) -> tuple[ObstacleKind, ...]:
    """Kinds that exist in a material."""
    return tuple(kind for kind in OBSTACLE_KINDS if material in kind.materials)


OBSTACLE_KINDS: tuple[ObstacleKind, ...] = (
    ObstacleKind("thing", (0.08, 0.30), (0.0, 0.75)),
    ObstacleKind("wall", (0.06, 0.30), (0.0, 0.9)),
    ObstacleKind("leaning_board", (0.08, 0.30), (0.0, 0.9)),
    ObstacleKind("arch", (0.06, 0.30), (0.2, 0.9)),
    ObstacleKind("hanging", (0.02, 0.28), (0.5, 1.0)),
    ObstacleKind("roof", (0.04, 0.28), (0.6, 1.0)),
    ObstacleKind("shelf", (0.04, 0.28), (0.5, 1.0)),
    ObstacleKind("cabinet", (0.0, 0.12), (0.0, 1.0), around=True),
    ObstacleKind("niche", (0.0, 0.10), (0.0, 1.0), around=True),
    ObstacleKind("bin", (0.0, 0.08), (0.0, 1.0), around=True),
)
KIND_NAMES = tuple(kind.name for kind in OBSTACLE_KINDS)
