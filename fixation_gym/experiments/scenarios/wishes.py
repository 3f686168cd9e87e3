"""What each of the four hard scenes holds, before it is known from where it is looked at."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fixation_gym.experiments.scenarios.things import Wish

_SIDE, _BORDER = (0.08, 0.40), (0.30, 0.46)
"""Horizontal image position of things, normalised; the image ends at 0.52."""
_TOLD = 0.15
"""Of the things in front of a target without a stand, the share that the table alone tells."""
_HIGHEST_ROW, _TOLD_ROWS = -0.33, (0.05, 0.30)
"""Normalised row of the middle of the highest things, and rows where the table may tell; the image ends at 0.39."""


def _opaque_scene(variant: str, rise: float, rng: np.random.Generator) -> list[Wish]:
    """Two in front, one on each side, and two behind."""
    signs = rng.permutation([-1.0, 1.0])
    return [_solid(variant, rise, in_front, sign, rng) for in_front in (True, False) for sign in signs]


def _see_through_scene(variant: str, rise: float, rng: np.random.Generator) -> list[Wish]:
    """One across the line of sight, or at the border, and something solid behind."""
    sign = float(rng.choice((-1.0, 1.0)))
    border = variant == "border"
    told, row = _told_and_row(rise, True, rng)
    if not border:  # what is across hides the target's lower edge, and of that on the table the table beneath it
        told, row = not rise, float(rng.uniform(-0.08, 0.08))
    glass = Wish(
        "translucent",
        in_front=True,
        columns=_on_side(sign, _BORDER) if border else (-0.05, 0.05),
        row=row,
        told=told,
        scales=(0.5, 0.8),
        across=not border,
    )
    return [glass, _solid(variant, rise, False, -sign, rng)]


def _glass_scene(variant: str, rise: float, rng: np.random.Generator) -> list[Wish]:
    """The same with what bends light: a tumbler, a bottle of water, a ball or a slab."""
    glass, solid = _see_through_scene(variant, rise, rng)
    return [replace(glass, kind="glass"), solid]


def _chrome_scene(variant: str, rise: float, rng: np.random.Generator) -> list[Wish]:
    """Two posts or balls of chrome or brushed metal in front, one on each side, and two solid things behind."""
    first, second, *behind = _opaque_scene(variant, rise, rng)
    return [replace(first, kind="chrome"), replace(second, kind="chrome"), *behind]


def _mirror_scene(variant: str, rise: float, rng: np.random.Generator) -> list[Wish]:
    """A mirror beside the line of sight, something solid in front on the other side, and behind on both."""
    sign = float(rng.choice((-1.0, 1.0)))
    columns = _on_side(sign, _BORDER if variant == "border" else (0.20, 0.30))
    told, row = _told_and_row(rise, True, rng)
    sides = ((True, -sign), (False, -sign), (False, sign))
    beside = "lateral" if variant == "border" else variant  # on the side of the mirror the border is taken
    others = [_solid(variant if side != sign else beside, rise, in_front, side, rng) for in_front, side in sides]
    return [Wish("mirror", True, columns, row, told), *others]


def _reflection_scene(variant: str, rise: float, rng: np.random.Generator) -> list[Wish]:
    """A mirror in front that shows a solid thing: the image appears in front, where the mirror is, but lies behind."""
    sign = float(rng.choice((-1.0, 1.0)))
    columns = _on_side(sign, (0.36, 0.46) if variant == "border" else (0.26, 0.36))
    mirror = Wish("mirror", True, columns, told=None, nearness=(0.60, 0.78), scales=(0.9, 1.0))
    solid = Wish("opaque", False, columns, plain=variant == "plain", scales=(0.4, 0.7))
    return [mirror, solid]


def _solid(variant: str, rise: float, in_front: bool, sign: float, rng: np.random.Generator) -> Wish:
    """A solid thing on one side of the image; at the border in that variant."""
    columns = _on_side(sign, _BORDER if variant == "border" else _SIDE)
    told, row = _told_and_row(rise, in_front, rng)
    return Wish("opaque", in_front, columns, row, told, plain=variant == "plain")


def _told_and_row(rise: float, in_front: bool, rng: np.random.Generator) -> tuple[bool, float]:
    """Whether the table alone tells the side of a thing, and the row of its middle.

    Rows are those that a thing behind can have, also for what is in front, so that they do not tell the side: the
    higher the stand, the lower in the image is what stands on the table behind.
    """
    if in_front and not rise and rng.random() < _TOLD:
        return True, float(rng.uniform(*_TOLD_ROWS))
    return False, float(rng.uniform(_HIGHEST_ROW, (rise - 0.09) / 0.46))


def _on_side(sign: float, columns: tuple[float, float]) -> tuple[float, float]:
    """Range of columns on one side of the image."""
    low, high = sorted(sign * column for column in columns)
    return float(low), float(high)


WISHES = {
    "opaque": _opaque_scene,
    "see_through": _see_through_scene,
    "mirror": _mirror_scene,
    "reflection": _reflection_scene,
    "glass": _glass_scene,
    "chrome": _chrome_scene,
}
"""Wishes by scene, for a variant, the height of the stand under the target in m, and a generator."""
