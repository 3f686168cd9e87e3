"""Obstacles that compiled code draws are of the kind that was asked for."""

import numpy as np
import pytest

from fixation_gym.envs import obstacle_parts
from fixation_gym.envs.obstacle_kinds import KIND_NAMES, kinds_of
from fixation_gym.envs.part_rows import COLUMNS, MOST_PARTS, parts_of
from fixation_gym.envs.shapes import MATERIALS


@pytest.mark.parametrize("kind", KIND_NAMES)
def test_the_order_of_kinds_is_that_of_their_names(kind):
    for material, name in enumerate(MATERIALS):
        if kind not in [made.name for made in kinds_of(name)]:
            continue
        rows = np.zeros((MOST_PARTS, COLUMNS))
        count = getattr(obstacle_parts, f"_{kind}")(rows, material, np.random.default_rng(4))
        assert obstacle_parts.draw_parts(kind, name, np.random.default_rng(4)) == parts_of(rows[:count])
