"""Which body of the pool each obstacle takes."""

from __future__ import annotations

from collections.abc import Sequence

from fixation_gym.envs.object_pool import SLOTS
from fixation_gym.envs.scene import ObstacleSpec


def slots_for(obstacles: Sequence[ObstacleSpec]) -> list[str]:
    """Names of bodies for obstacles in their order: those with the most parts take the largest ones."""
    by_size = sorted(range(len(obstacles)), key=lambda index: -len(obstacles[index].shape.parts))
    slots = [""] * len(obstacles)
    for slot, index in enumerate(by_size):
        slots[index] = f"obstacle{slot}"
    return slots


def fits_pool(obstacles: Sequence[ObstacleSpec]) -> bool:
    """Whether the pool has enough bodies with enough parts for these obstacles."""
    sizes = sorted((len(obstacle.shape.parts) for obstacle in obstacles), reverse=True)
    return len(sizes) <= len(SLOTS) and all(size <= slot for size, slot in zip(sizes, SLOTS, strict=False))
