"""What a replay has perceived so far: rows and sums."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.distance.calibrating_filter import CalibratingSettings
from fixation_gym.perception.zero_flow.answering_pixels import answering_pixels
from fixation_gym.replay.looks import Look
from fixation_gym.replay.rows import Row, row_of
from fixation_gym.replay.scores import distance_summary, map_counts, map_summary, mask_summary, overlap
from fixation_gym.replay.triangulation import Sight, sight_of, triangulation_summary


class Done:
    """Rows and sums; pictures are not kept."""

    def __init__(self, camera: Intrinsics, learning: CalibratingSettings) -> None:
        """Start with nothing.

        Args:
            camera: of the undistorted pictures.
            learning: what the calibrating estimator expects.
        """
        self.rows: list[Row] = []
        self.seconds: list[float] = []
        self._camera, self._learning = camera, learning
        self._sights: list[Sight] = []
        self._overlaps: list[float] = []
        self._counts: Counter[str] = Counter()
        self._maps = 0

    def add(self, look: Look) -> Row:
        """Note a look; returns its row."""
        self._sights.append(sight_of(look, self._learning))
        mask, shared = look.truth.mask, None
        if mask is not None:
            shared = overlap(look.percept.segmentation.mask, mask)
            self._overlaps.append(shared)
        row = row_of(look, self._camera, shared)
        before = look.map_truth
        if not row["no_map"] and before is not None and before.depth is not None and before.distance_m is not None:
            answering = answering_pixels(look.percept.zfc, before.rgb)
            self._counts += map_counts(look.percept.zfc, answering, before.depth, before.distance_m, before.target)
            self._maps += 1
        self.rows.append(row)
        self.seconds.append(look.perception_s)
        return row

    def scores(self) -> dict[str, Any]:
        """Against truth; None where there is none."""
        return {
            "distance": distance_summary(self.rows),
            "map": map_summary(self._counts, self._maps) if self._maps else None,
            "mask": mask_summary(np.array(self._overlaps)) if self._overlaps else None,
            "triangulation": triangulation_summary(self._sights, self._learning),
        }
